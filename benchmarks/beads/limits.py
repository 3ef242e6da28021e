"""
Compute the loss of columns of beads up to 3000 beads, and extrapolate to infinite length.

    python -m benchmarks.beads.limits LOSSES [--figure PICTURE]

Losses come from the page of C++ without its error of second order. Each line of the text file
LOSSES stores an exponent, 1 for a hard wall or 0 for a wall of the same law, the number of beads,
the loss, and the change of the last halving of the step. A second call resumes the computation.

A loss approaches its limit as a polynomial in x: x = 1/n at a wall of the same law, 1/n^(1/2) at a
hard wall. The bar of the limit is the largest change of the fit when its shortest or its longest
columns are dropped, when the next power is added, or, at a hard wall, with 1/n^(2/3) or 1/n.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.beads.verlet import VerletColumn

EXPONENTS = (1.25, 1.5, 1.75, 2.0, 2.5, 3.0)
BEADS = (2, 3, 5, 10, 20, 50, 100, 200, 300, 500, 700, 1000, 1500, 3000)
STEPS, LONG = (0.04, 0.02, 0.01), 3000  # so many beads at a wall of the same law omit the last step
# In longer columns of this exponent, late contacts at the wall hinge on the step: at 3000 beads,
# the loss is 0.111 at the step 0.04 and 0.107 at 0.02.
MOST_BEADS = {1.25: 1000}
SHORTEST = 100  # number of beads from which columns are used in fits

Losses = dict[tuple[float, bool, int], float]


def read_losses(path: Path) -> Losses:
    """Return the stored losses by exponent, wall and number of beads."""
    rows = [line.split() for line in path.read_text().splitlines()] if path.exists() else []
    return {(float(p), hard == "1", int(n)): float(loss) for p, hard, n, loss, _ in rows}


def compute_losses(path: Path) -> Losses:
    """Compute the losses that the file lacks, and add them to the file."""
    known = read_losses(path)
    wanted = [
        (p, hard, n)
        for n in BEADS
        for p in EXPONENTS
        for hard in (False, True)
        if n <= MOST_BEADS.get(p, n)
    ]
    with tempfile.TemporaryDirectory() as folder:
        column = VerletColumn.compiled_in(Path(folder))
        for exponent, hard, beads in (each for each in wanted if each not in known):
            steps = STEPS if hard or beads < LONG else STEPS[:2]
            loss, change = column.extrapolated(exponent, hard, beads, steps)
            with path.open("a") as file:
                file.write(f"{exponent} {int(hard)} {beads} {loss:.9f} {change:.1e}\n")
    return read_losses(path)


def limit_of(beads: list[int], losses: list[float], power: float, terms: int = 3) -> float:
    """Return the limit of a fit by powers of 1/n^power."""
    variable = np.array(beads, dtype=float) ** -power
    powers = np.vander(variable, terms, increasing=True)
    return float(np.linalg.lstsq(powers, np.array(losses), rcond=None)[0][0])


def limit_and_bar(known: Losses, exponent: float, hard: bool) -> tuple[float, float]:
    """Return the limit and its error bar."""
    beads = [n for n in BEADS if n >= SHORTEST and (exponent, hard, n) in known]
    losses = [known[exponent, hard, n] for n in beads]
    power = 0.5 if hard else 1.0
    limit = limit_of(beads, losses, power)
    others = [limit_of(beads[k:m], losses[k:m], power) for k, m in ((2, None), (None, -2), (1, -1))]
    others.append(limit_of(beads, losses, power, terms=4))
    if hard:
        others += [limit_of(beads, losses, another) for another in (2.0 / 3.0, 1.0)]
    return limit, max(abs(limit - other) for other in others)


def draw(known: Losses, path: Path) -> None:
    """Draw the losses against the number of beads."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for number, exponent in enumerate(EXPONENTS):
        for hard, line in ((False, "-"), (True, "--")):
            points = sorted((n, x) for (p, h, n), x in known.items() if (p, h) == (exponent, hard))
            n, loss = np.array(points).T
            label = None if hard else f"p = {exponent:g}"
            axes.plot(n, loss, line, color=f"C{number}", marker=".", label=label)
    axes.set(xscale="log", xlabel="number of beads n", ylabel="loss $1 - \\eta$")
    axes.set_title("solid: wall of the same law, dashed: hard wall", fontsize="medium")
    axes.legend(ncols=2, fontsize="small")
    figure.savefig(path, dpi=110)


def main() -> None:
    """Print limits and largest losses."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("losses", type=Path)
    parser.add_argument("--figure", type=Path)
    asked = parser.parse_args()
    known = compute_losses(asked.losses)
    print("exponent  wall  limit     bar      largest loss, at n")
    for exponent in EXPONENTS:
        for hard in (False, True):
            limit, bar = limit_and_bar(known, exponent, hard)
            column = {n: x for (p, h, n), x in known.items() if (p, h) == (exponent, hard)}
            top = max(column, key=column.__getitem__)
            wall = "hard" if hard else "same"
            print(f"{exponent:<8g}  {wall}  {limit:.6f}  {bar:.0e}  {column[top]:.6f}, {top}")
    if asked.figure is not None:
        draw(known, asked.figure)


if __name__ == "__main__":
    main()
