"""Draw the harmonic chain's trajectories (NH figure 2), and judge claims about them."""

from functools import cache

import numpy as np

from chaincor.analysis.figures.style import BLUE, GREY, ORANGE, VERMILION
from chaincor.analysis.theory import basile_dumont_energies
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.outcome import Frames, Outcome
from chaincor.workflows.reproduce.claims import TREND, ClaimFinding, claim, exact, words
from chaincor.workflows.reproduce.drawing import Axes, Figure
from chaincor.workflows.reproduce.figures.harmonic_contacts import (
    difference_over_velocities,
    paper_chain,
)
from chaincor.workflows.reproduce.measurements import Answer, Measurements, NoNumber
from chaincor.workflows.reproduce.plan import ReproductionPlan, Study, harmonic_chains

_KEY = "trajectories"
# At this impact speed the compression is visible in the figure. The eta of a harmonic chain does
# not depend on the speed.
_VELOCITY = 0.4
_NUMERICS = Numerics(scheme="order8", timestep=0.1)
_FRAME_INTERVAL = 0.1
# The figure covers this many sound crossings, which include all contacts and a short time
# afterwards.
_SHOWN = 2.25
# Impact speeds in units of the speed of sound. The wall compresses bonds by v0, and the front
# overshoots, so the coordinates of particles may cross.
_FAST = (0.6, 0.7, 0.8, 1.0)


def study(plan: ReproductionPlan) -> Study:
    """
    Return the scenes of fast harmonic chains for the reference engine.

    In LAMMPS, too, the coordinates of particles may cross.
    """
    scenes = harmonic_chains((plan.curve_particles,), plan.tolerance, _FAST)
    return Study("order", "fast harmonic chains, for the order of particles", (), scenes)


@claim(
    "section II",
    words(2.0),
    "contact time 2τ",
    text="contact time t_c is almost 2τ for large n",
    figure=_KEY,
)
def _contact_time(measured: Measurements) -> ClaimFinding:
    points = measured.select("harmonic_sizes", "harmonic")
    long = [p for p in points if p.particles >= 100]
    if not long:
        raise NoNumber("no chain of 100 or more")
    ratios = [p.answer.result["last_contact_time"] / (p.particles - 1.0) for p in long]
    last = max(long, key=lambda p: p.particles)
    return ClaimFinding(
        float(np.mean(ratios)),
        float(np.ptp(ratios)) / 2.0,
        f"mean of t_c/τ over {len(long)} chains, n = {min(p.particles for p in long)} to "
        f"{last.particles}, ± half of their span; {ratios[long.index(last)]:.4f} for the longest",
        long,
    )


@cache
def _followed(particles: int) -> tuple[Outcome, Frames]:
    """Run a chain in LAMMPS at the impact speed `_VELOCITY`."""
    scene = Scene(potential="harmonic", particles=particles, velocity=_VELOCITY)
    outcome = lammps.run(scene.problem, _NUMERICS, _FRAME_INTERVAL)
    assert outcome.frames is not None
    return outcome, outcome.frames


@claim(
    "section II",
    TREND,
    "harmonic chains keep the order of their particles",
    text="the order of the particles is always kept",
)
def _order_of_particles(measured: Measurements) -> ClaimFinding:
    points = measured.select("order", "harmonic", 1)
    crossed = {p.scene.impact_velocity: bool(p.answer.result["crossed"]) for p in points}
    kept = [v for v, is_crossed in crossed.items() if not is_crossed]
    passed = [v for v, is_crossed in crossed.items() if is_crossed]
    return ClaimFinding(
        float(not passed),
        0.0,
        f"harmonic, n = {points[0].particles}: particles pass through each "
        f"other at v₀ = {', '.join(f'{v:g}' for v in passed) or 'none'} speeds "
        f"of sound, and not at {', '.join(f'{v:g}' for v in kept) or 'none'}. A "
        "spring may have a negative length; slow chains keep the order",
        points,
        brief=f"not from {min(passed):g} speeds of sound on" if passed else "",
    )


# The error of our number is compared with the distance that the chain travels at v0 in one unit of
# time.
@claim(
    "section II",
    exact(0.0, 1.0),
    "orbits at all speeds are similar",
    text='"similar orbits" at all v₀: differences of u_j/v₀ of any particle are 0',
)
def _similar_orbits(measured: Measurements) -> ClaimFinding:
    return difference_over_velocities(
        measured,
        "u_j/v₀ at the last contact",
        lambda p, a: a.arrays["displacements"] / p.scene.impact_velocity,
    )


