"""Draw the modes' energies and the forms of the lost energy against speed; not in the paper."""

from typing import Any

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, CYCLE, GREEN, MARKERS, VERMILION
from chaincor.workflows.reproduce.drawing import IMPACT_SPEED, Axes, Figure, draw_map
from chaincor.workflows.reproduce.free_flight import AVERAGED_OVER, LAST, FreeFlight

_DECADES = 6.0
# The panel with curves shows those measured speeds that are nearest to these speeds.
_SHOWN = (0.01, 0.1, 0.4, 0.562, 0.78, 2.0, 5.0)


def figure(flights: tuple[FreeFlight, ...]) -> Figure:
    """Return the figure of the modes' kinetic energies and of the forms of the lost energy."""
    until = _harmonic_until(flights)
    worst = max(flights, key=lambda f: f.harmonic / f.point.dissipation)

    def draw(above: Axes, middle: Axes, below: Axes) -> None:
        top = _draw_map(above, flights)
        _draw_curves(middle, flights, top)
        middle.set_xlim(above.get_xlim())
        _draw_forms(below, flights)

    return Figure(
        key="mode_spectra",
        title="Beyond the paper: where the lost energy sits",
        caption=(
            "The figure shows the free flight after the last contact (lj, n = "
            f"{worst.point.particles}), as fractions of the energy at impact. Top "
            "and middle: kinetic energy of each mode j ≥ 1, mean over "
            f"{AVERAGED_OVER:g} crossings of sound. The sum over j is the kinetic "
            "energy of all internal motion for any bonds. In small vibrations the "
            "kinetic energy is half of the mode's energy. In a broken chain, j is "
            "only a wave number, which says how finely the velocity varies along "
            "the chain. Bottom: the lost energy 1 − η consists of kinetic energy "
            "and energy of the bonds (means over the same time). Orange: the "
            f"kinetic energy of whole pieces that fly apart, after {LAST:g} "
            "crossings. Dotted: the sum of harmonic energies of all modes at the "
            f"last contact, as far as it is 1 − η within 1 %, below {until:.2g} v*. "
            "At higher speeds this sum is wrong and is not drawn. At worst it is "
            f"{worst.harmonic:.3f} instead of the lost "
            f"{worst.point.dissipation:.3f}, at {worst.speed:.3g} v*, because a "
            "stretched bond contains less energy than a spring, and harmonic "
            "energies of a broken chain are meaningless."
        ),
        alt=(
            "Slow chains keep energy in long waves, and faster chains in all "
            "wavelengths. Above 1 v*, about half of the lost energy is motion of "
            "separate pieces."
        ),
        draw=draw,
        records=[
            {"speed": f.speed, "mode": j, "kinetic_share": float(share)}
            for f in flights
            for j, share in enumerate(f.kinetic)
        ],
        size=(6.4, 10.2),
        panels=(1.0, 1.0, 1.0),
    )


def _harmonic_until(flights: tuple[FreeFlight, ...]) -> float:
    """Return the lowest speed at which the harmonic energies are wrong by more than 1 %."""
    off = [f.speed for f in flights if abs(f.harmonic / f.point.dissipation - 1.0) > 0.01]
    return min(off, default=float("nan"))


def lost_energy(flights: tuple[FreeFlight, ...]) -> str:
    """Describe the forms of the lost energy."""
    whole = [f for f in flights if f.is_whole]
    broken = [f for f in flights if f.separation > 0.0]
    parts = []
    if whole:
        slow = [f for f in whole if f.speed < 1.0] or whole[:1]
        modes = ", ".join(
            f"j = {_half_of_kinetic(f)} of {f.point.particles - 1} at {f.speed:.3g} v*"
            for f in (slow[0], *slow[1:][-1:])
        )
        parts.append(
            "In slow chains in vibration, from the longest waves to short ones: half of the "
            f"kinetic energy of internal motion, mean over {AVERAGED_OVER:g} crossings, is in the "
            f"modes up to {modes} ([the figure](#mode_spectra))"
        )
    if broken:
        most = max(broken, key=lambda f: f.separation)
        parts.append(
            f"in faster ones also in pieces that fly apart: {most.separation:.3f} of the energy at "
            f"impact at {most.speed:.3g} v*, of {most.point.dissipation:.3f} that are "
            f"lost ({LAST:g} crossings after the last contact)"
        )
    return "; ".join(parts) + "."


