"""
Draw the energy loss of slow long chains: curves, computed chains and limits.

    python -m benchmarks.slow_chains.picture [-o docs/images]

Writes ``slow_chains.png``, with chains on the curve and harmonic chains that approach their limit,
and ``slow_chains_curve.png``, with the oscillation of C'(y) and bonds that soften.
"""

import argparse
from pathlib import Path

import numpy as np

from benchmarks.slow_chains import ending, harmonic_limit, lattices
from benchmarks.slow_chains.limit import STEEPEST, step_slopes
from chaincor.analysis.figures.style import BLACK, CYCLE, GREY, MARKERS, new_figure
from chaincor.analysis.slow_chains.curve import FRONT_LEAD, limiting_loss
from chaincor.analysis.theory import HARMONIC_DISSIPATION_COEFFICIENT, harmonic_dissipation_limit


def draw_curve(ax) -> None:
    """Draw both curves, and means over lengths minus the term of the front's lead."""
    rows = lattices.means()
    for order, line, last in ((3, "-", 30.0), (4, "--", 12.0)):
        y = np.geomspace(0.2, last, 200)
        ax.plot(y, limiting_loss(y, order), line, color=BLACK, lw=1.0, label=f"$h_{order}(y)$")
    colours = dict(zip(lattices.BONDS, CYCLE, strict=False))
    sizes = [size for size, _ in lattices.SIZES if size >= 100]
    for bond, colour in colours.items():
        for size, marker in zip(sizes, MARKERS, strict=False):
            mine = [row for row in rows if row.bond == bond and row.size == size]
            ax.plot(
                [row.variable for row in mine],
                [row.factor - (row.with_lead - row.limit) for row in mine],
                marker,
                color=colour,
                mfc="none",
                ms=4.0,
                label=f"{bond}" if size == 1000 else None,
            )
    for size, marker in zip(sizes, MARKERS, strict=False):
        ax.plot([], [], marker, color=GREY, mfc="none", ms=4.0, label=f"$n = {size}$")
    ax.set(xscale="log", yscale="log", xlabel="$y$")
    ax.set_ylabel(r"$n^{2/3}(1-\eta) - 2\beta\,n^{-1/3}$")
    ax.legend(frameon=False, fontsize=8, ncols=2)


def draw_harmonic(ax) -> None:
    """Draw n^(2/3) (1 - eta) of harmonic chains against n^(-1/3)."""
    particles, loss = np.loadtxt(
        harmonic_limit.TABLE, delimiter=",", skiprows=1, usecols=(0, 1), unpack=True
    )
    x = particles ** (-1.0 / 3.0)
    ax.plot(x, particles ** (2.0 / 3.0) * loss, ".", color=CYCLE[0], ms=3.0, label="exact")
    line = np.array([0.0, 0.11])
    limit = harmonic_dissipation_limit()
    theory = limit + 2.0 * FRONT_LEAD * line
    ax.plot(line, theory, color=BLACK, lw=1.0, label=r"$0.5626 + 2\beta\,n^{-1/3}$")
    sizes = harmonic_limit.means()[0]
    sizes = sizes[sizes > 900.0]
    parts, errors = np.array([ending.part_of_excess(n) for n in sizes]).T
    places = sizes ** (-1.0 / 3.0)
    with_excess = limit + 2.0 * FRONT_LEAD * places + parts
    label = r"$0.5626 + 2(\beta-E)\,n^{-1/3}$"
    ax.errorbar(
        places, with_excess, errors, fmt="s", color=CYCLE[1], mfc="none", ms=5.0, label=label
    )
    paper = HARMONIC_DISSIPATION_COEFFICIENT
    ax.plot(line, [paper, paper], ":", color=GREY, label="the paper: 0.652")
    ax.set(xlim=(0.0, 0.11), ylim=(0.54, 0.85), xlabel="$n^{-1/3}$")
    ax.set_ylabel(r"$n^{2/3}(1-\eta)$, harmonic")
    ax.legend(frameon=False, fontsize=8)


def draw_swing(ax) -> None:
    """Draw C'(y), with kinks where another wave is the deepest, and single steep fronts."""
    y = np.geomspace(10.0, 80.0, 1400)
    ax.plot(y, limiting_loss(y) / y, color=CYCLE[0], lw=1.2, label="$C'(y)=h_3(y)/y$")
    fronts = {variable: slopes[0] for variable, slopes in step_slopes().items() if variable > 80.0}
    fronts |= dict([STEEPEST])
    ax.plot(
        list(fronts), list(fronts.values()), "o", color=CYCLE[0], mfc="none", label="single fronts"
    )
    ax.set(xscale="log", xlabel="$y$", ylabel="$C'(y)$", ylim=(0.360, 0.380))
    ax.set_xticks([10, 20, 50, 100, 200, 320], labels=["10", "20", "50", "100", "200", "320"])
    ax.minorticks_off()
    ax.legend(frameon=False, fontsize=8, loc="lower right")


def draw_softening(ax) -> None:
    """Draw the curves of both orders near y = 0; softening bonds have y < 0."""
    y = np.linspace(-20.0, 6.0, 400)
    for order, line in ((3, "-"), (4, "--")):
        ax.plot(y, limiting_loss(y, order), line, color=BLACK, lw=1.0, label=f"$h_{order}(y)$")
    steep = np.linspace(-20.0, -3.0, 100)
    ax.plot(steep, 0.68 / np.sqrt(-steep), ":", color=CYCLE[1], label="$0.68\\,|y|^{-1/2}$")
    ax.plot(0.0, harmonic_dissipation_limit(), "o", color=CYCLE[0], ms=4.0, label="harmonic")
    ax.set(xlabel="$y$", ylabel="$h_r(y)$", ylim=(0.0, 2.5))
    ax.legend(frameon=False, fontsize=8)


def main() -> None:
    """Draw both figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/images"))
    output = parser.parse_args().output
    pictures = {
        "slow_chains.png": (draw_curve, draw_harmonic),
        "slow_chains_curve.png": (draw_swing, draw_softening),
    }
    for name, panels in pictures.items():
        figure, axes = new_figure(1, 2, figsize=(9.6, 4.2))
        for draw, ax in zip(panels, axes, strict=True):
            draw(ax)
        figure.savefig(output / name, dpi=130)
        print(output / name)


if __name__ == "__main__":
    main()
