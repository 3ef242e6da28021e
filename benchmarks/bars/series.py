"""Count random correlated series whose means are within their error bars."""

import argparse

import numpy as np

from chaincor.analysis.ladders.series import standard_error
from tests.analysis.ladders.draws import autoregressive


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=1000)
    draws = parser.parse_args().draws
    print(
        "| samples | correlation time | not given | within 1 bar | 2 bars | 3 bars | bar / true |"
    )
    print("|---" * 7 + "|")
    for count in (100, 200, 1000):
        for time in (0, 1, 3, 10, 30, 100):
            random = np.random.default_rng(11)
            series = [autoregressive(count, time, random) for _ in range(draws)]
            bars = np.array([standard_error(each).error for each in series])
            means = np.abs([each.mean() for each in series])
            printed = np.isfinite(bars)
            cells = [f"{100 * np.mean(means[printed] <= k * bars[printed]):.0f}" for k in (1, 2, 3)]
            ratio = np.median(bars[printed]) / np.sqrt(np.mean(means**2))
            share = f"{100 * np.mean(~printed):.0f}"
            print(f"| {count} | {time} | {share} | {' | '.join(cells)} | {ratio:.2f} |", flush=True)


if __name__ == "__main__":
    main()
