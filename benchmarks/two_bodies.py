"""Plot the restitution against mass ratio, length of a second rod, and position of a defect.

Writes three figures, and a table of their points with all digits and error bars. Points that are in
the store are not computed again.

Run: python -m benchmarks.two_bodies [--engine lammps|reference] [--tolerance 1e-9] [--draw]
"""

import argparse
import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from chaincor.analysis.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    MARKERS,
    ORANGE,
    VERMILION,
    new_figure,
)
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.into_store import collide_into_store
from chaincor.workflows.store.row import Row

# Number of mass ratios, by number of particles. The curve for two particles has corners, and its
# minimum is at 1.43447.
_RATIOS = {2: 401, 10: 161, 50: 81}
_LEAST_OF_TWO = 1.43447  # 1 + 2 max(-sin z/z)
_ROD = 24
_LENGTHS = (*range(6, 24, 2), *range(24, 49, 3), 64, 96)
_DEFECT_CHAIN = 50
_DEFECTS = (10.0, 3.0, 1.0 / 3.0)
_COLOURS = (BLUE, VERMILION, GREEN, ORANGE)


@dataclass(frozen=True)
class Point:
    """Point of a figure: name of the curve, x value, and scene."""

    figure: str
    curve: str
    x: float
    scene: Scene


def diatomic_points(common: dict[str, Any]) -> Iterator[Point]:
    """Yield chains with alternating masses; x is the mass of particle 1 divided by particle 2's."""
    for particles, count in _RATIOS.items():
        ratios = [*np.geomspace(0.1, 10.0, count).round(6).tolist(), _LEAST_OF_TWO]
        for ratio in sorted(ratios):
            scene = Scene(
                potential="harmonic",
                velocity=0.1,
                particles=particles,
                masses=[ratio, 1.0],
                **common,
            )
            yield Point("mass_ratio", f"{particles} particles", ratio, scene)


def rod_points(common: dict[str, Any]) -> Iterator[Point]:
    """Yield harmonic rods that hit free rods; x is the target's length divided by the other's."""
    for factor in (1, 4, 16):
        for length in _LENGTHS:
            scene = Scene(
                potential="harmonic",
                velocity=0.1,
                particles=_ROD * factor,
                target_particles=length * factor,
                **common,
            )
            yield Point("two_rods", f"n = {_ROD * factor}", length / _ROD, scene)


def defect_points(common: dict[str, Any]) -> Iterator[Point]:
    """Yield harmonic chains with one particle of another mass; x is its number from the wall."""
    for mass in _DEFECTS:
        for place in range(1, _DEFECT_CHAIN + 1):
            masses = [1.0] * _DEFECT_CHAIN
            masses[place - 1] = mass
            scene = Scene(
                potential="harmonic",
                velocity=0.1,
                particles=_DEFECT_CHAIN,
                masses=masses,
                **common,
            )
            yield Point("one_defect", f"mass {mass:.3g}", float(place), scene)


def kinematic_bar(row: Row) -> tuple[float, float]:
    """Return e = sqrt(eta), and the error bar of e from that of eta."""
    eta, bar = row.restitution, row.restitution_error
    assert bar is not None
    e = eta**0.5
    return e, max((eta + bar) ** 0.5 - e, e - max(eta - bar, 0.0) ** 0.5)


def draw(table: Path, name: str, label: str, path: Path, *, logarithmic: bool) -> None:
    """Plot e against x from the table; error bars are below 1e-11 and invisible."""
    with table.open(newline="", encoding="ascii") as file:
        rows = [row for row in csv.DictReader(file) if row["figure"] == name]
    figure, ax = new_figure()
    # Positions of a defect are whole numbers, and no line connects them.
    line = "none" if name == "one_defect" else "-"
    size = 4.0 if name == "one_defect" else 2.0
    curves = list(dict.fromkeys(row["curve"] for row in rows))
    for curve, colour, marker in zip(curves, _COLOURS, MARKERS, strict=False):
        x, e = np.array(
            [(float(row["x"]), float(row["e"])) for row in rows if row["curve"] == curve]
        ).T
        ax.plot(x, e, color=colour, marker=marker, ms=size, lw=0.8, ls=line, label=curve)
    low, high = min(float(row["x"]) for row in rows), max(float(row["x"]) for row in rows)
    if name == "two_rods":
        x = np.linspace(min(_LENGTHS), max(_LENGTHS), 400) / _ROD
        ax.plot(x, np.minimum(x, 1.0 / x), color=BLACK, lw=1.0, ls="--", label="Saint-Venant")
    if logarithmic:
        ax.set_xscale("log")
        ticks = [tick for tick in (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0) if low <= tick <= high]
        ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
        ax.minorticks_off()
    ax.set_xlabel(label)
    ax.set_ylabel(r"kinematic restitution $e$")
    ax.legend(frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
    print(path)


def write_table(points: list[Point], rows: list[Row], path: Path) -> None:
    """Write every point with its error bar."""
    with path.open("w", newline="", encoding="ascii") as file:
        writer = csv.writer(file)
        writer.writerow(
            ["figure", "curve", "x", "restitution", "restitution_error", "e", "e_error"]
        )
        for point, row in zip(points, rows, strict=True):
            bar = row.restitution_error
            assert bar is not None
            e, e_bar = kinematic_bar(row)
            # Digits that depend on the processor are below the error bar and are not written.
            numbers = (f"{row.restitution:.12f}", f"{bar:.1e}", f"{e:.12f}", f"{e_bar:.1e}")
            writer.writerow([point.figure, point.curve, f"{point.x:.9g}", *numbers])
    print(path)


FIGURES = {
    "mass_ratio": ("mass of particles 1, 3, ... over that of 2, 4, ...", True),
    "two_rods": ("length of the target over that of the other rod", True),
    "one_defect": ("place of the defect, counted from the wall", False),
}


def main() -> None:
    """Compute the points that the store lacks, unless `--draw` is given, and plot."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--engine", default="lammps", choices=("lammps", "reference"))
    parser.add_argument("--tolerance", type=float, default=1e-9)
    parser.add_argument("--store", type=Path, default=Path("two_bodies.sqlite"))
    parser.add_argument("--workers", type=int)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/images"))
    parser.add_argument("--draw", action="store_true", help="draw the table that is there")
    given = parser.parse_args()
    table = given.output / "two_bodies.csv"
    if not given.draw:
        compute(given, table)
    for name, (label, logarithmic) in FIGURES.items():
        draw(table, name, label, given.output / f"{name}.png", logarithmic=logarithmic)


def compute(given: argparse.Namespace, table: Path) -> None:
    """Compute the points that the store lacks, and write the table."""
    common = {"engine": given.engine, "tolerance": given.tolerance}
    points = [*diatomic_points(common), *rod_points(common), *defect_points(common)]
    rows = collide_into_store([point.scene for point in points], given.store, workers=given.workers)
    failed = [
        (p.scene, row.failure) for p, row in zip(points, rows, strict=True) if row.result is None
    ]
    for scene, failure in failed:
        print(f"{scene!r}: {failure}")
    missed = [row for row in rows if row.result is not None and not row.result["tolerance_met"]]
    print(f"{len(points)} points, {len(failed)} failed, {len(missed)} missed the tolerance")
    if failed:
        raise SystemExit(1)
    table.parent.mkdir(parents=True, exist_ok=True)
    write_table(points, rows, table)


if __name__ == "__main__":
    main()
