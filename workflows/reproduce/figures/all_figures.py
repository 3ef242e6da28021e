"""All figures of the report, the paper's first and in its order."""

from workflows.reproduce.figures.agreement import agreement
from workflows.reproduce.figures.figure import Figure
from workflows.reproduce.figures.lengths import harmonic_lengths, lj_lengths
from workflows.reproduce.figures.low_speed import increase_figure, pair_figure, slope_figure
from workflows.reproduce.figures.schematic import schematic
from workflows.reproduce.figures.spectra import mode_spectra
from workflows.reproduce.figures.speeds import (
    breaking_and_two_restitutions,
    contacts_and_restitution,
    restitution_curves,
)
from workflows.reproduce.figures.trajectories import run_trajectories, trajectories
from workflows.reproduce.findings.harmonic import HarmonicLaw
from workflows.reproduce.measurements import Measurements


def all_figures(measured: Measurements, law: HarmonicLaw) -> tuple[Figure, ...]:
    """
    Return all figures.

    Parameters
    ----------
    measured : Measurements
        All points.
    law : HarmonicLaw
        Fits to harmonic chains.

    Returns
    -------
    tuple of Figure
        In the order of the report.
    """
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
        mode_spectra(measured),
        breaking_and_two_restitutions(measured),
        agreement(measured),
    )
