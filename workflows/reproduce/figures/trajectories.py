"""Trajectories of the harmonic chain (NH figure 2): n = 19 of the text, n = 20 of the caption."""

from functools import cache
from typing import Any

import numpy as np

from chaincor.analysis.figures.style import BLUE, GREY, ORANGE, VERMILION, new_figure
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.reproduce.claims import Finding, claim, words
from chaincor.workflows.reproduce.drawing import Axes, Canvas, Figure
from chaincor.workflows.reproduce.measurements import Measurements, NoNumber

# Fast enough that the compression is seen in the drawing; eta does not depend on it.
VELOCITY = 0.4
_NUMERICS = Numerics(scheme="order8", timestep=0.1)
_FRAME_INTERVAL = 0.1
# In crossings of sound: the contacts and what follows at once.
_SHOWN = 2.25


@claim(
    "section II",
    "contact time t_c is almost 2τ for large n",
    words(2.0),
    "contact time 2τ",
    figure="trajectories",
)
def _contact_time(measured: Measurements) -> Finding:
    points = measured.select("harmonic_sizes", "harmonic")
    long = [p for p in points if p.particles >= 100]
    if not long:
        raise NoNumber("no chain of 100 or more")
    ratios = [p.answer.result["last_contact_time"] / (p.particles - 1.0) for p in long]
    last = max(long, key=lambda p: p.particles)
    return Finding(
        float(np.mean(ratios)),
        float(np.ptp(ratios)) / 2.0,
        f"mean of t_c/τ over {len(long)} chains, n = {min(p.particles for p in long)} to "
        f"{last.particles}, ± half of their span; {ratios[long.index(last)]:.4f} for the longest",
        long,
    )


@cache
def followed(particles: int) -> Outcome:
    """Run a chain in LAMMPS and keep its frames; its speed is `VELOCITY`."""
    scene = Scene(potential="harmonic", particles=particles, velocity=VELOCITY)
    return lammps.run(scene, _NUMERICS, _FRAME_INTERVAL)


def figure(measured: Measurements) -> Figure:
    """Run the chains of 19 and 20 in LAMMPS and return the figure; it uses no measurements."""
    runs = {n: followed(n) for n in (19, 20)}
    etas = "; ".join(
        f"n = {n}: η = {float(np.mean(outcome.velocities) / VELOCITY) ** 2:.6f}"
        for n, outcome in runs.items()
    )
    return Figure(
        key="trajectories",
        title="Trajectories of harmonic chains of 19 and 20 particles",
        caption=(
            "The paper's figure 2, whose text says n = 19 and whose caption says n = 20. LAMMPS, "
            f"steps of order 8 and length {_NUMERICS.timestep}, v₀ = {VELOCITY} speeds of sound. "
            "Blue: particle 1; grey: the others. Dots are contacts; "
            "the dashed line is sound, in the material, to the free end and back: contact ends "
            f"near 2τ. {etas}."
        ),
        records=_records(runs),
        draw=lambda: _draw(runs),
        alt=(
            "Distances from the wall against time: the chain is compressed from the wall end to "
            "the free end while particle 1 hits the wall again and again, and leaves after about "
            "two crossings of sound."
        ),
    )


def _records(runs: dict[int, Outcome]) -> list[dict[str, Any]]:
    records = []
    for n, outcome in runs.items():
        assert outcome.frames is not None
        for time, row in zip(outcome.frames.times, outcome.frames.displacements, strict=True):
            records += [
                {"particles": n, "time": float(time), "particle": i + 1, "position": float(i + u)}
                for i, u in enumerate(row)
            ]
    return records


def _draw(runs: dict[int, Outcome]) -> Canvas:
    canvas, panels = new_figure(len(runs), 1, figsize=(6.4, 7.0), sharex=True)
    for ax, (n, outcome) in zip(panels, runs.items(), strict=True):
        _draw_one(ax, n, outcome)
    panels[-1].set_xlabel(r"time / $\tau$,  $\tau = (n-1)\,\ell/c_l$")
    return canvas


def _draw_one(ax: Axes, n: int, outcome: Outcome) -> None:
    frames = outcome.frames
    assert frames is not None
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
    contacts = outcome.contact_times / crossing
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
