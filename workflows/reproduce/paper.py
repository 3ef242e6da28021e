"""List the contents of the report: claims, studies, figures and questions."""

from collections.abc import Callable

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
    pair,
    restitution_curves,
    schematic,
    slope,
    slow_chains,
    trajectories,
)
from chaincor.workflows.reproduce.free_flight import FreeFlight
from chaincor.workflows.reproduce.measurements import Measurements, NoNumber
from chaincor.workflows.reproduce.plan import ReproductionPlan, Study

# Modules with claims, in the order of the paper's text.
CLAIMS: tuple[Claim, ...] = (
    *claims_of(trajectories),
    *claims_of(harmonic_contacts),
    *claims_of(harmonic_lengths),
    *claims_of(restitution_curves),
    *claims_of(lj_lengths),
    *claims_of(pair),
    *claims_of(slope),
    *increase.CLAIMS,
    *claims_of(contacts_and_restitution),
)


def studies(plan: ReproductionPlan) -> tuple[Study, ...]:
    """Return all studies in a plan. A scene in several studies is computed only once."""
    figures = (
        *(restitution_curves, harmonic_lengths, harmonic_contacts, lj_lengths, increase, slope),
        *(pair, trajectories, slow_chains),
    )
    return (*(figure.study(plan) for figure in figures), harmonic_lengths.study_of_longest(plan))


def figures(measured: Measurements, flights: tuple[FreeFlight, ...]) -> tuple[Figure, ...]:
    """Return the paper's figures in the paper's order, then further figures."""
    measured_ones = (
        *(schematic, trajectories, harmonic_lengths, restitution_curves, lj_lengths, increase),
        *(contacts_and_restitution, pair, slope, slow_chains),
    )
    return (
        *(module.figure(measured) for module in measured_ones),
        *(m.figure(flights) for m in (mode_spectra, breaking_and_two_restitutions) if flights),
        agreement.figure(measured),
    )


def _answer(find: Callable[[Measurements], str], measured: Measurements) -> str:
    try:
        return find(measured)
    except NoNumber as reason:
        return str(reason)


def readings(measured: Measurements) -> dict[str, str]:
    """Return, for each question that the paper leaves open, which answer we assume."""
    chains = measured.select("harmonic_velocities", "harmonic")
    harmonic_loss = f"{chains[0].dissipation:.4f}" if chains else "–"
    return {
        "Does v₀ in its figures mean v₀/v*?": _answer(restitution_curves.unit_of_speed, measured),
        "What is the v of its formulas?": (
            "In section II, v is the speed at which particle 1 reaches the wall. "
            "In eqs. (16) to (20), the paper soon drops the tilde of v₀/v*, so v ≪ "
            "1, C v and v > 1 are in units of v*, and C is (1 − η)/(v₀/v*). This "
            "report writes v₀/v* there."
        ),
        "In eqs. (18) and (20), is it 1 − η or its increase?": (
            "They give the increase over the harmonic chain of the same length, as "
            "in figure 6. The equations are derived for n → ∞, where the harmonic "
            "chain loses nothing and both quantities are equal. At n = "
            f"{measured.plan.curve_particles}, a harmonic chain loses "
            f"{harmonic_loss}."
        ),
        "How long are its chains?": (
            "The paper says 100 for figure 4 only. Figures 6 and 7 are also "
            f"computed here with n = {measured.plan.curve_particles}. C = 0.66 "
            "depends on the length and is computed here for several lengths."
        ),
        "What do the three middle speeds of figure 5 say?": lj_lengths.middle_speeds(measured),
        "Which of its statements have no verdict?": (
            "That Δt shortens with speed (its power is judged); that hard-core behaviour is the "
            "cause of η → 1; that at high speed real bodies deform instead; those on other models "
            "and experiments in section I (two are among the [slips](#slips))."
        ),
        "Were its figures compared point by point?": (
            "No. This report uses the paper's text, formulas and captions, and "
            "judges the numbers and words in them. Our figures show the same "
            "quantities, so that readers can compare them with the paper."
        ),
        "Over which ranges did it fit?": (
            "The paper states no range, neither for C = 0.66 nor for the slopes of "
            "figure 6. We fit all of them over one decade, from 0.01 to 0.1 v*, "
            "because the paper's slowest speed is 0.008 v* and its text speaks of "
            "v ≪ 1. Fits over the halves of this decade, and up to the fastest "
            "speed, show how much the results depend on the range."
        ),
    }


def beyond(measured: Measurements, flights: tuple[FreeFlight, ...]) -> dict[str, str]:
    """Return results on questions that the paper does not ask."""
    return {
        "Does dissipation vanish in long chains at some speed v₀ > 0?": _answer(
            lj_lengths.long_chains, measured
        ),
        "What becomes of C in the limit n → ∞?": _answer(slow_chains.infinite_chain, measured),
        "Where does the lost energy sit?": mode_spectra.lost_energy(flights),
        "When do lj chains break?": breaking_and_two_restitutions.breaking(flights),
        "Which restitution is meant?": restitution_curves.both_restitutions(measured),
    }