def _half_of_kinetic(flight: FreeFlight) -> int:
    """Return the mode up to which the modes j >= 1 have half of the internal kinetic energy."""
    total = np.cumsum(flight.kinetic[1:])
    return int(np.searchsorted(total, 0.5 * total[-1])) + 1


def _draw_map(ax: Axes, flights: tuple[FreeFlight, ...]) -> float:
    """Draw the energy shares of all modes at all speeds, and return the largest share."""
    from matplotlib.colors import LogNorm

    shares = np.array([f.kinetic[1:] for f in flights])
    top = float(np.max(shares))
    floor = top * 10.0**-_DECADES
    modes, speeds = np.arange(1, shares.shape[1] + 1), [f.speed for f in flights]
    mesh = draw_map(ax, modes, speeds, np.maximum(shares, floor), LogNorm(floor, top))
    ax.set(xscale="log", yscale="log", xlabel=r"mode $j$", ylabel=IMPACT_SPEED)
    # The colour bar is above the panel, so that all panels have the same width.
    label = "kinetic energy / energy at impact"
    ax.figure.colorbar(mesh, ax=ax, location="top", label=label, pad=0.02)
    return top


def _draw_curves(ax: Axes, flights: tuple[FreeFlight, ...], top: float) -> None:
    """Draw the energy shares of the modes at a few speeds."""
    nearest = [min(flights, key=lambda f: abs(np.log(f.speed / speed))) for speed in _SHOWN]
    shown = {flight.speed: flight for flight in nearest}.values()
    for flight, color, marker in zip(shown, CYCLE, MARKERS, strict=False):
        kind = "" if flight.is_whole else " (breaks)"
        ax.plot(
            np.arange(1, flight.kinetic.size),
            flight.kinetic[1:],
            color=color,
            linestyle="-" if flight.is_whole else "--",
            linewidth=0.9,
            marker=marker,
            markevery=0.12,
            label=rf"${flight.speed:.3g}\,v^*${kind}",
        )
    ax.set(xscale="log", yscale="log", ylim=(top * 10.0**-_DECADES, 3.0 * top))
    ax.set(xlabel=r"mode $j$", ylabel="kinetic energy / energy at impact")
    ax.legend(loc="lower left", ncols=2, fontsize=8)


def _draw_forms(ax: Axes, flights: tuple[FreeFlight, ...]) -> None:
    speeds = np.array([f.speed for f in flights])
    for values, color, label in (
        ([f.point.dissipation for f in flights], BLACK, r"lost, $1-\eta$"),
        ([f.vibration for f in flights], BLUE, "kinetic energy of internal motion"),
        ([f.bonds for f in flights], GREEN, "energy of the bonds"),
        ([f.separation for f in flights], VERMILION, "pieces flying apart"),
    ):
        ax.plot(speeds, values, color=color, linewidth=1.1, label=label)
    right = speeds < _harmonic_until(flights)
    dotted: dict[str, Any] = {"color": CYCLE[3], "linestyle": (0, (2, 3)), "linewidth": 1.8}
    harmonic = np.array([f.harmonic for f in flights])[right]
    ax.plot(speeds[right], harmonic, label="harmonic energies, all modes", **dotted)
    ax.set(xscale="log", xlabel=IMPACT_SPEED, ylabel="share of the energy at impact")
    ax.legend(loc="upper left", fontsize=8)
