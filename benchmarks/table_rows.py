"""
Test error bars of bond tables with few rows, few digits or noise, made from known bonds.

Each random table is run as `potential = "table"`, and the exact function as a named bond. An error
bar is right if the two restitutions differ by no more than the error bar.

Run: python -m benchmarks.table_rows [--draws 200] [--seed 1] [--csv FILE]
"""

import argparse
import csv
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from chaincor import Scene, collide
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import ChaincorError

# Named bonds, with the range of lengths that is tabulated.
BONDS = {"lj": (0.78, 1.6), "toda": (0.6, 1.8), "log": (0.3, 2.5), "morse": (0.68, 1.7)}
KINDS = ("coarse", "digits", "noise")


@dataclass(frozen=True)
class Draw:
    """A table and its collision; `noise` is the standard deviation of the force."""

    bond: str
    kind: str
    particles: int
    speed: float
    rows: int
    digits: int
    noise: float
    longest: float


@dataclass(frozen=True)
class Judged:
    """True error and error bar of a table; None if the table was refused."""

    error: float | None
    bar: float | None
    refused: str = ""

    @property
    def holds(self) -> bool:
        """Whether the error bar is at least as large as the error."""
        return self.error is None or self.bar is None or self.error <= self.bar


def draw(rng: np.random.Generator) -> Draw:
    """Return the parameters of a random table."""
    kind = str(rng.choice(KINDS))
    bond = str(rng.choice(list(BONDS)))
    coarse = round(10.0 ** rng.uniform(1.0, 2.3))
    return Draw(
        bond=bond,
        kind=kind,
        particles=int(rng.integers(3, 31)),
        speed=float(rng.uniform(0.1, 0.7)),
        rows=coarse if kind == "coarse" else int(rng.integers(60, 300)),
        digits=int(rng.integers(3, 7)) if kind == "digits" else 15,
        noise=10.0 ** rng.uniform(-6.0, -3.0) if kind == "noise" else 0.0,
        longest=BONDS[bond][1] - float(rng.uniform(0.0, 0.2)),
    )


def write_table(path: Path, given: Draw, bond: Potential, rng: np.random.Generator) -> None:
    """Write the rows of a table, with energies of 0."""
    lengths = np.linspace(BONDS[given.bond][0], given.longest, given.rows)
    forces = bond.force(lengths - 1.0) + given.noise * rng.standard_normal(given.rows)
    rows = [
        f"{i} {length:.15g} 0.0 {force:.{given.digits}g}"
        for i, (length, force) in enumerate(zip(lengths, forces, strict=True), 1)
    ]
    path.write_text("\n".join(["BOND", f"N {given.rows}", "", *rows, ""]))


def judge(given: Draw, rng: np.random.Generator) -> Judged:
    """Run a table and the bond that it was made from; return error and error bar."""
    scale = Scene(potential=given.bond, particles=given.particles, speed=1.0).impact_velocity
    known = Scene(
        potential=given.bond,
        particles=given.particles,
        velocity=given.speed * scale,
        engine="reference",
    )
    exact = collide(known, tolerance=1e-9)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rows.table"
        write_table(path, given, known.bond, rng)
        try:
            found = collide(known.replace(potential="table", bond_file=path), tolerance=1e-6)
        except ChaincorError as error:
            return Judged(None, None, f"{type(error).__name__}: {error}".replace(str(path), "FILE"))
    assert found.restitution_error is not None
    assert exact.restitution_error is not None
    off = abs(found.restitution - exact.restitution)
    return Judged(off, found.restitution_error + exact.restitution_error)


def main(arguments: Sequence[str] | None = None) -> None:
    """Judge tables; print how many error bars are right and how wide they are."""
    parser = argparse.ArgumentParser(description="Judge the bars of coarse and noisy tables.")
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--csv", type=Path)
    options = parser.parse_args(arguments)
    rng = np.random.default_rng(options.seed)
    results = []
    for number in range(options.draws):
        given = draw(rng)
        judged = judge(given, rng)
        results.append((given, judged))
        state = "refused" if judged.error is None else "holds" if judged.holds else "FAILS"
        print(f"{number:4d} {state} {given} {judged}", flush=True)
    if options.csv:
        with options.csv.open("w", newline="") as file:
            rows = [asdict(given) | asdict(judged) for given, judged in results]
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
    for kind in KINDS:
        mine = [judged for given, judged in results if given.kind == kind]
        shown = [j for j in mine if j.error is not None and j.bar is not None]
        # Errors are at least the tolerance of the exact run, because smaller errors say nothing
        # about the width of an error bar.
        wide = [j.bar / max(j.error, 1e-9) for j in shown if j.error and j.bar]
        print(
            f"{kind}: {len(mine)} tables, {len(mine) - len(shown)} refused, "
            f"{sum(j.holds for j in shown)} of {len(shown)} bars hold, "
            f"median bar over error {np.median(wide):.1f}"
        )


if __name__ == "__main__":
    main()
