"""All figures of the report, the paper's first and in its order."""

from chaincor.workflows.reproduce.figures.against_length import harmonic_lengths, lj_lengths
from chaincor.workflows.reproduce.figures.against_speed import (
    contacts_and_restitution,
    restitution_curves,
)
from chaincor.workflows.reproduce.figures.at_low_speed import (
    increase_figure,
    pair_figure,
    slope_figure,
)
from chaincor.workflows.reproduce.figures.breaking import breaking_and_two_restitutions
from chaincor.workflows.reproduce.figures.engines_compared import agreement
from chaincor.workflows.reproduce.figures.figure import Figure
from chaincor.workflows.reproduce.figures.harmonic_trajectories import (
    run_trajectories,
    trajectories,
)
from chaincor.workflows.reproduce.figures.schematic import schematic
from chaincor.workflows.reproduce.figures.spectra import mode_spectra
from chaincor.workflows.reproduce.findings.free_flight import FreeFlight
from chaincor.workflows.reproduce.findings.harmonic import HarmonicLaw
from chaincor.workflows.reproduce.measurements import Measurements


def all_figures(
    measured: Measurements, law: HarmonicLaw, flights: tuple[FreeFlight, ...]
) -> tuple[Figure, ...]:
    """Return all figures, in the order of the report."""
    return (
        schematic(),
        trajectories(run_trajectories()),
        harmonic_lengths(measured, law),
        restitution_curves(measured),
        lj_lengths(measured),
        increase_figure(measured),
        contacts_and_restitution(measured),
        pair_figure(measured),
        slope_figure(measured),
        mode_spectra(flights),
        breaking_and_two_restitutions(flights),
        agreement(measured),
    )
