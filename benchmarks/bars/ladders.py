"""Count right verdicts on ladders with random errors of known kinds."""

import argparse

import numpy as np

from chaincor.analysis.ladders.verdict import judge_ladder
from tests.analysis.ladders.draws import ORDERS, draw

KINDS = ("regular", "irregular", "noise", "bounded", "cannot tell")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=300)
    parser.add_argument("--rungs", type=int, default=8)
    parser.add_argument("--columns", type=int, default=8)
    options = parser.parse_args()
    heads = ("order in its bar", "value in its bar", "fresh run in its bound")
    print("| error | " + " | ".join((*KINDS, *heads)) + " |")
    print("|---" * (len(KINDS) + 4) + "|")
    for kind, order in ORDERS.items():
        random = np.random.default_rng(22)
        counts = dict.fromkeys(KINDS, 0)
        orders, values, kept = [], [], []
        for _ in range(options.draws):
            # The last run of each rung is not used for the verdict.
            h, found, reference_value = draw(kind, options.rungs, options.columns + 1, random)
            verdict = judge_ladder(h[:, :-1], found[:, :-1])
            counts[verdict.kind] += 1
            if verdict.order is not None and order is not None:
                orders.append(abs(verdict.order - order) <= verdict.order_error)
            if verdict.value is not None:
                values.append(abs(verdict.value - reference_value) <= verdict.value_error)
                kept += list(np.abs(found[:, -1] - reference_value) <= verdict.promised)
        shares = [100.0 * count / options.draws for count in counts.values()]
        bars = [f"{100.0 * np.mean(hits):.0f}" if hits else "-" for hits in (orders, values, kept)]
        cells = " | ".join([*(f"{share:.0f}" for share in shares), *bars])
        print(f"| {kind} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