@claim(
    "section II",
    TREND,
    "particle 1 has the largest amplitude",
    text="of the vibration under pressure, particle 1 has the largest amplitude",
    figure=_KEY,
)
def _largest_amplitude(measured: Measurements) -> ClaimFinding:
    n = 20
    _, frames = _followed(n)
    # The front passes particle n/4 before the time n/2, and has not returned to this particle at
    # 3n/2.
    pressed = (frames.times > 0.75 * n) & (frames.times < 1.25 * n)
    near = frames.displacements[pressed][:, : n // 4]
    amplitudes = np.std(near, axis=0) / _VELOCITY
    return ClaimFinding(
        float(np.argmax(amplitudes) == 0),
        0.0,
        "standard deviations of the positions of particles 1, 2, … between 0.75 n and 1.25 n, "
        f"while the wall presses, over v₀: {', '.join(f'{a:.3f}' for a in amplitudes)} (n = {n}, "
        'LAMMPS). Our reading of "amplitude"',
    )


@claim(
    "eqs. (7)–(10)",
    words(0.0, 1.0, "1, all energy of vibration"),
    "the spectrum of eq. (7)",
    text="the energies E_j of the modes are eq. (7) with Δt, f and v of eqs. (8)–(10): "
    "difference 0",
)
def _spectrum(measured: Measurements) -> ClaimFinding:
    point = paper_chain(measured)

    def energies(answer: Answer) -> Array:
        return answer.arrays["mode_energies"][1:] / point.scene.impact_velocity**2

    n, found = point.particles, energies(point.answer)
    formula = basile_dumont_energies(n)
    apart = float(np.sum(np.abs(formula - found)) / np.sum(found))
    half = int(np.searchsorted(np.cumsum(found), 0.5 * np.sum(found))) + 1
    low = np.arange(1, n) <= half
    low_apart = float(np.sum(np.abs(formula - found)[low]) / np.sum(found[low]))
    both = [energies(answer) for answer in point.answers]
    error = float(np.sum(np.abs(both[0] - both[-1])) / np.sum(found))
    return ClaimFinding(
        apart,
        error,
        f"sum over j of |E_j of the formula − E_j of the chain| over the sum of the latter, "
        f"{point.origin}; of modes 1 to {half}, which have half of the energy, "
        f"{low_apart:.2f}; of all energy of vibration the formula has "
        f"{float(np.sum(formula) / np.sum(found)):.2f}; ± difference between the engines",
        [point],
    )


def figure(_measured: Measurements) -> Figure:
    """Run chains of 19 and 20 particles in LAMMPS, and return the figure."""
    runs = {n: _followed(n) for n in (19, 20)}
    etas = "; ".join(
        f"n = {n}: η = {float(np.mean(outcome.velocities) / _VELOCITY) ** 2:.6f}"
        for n, (outcome, _) in runs.items()
    )
    positions = [
        {"particles": n, "time": float(time), "particle": i + 1, "position": float(i + u)}
        for n, (_, frames) in runs.items()
        for time, row in zip(frames.times, frames.displacements, strict=True)
        for i, u in enumerate(row)
    ]

    def draw(above: Axes, below: Axes) -> None:
        for ax, (n, (outcome, frames)) in zip((above, below), runs.items(), strict=True):
            _draw_one(ax, n, outcome.contact_times, frames)
        below.set_xlabel(r"time / $\tau$,  $\tau = (n-1)\,\ell/c_l$")

    return Figure(
        key=_KEY,
        title="Trajectories of harmonic chains of 19 and 20 particles",
        caption=(
            "The paper's figure 2, whose text says n = 19 and whose caption says n = 20. LAMMPS, "
            f"steps of order 8 and length {_NUMERICS.timestep}, v₀ = {_VELOCITY} speeds of sound. "
            "Blue: particle 1; grey: the others. Dots are contacts; the dashed line is sound, in "
            f"the material, to the free end and back: contact ends near 2τ. {etas}."
        ),
        alt=(
            "Distances from the wall against time: the chain is compressed from the wall end to "
            "the free end while particle 1 hits the wall again and again, and leaves after about "
            "two crossings of sound."
        ),
        draw=draw,
        records=positions,
        size=(6.4, 7.0),
        panels=(1.0, 1.0),
        sharex=True,
    )


def _draw_one(ax: Axes, n: int, contact_times: Array, frames: Frames) -> None:
    crossing = n - 1.0
    shown = frames.times <= _SHOWN * crossing
    time = frames.times[shown] / crossing
    x = frames.displacements[shown] + np.arange(n)
    others = ["particles 2 to n"] + [None] * (n - 2)
    ax.plot(time, x[:, 1:], color=GREY, linewidth=0.7, label=others)
    ax.plot(time, x[:, 0], color=BLUE, linewidth=1.2, label="particle 1")
    material = np.interp(time, [0.0, 1.0, 2.0, 3.0], [0.0, crossing, 0.0, 0.0])
    places = [np.interp(at, np.arange(n), row) for at, row in zip(material, x, strict=True)]
    inside = time <= 2.0
    ax.plot(time[inside], np.array(places)[inside], "--", color=ORANGE, label="sound")
    contacts = contact_times / crossing
    ax.plot(
        contacts,
        0 * contacts,
        "o",
        color=VERMILION,
        markersize=3.2,
        clip_on=False,
        zorder=3,
        label=f"contacts ({contacts.size})",
    )
    ax.set(title=f"n = {n}", xlim=(0.0, _SHOWN), ylim=(-0.6, 1.3 * n))
    ax.legend(loc="upper left", ncols=4, handlelength=1.2, columnspacing=1.0, fontsize=8)
    ax.set_ylabel("distance from the wall (bonds)")
