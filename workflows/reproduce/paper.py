"""The paper as the report has it: which figures, claims, scenes and fits, in which order."""

from typing import Any

from chaincor.workflows.reproduce.claims import Claim, claims_of
from chaincor.workflows.reproduce.drawing import Figure
from chaincor.workflows.reproduce.figures import (
    agreement,
    breaking_and_two_restitutions,
    contacts_and_restitution,
    harmonic_contacts,
    harmonic_lengths,
    increase,
    lj_lengths,
    mode_spectra,
    order,
    pair,
    restitution_curves,
    schematic,
    slope,
    slow_chains,
    trajectories,
)
from chaincor.workflows.reproduce.free_flight import FreeFlight
from chaincor.workflows.reproduce.measurements import Measurements, Study
from chaincor.workflows.reproduce.plan import Plan

# In the order of the paper's text.
CLAIMS: tuple[Claim, ...] = (
    *claims_of(trajectories),
    *claims_of(order),
    *claims_of(harmonic_contacts),
    *claims_of(harmonic_lengths),
    *claims_of(restitution_curves),
    *claims_of(lj_lengths),
    *claims_of(pair),
    *claims_of(slope),
    *increase.CLAIMS,
    *claims_of(contacts_and_restitution),
)


def studies(plan: Plan) -> tuple[Study, ...]:
    """Return all studies of a plan; scenes that occur in several are computed once."""
    figures = (
        *(restitution_curves, harmonic_lengths, harmonic_contacts, lj_lengths, increase, slope),
        *(pair, order, slow_chains),
    )
    studies = (figure.study(plan) for figure in figures)
    return (*studies, harmonic_lengths.study_of_longest(plan))


def fits(measured: Measurements) -> list[dict[str, Any]]:
    """Return all fits, those that are judged before those that tell how they depend on ranges."""
    figures = (harmonic_lengths, lj_lengths, increase, slope)
    return [row for figure in figures for row in figure.fits(measured)]


def figures(measured: Measurements, flights: tuple[FreeFlight, ...]) -> tuple[Figure, ...]:
    """Return all figures: those of the paper, in its order, and those beyond it."""
    return (
        schematic.figure(),
        trajectories.figure(measured),
        harmonic_lengths.figure(measured),
        restitution_curves.figure(measured),
        lj_lengths.figure(measured),
        increase.figure(measured),
        contacts_and_restitution.figure(measured),
        pair.figure(measured),
        slope.figure(measured),
        slow_chains.figure(measured),
        mode_spectra.figure(flights),
        breaking_and_two_restitutions.figure(flights),
        agreement.figure(measured),
    )
