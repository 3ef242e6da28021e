"""What section II says of the particles themselves: their order, orbits, amplitudes and modes."""

import numpy as np

from chaincor.analysis.theory import basile_dumont_energies
from chaincor.workflows.reproduce.claims import TREND, Finding, claim, exact, words
from chaincor.workflows.reproduce.figures.harmonic_contacts import compare_velocities, paper_chain
from chaincor.workflows.reproduce.figures.trajectories import VELOCITY, followed
from chaincor.workflows.reproduce.measurements import (
    Answer,
    Measurements,
    NoNumber,
    Point,
    Study,
    harmonic_scene,
)
from chaincor.workflows.reproduce.plan import Plan

_SECTION = "section II"
# In speeds of sound. Bonds are pressed by v0, and more where the front swings beyond it.
_FAST = (0.6, 0.7, 0.8, 1.0)


def study(plan: Plan) -> Study:
    """Return fast harmonic chains, in-house: coordinates of LAMMPS may cross as well."""
    scenes = tuple(harmonic_scene(plan.curve_particles, plan.tolerance, v) for v in _FAST)
    return Study("order", "fast harmonic chains, for the order of particles", (), scenes)


@claim(
    _SECTION,
    "the order of the particles is always kept",
    TREND,
    "harmonic chains keep the order of their particles",
)
def _order_of_particles(measured: Measurements) -> Finding:
    points = measured.select("order", "harmonic", 1)
    crossed = {p.scene.impact_velocity: bool(p.answer.result["crossed"]) for p in points}
    kept = [v for v, is_crossed in crossed.items() if not is_crossed]
    passed = [v for v, is_crossed in crossed.items() if is_crossed]
    return Finding(
        float(not passed),
        0.0,
        f"harmonic, n = {points[0].particles}: particles pass through each other at v₀ = "
        f"{', '.join(f'{v:g}' for v in passed) or 'none'} speeds of sound, and not at "
        f"{', '.join(f'{v:g}' for v in kept) or 'none'}. A spring does not know that its length "
        "cannot be negative; slow chains keep the order",
        points,
        brief=f"not from {min(passed):g} speeds of sound on" if passed else "",
    )


@claim(
    _SECTION,
    '"similar orbits" at all v₀: differences of u_j/v₀ of any particle are 0',
    exact(0.0, 1.0),  # the way of v₀ in a unit of time
    "orbits at all speeds are similar",
)
def _similar_orbits(measured: Measurements) -> Finding:
    def orbits(point: Point, answer: Answer) -> np.ndarray:
        return np.asarray(answer.arrays["displacements"]) / point.scene.impact_velocity

    return compare_velocities(measured, orbits, "u_j/v₀ at the last contact")


@claim(
    _SECTION,
    "of the vibration under pressure, particle 1 has the largest amplitude",
    TREND,
    "particle 1 has the largest amplitude",
    figure="trajectories",
)
def _largest_amplitude(measured: Measurements) -> Finding:
    n = 20
    frames = followed(n).frames
    assert frames is not None
    # The front passes particle n/4 before n/2, and has not come back to it at 3n/2.
    pressed = (frames.times > 0.75 * n) & (frames.times < 1.25 * n)
    near = frames.displacements[pressed][:, : n // 4]
    amplitudes = np.std(near, axis=0) / VELOCITY
    return Finding(
        float(np.argmax(amplitudes) == 0),
        0.0,
        "standard deviations of the positions of particles 1, 2, … between 0.75 n and 1.25 n, "
        f"while the wall presses, over v₀: {', '.join(f'{a:.3f}' for a in amplitudes)} (n = {n}, "
        'LAMMPS). What "amplitude" means is our reading',
    )


@claim(
    "eqs. (7)–(10)",
    "the energies E_j of the modes are eq. (7) with Δt, f and v of eqs. (8)–(10): difference 0",
    words(0.0, 1.0, "1, all energy of vibration"),
    "the spectrum of eq. (7)",
)
def _spectrum(measured: Measurements) -> Finding:
    point = paper_chain(measured)
    if "mode_energies" not in point.answer.arrays:
        raise NoNumber("no energies of modes")

    def energies(answer: Answer) -> np.ndarray:
        return np.asarray(answer.arrays["mode_energies"])[1:] / point.scene.impact_velocity**2

    n, found = point.particles, energies(point.answer)
    formula = basile_dumont_energies(n)
    apart = float(np.sum(np.abs(formula - found)) / np.sum(found))
    half = int(np.searchsorted(np.cumsum(found), 0.5 * np.sum(found))) + 1
    low = np.arange(1, n) <= half
    low_apart = float(np.sum(np.abs(formula - found)[low]) / np.sum(found[low]))
    both = [energies(answer) for answer in point.answers]
    error = float(np.sum(np.abs(both[0] - both[-1])) / np.sum(found))
    return Finding(
        apart,
        error,
        f"sum over j of |E_j of the formula − E_j of the chain| over the sum of the latter, n = "
        f"{n}, {point.engine_name}; of modes 1 to {half}, which have half of the energy, "
        f"{low_apart:.2f}; of all energy of vibration the formula has "
        f"{float(np.sum(formula) / np.sum(found)):.2f}; ± what the engines differ by",
        [point],
    )
