"""
Draw a histogram of true errors in units of their error bars.

    python -m tests.judge.histogram FILE [FILE ...] [-o docs/images/honest_bars.png]

The files are those that ``tests.judge.lines`` writes; its judge shares no code with the engines.
Scenes are left out, and counted, if they are refused or open, or if the judge's error exceeds the
error bar. An error below that of the judge is replaced by the judge's error. For each engine, the
program prints the number of errors within their bars, the median ratio of bar to error, and the
largest ratio of error to bar.
"""

import argparse
import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from chaincor.analysis.figures.style import BLUE, VERMILION, new_figure

_COLOURS = {"lammps": BLUE, "reference": VERMILION}
_NAMES = {"lammps": "LAMMPS", "reference": "reference engine"}
# The bins are decades of error over error bar. Smaller ratios are drawn in the first bin.
_LEAST, _MOST, _BINS = -6.0, 1.0, 28


def read_rows(files: list[Path]) -> list[dict[str, Any]]:
    """Return the results in all files, one dictionary for each scene."""
    return [json.loads(line) for file in files for line in file.read_text().splitlines()]


def errors_over_bars(rows: list[dict[str, Any]]) -> np.ndarray:
    """Return the ratio of each error, or of the judge's error if larger, to the error bar."""
    return np.array([max(row["bars"], row["judge_error"] / row["bar"]) for row in rows])


def main() -> None:
    """Print the ratios of both engines and draw the histogram."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/images/honest_bars.png"))
    given = parser.parse_args()
    rows = read_rows(given.files)
    for row in rows:
        if row["verdict"] == "inside" and row["judge_error"] > row["bar"]:
            row["verdict"] = "judge unsure"
    judged = [row for row in rows if row["verdict"] in ("inside", "outside")]
    left_out = Counter(row["verdict"] for row in rows) - Counter(r["verdict"] for r in judged)
    figure, axes = new_figure(figsize=(6.5, 3.9))
    edges = np.linspace(_LEAST, _MOST, _BINS + 1)
    for engine, colour in _COLOURS.items():
        own = [row for row in judged if row["engine"] == engine]
        if not own:
            continue
        shares = errors_over_bars(own)
        inside, median = sum(row["verdict"] == "inside" for row in own), 1.0 / np.median(shares)
        label = f"{_NAMES[engine]}: {inside} of {len(own)} inside, median bar {median:.0f} errors"
        print(f"{label}, largest error {max(row['bars'] for row in own):.2g} bars")
        decades = np.clip(np.log10(shares), _LEAST, _MOST)
        axes.hist(decades, edges, histtype="step", color=colour, lw=1.8, label=label)
    axes.axvline(0.0, color="black", lw=1.0, ls="--")
    axes.set_xlabel(r"$\log_{10}$ (true error of $\eta$ / its bar)")
    axes.set_ylabel("scenes")
    most = axes.get_ylim()[1]
    axes.set_ylim(0.0, 1.35 * most)
    axes.legend(loc="upper left")
    rest = ", ".join(f"{count} {verdict}" for verdict, count in sorted(left_out.items()))
    axes.set_title(f"{len(judged)} random scenes; left out: {rest or 'none'}", fontsize=9)
    given.output.parent.mkdir(parents=True, exist_ok=True)
    names = ", ".join(file.name for file in given.files)
    figure.savefig(given.output, metadata={"Description": f"{__doc__}\n{names}"})
    print(given.output)


if __name__ == "__main__":
    main()
