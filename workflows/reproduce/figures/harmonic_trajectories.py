"""Trajectories of the harmonic chain (NH figure 2): n = 19 of the text, n = 20 of the caption."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.figures.style import BLUE, GREY, ORANGE, VERMILION, new_figure
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.reproduce.figures.figure import Figure
from chaincor.workflows.reproduce.tables import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

SIZES = (19, 20)
# Fast enough that the compression is seen in the drawing; eta does not depend on it.
_VELOCITY = 0.4
_NUMERICS = Numerics(scheme="order8", timestep=0.1)
_FRAME_INTERVAL = 0.1
# In crossings of sound: the contacts and what follows at once.
_SHOWN = 2.25


@dataclass(frozen=True)
class Trajectory:
    """The motion of one harmonic chain by LAMMPS, with frames."""

    particles: int
    outcome: Outcome
    restitution: float


def run_trajectories() -> tuple[Trajectory, ...]:
    """Run the chains of 19 and 20 in LAMMPS, order 8 at H = 0.1, with frames."""
    found = []
    for n in SIZES:
        scene = Scene(potential="harmonic", particles=n, velocity=_VELOCITY)
        outcome = lammps.run(scene, _NUMERICS, _FRAME_INTERVAL)
        found.append(Trajectory(n, outcome, float(np.mean(outcome.velocities) / _VELOCITY) ** 2))
    return tuple(found)


def trajectories(found: tuple[Trajectory, ...]) -> Figure:
    """Return the figure."""
    etas = "; ".join(f"n = {t.particles}: η = {t.restitution:.6f}" for t in found)
    return Figure(
        key="trajectories",
        title="Trajectories of harmonic chains of 19 and 20 particles",
        caption=(
            "The paper's figure 2, whose text says n = 19 and whose caption says n = 20. LAMMPS, "
            f"steps of order 8 and length {_NUMERICS.timestep}, v₀ = {_VELOCITY} speeds of sound. "
            "Blue: particle 1; grey: the others. Dots are contacts; "
            "the dashed line is sound, in the material, to the free end and back: contact ends "
            f"near 2τ. {etas}."
        ),
        table=_table(found),
        draw=lambda: _draw(found),
        alt=(
            "Distances from the wall against time: the chain is compressed from the wall end to "
            "the free end while particle 1 hits the wall again and again, and leaves after about "
            "two crossings of sound."
        ),
    )


def _table(found: tuple[Trajectory, ...]) -> Table:
    rows = []
    for trajectory in found:
        frames = trajectory.outcome.frames
        assert frames is not None
        for time, displacements in zip(frames.times, frames.displacements, strict=True):
            for i, u in enumerate(displacements):
                rows.append((trajectory.particles, float(time), i + 1, float(i + u)))
    return Table(("particles", "time", "particle", "position"), tuple(rows))


def _draw(found: tuple[Trajectory, ...]) -> "Canvas":
    figure, panels = new_figure(len(found), 1, figsize=(6.4, 7.0), sharex=True)
    for ax, trajectory in zip(panels, found, strict=True):
        n, outcome = trajectory.particles, trajectory.outcome
        frames = outcome.frames
        assert frames is not None
        crossing = n - 1.0
        shown = frames.times <= _SHOWN * crossing
        time = frames.times[shown] / crossing
        x = frames.displacements[shown] + np.arange(n)
        ax.plot(
            time, x[:, 1:], color=GREY, linewidth=0.7, label=["particles 2 to n"] + [None] * (n - 2)
        )
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
        ax.set_title(f"n = {n}")
        ax.set_xlim(0.0, _SHOWN)
        ax.set_ylim(-0.6, 1.3 * n)
        ax.legend(loc="upper left", ncols=4, handlelength=1.2, columnspacing=1.0, fontsize=8)
        ax.set_ylabel("distance from the wall (bonds)")
    panels[-1].set_xlabel(r"time / $\tau$,  $\tau = (n-1)\,\ell/c_l$")
    return figure
