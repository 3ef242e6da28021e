"""
Measure the constants of error bars and of choices, and write the file that contains them.

    python -m benchmarks.bars.calibrate [NAME ...] [--scenes 300] [--seed 1]
        [--output FILE]

In each random scene, the study finds the constant that this scene would have needed. The constant
is a quantile of these samples, times a reserve, rounded up to two digits. Without names, all
constants are measured, which takes about an hour. With names, the other constants are not changed.
Constants without a study, and lower limits of constants, are choices. The reasons for them are in
the code that uses them.
"""

import argparse
import math
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from benchmarks.bars import samples as bar_studies
from benchmarks.bars import scheme_costs, step_samples
from benchmarks.bars.samples import Random, Samples
from chaincor.workflows import measured
from chaincor.workflows.versions import versions

FILE = Path(measured.__file__).with_name(measured.FILE)


@dataclass(frozen=True)
class Constant:
    """Rule that turns samples into a constant."""

    #: ``study(random, count)`` returns samples by key. The key is "" if there is only one constant.
    study: Callable[[Random, int], Samples]
    quantile: float  #: Quantile of the samples; 1 is the largest, 0 the smallest.
    reserve: float  #: Factor on the quantile, for scenes that were not drawn.
    #: Number of scenes, as a fraction of `--scenes`. Some studies are expensive, and some constants
    #: need few scenes.
    scenes: float = 1.0

    def value(self, samples: list[float]) -> tuple[float, float]:
        """Return the quantile of the samples, and the constant."""
        found = float(np.quantile(samples, self.quantile))
        digits = 10.0 ** (math.floor(math.log10(max(self.reserve * found, 1e-30))) - 1)
        rounded = math.ceil if self.quantile > 0.0 else math.floor
        return found, float(f"{rounded(self.reserve * found / digits) * digits:.2g}")


CONSTANTS = {
    "proof_share": Constant(bar_studies.proof_share, 0.995, 1.2),
    "adaptive_share": Constant(bar_studies.adaptive_share, 0.99, 2.0, 0.2),
    "table_sensitivity": Constant(bar_studies.table_sensitivity, 1.0, 1.5, 0.2),
    "coordinate_rounding": Constant(bar_studies.coordinate_rounding, 1.0, 1.2, 0.3),
    "short_drift_rounding": Constant(bar_studies.short_drift_rounding, 1.0, 1.2, 0.2),
    "extrapolated_rounding": Constant(bar_studies.extrapolated_rounding, 1.0, 1.2, 0.3),
    "nudge_reserve": Constant(bar_studies.nudge_reserve, 0.98, 1.2, 0.2),
    "arithmetic_floor": Constant(bar_studies.arithmetic_floor, 1.0, 1.2, 0.3),
    "array_sensitivity": Constant(bar_studies.array_sensitivity, 0.99, 2.0, 0.2),
    "unseen_stretch": Constant(bar_studies.unseen_stretch, 1.0, 1.2, 0.2),
    "sphere_power": Constant(bar_studies.sphere_power, 0.0, 1.0, 0.1),
    "usual_error": Constant(step_samples.usual_error, 0.5, 1.0, 0.3),
    "promise_reserve": Constant(step_samples.promise_reserve, 0.95, 1.0, 0.2),
}
_WHAT_SCHEMES = (
    "Goals down to which a scheme is usually the cheapest; the loss is the time over that of the "
    "cheapest in each scene."
)
SCHEMES = {
    "lammps_schemes": (scheme_costs.lammps_costs, scheme_costs.LAMMPS_SCHEMES, 0.05),
    "reference_schemes": (scheme_costs.reference_costs, scheme_costs.IN_HOUSE_SCHEMES, 0.1),
}


def draw(name: str, seed: int) -> Random:
    """Return a generator that depends only on the seed and the name of the constant."""
    return np.random.default_rng([seed, zlib.crc32(name.encode())])


def measure(name: str, scenes: int, seed: int) -> dict[str, Any]:
    """Return a constant, and how it was measured."""
    random = draw(name, seed)
    common = {"seed": seed, "chaincor": versions()["chaincor"], "lammps": versions()["lammps"]}
    if name in SCHEMES:
        costs, schemes, share = SCHEMES[name]
        count = max(1, round(share * scenes))
        losses = scheme_costs.measure_losses(costs, schemes, random, count)
        table, loss = scheme_costs.best_table(losses)
        return {
            "what": _WHAT_SCHEMES,
            "value": table,
            "loss": float(f"{loss:.3g}"),
            "scenes": count * len(losses),
            **common,
        }
    constant = CONSTANTS[name]
    count = max(1, round(constant.scenes * scenes))
    found = {key: constant.value(each) for key, each in constant.study(random, count).items()}
    scalar = set(found) == {""}
    return {
        "what": " ".join((constant.study.__doc__ or "").split()),
        "value": found[""][1] if scalar else {key: value for key, (_, value) in found.items()},
        "found": _short(found[""][0]) if scalar else {k: _short(q) for k, (q, _) in found.items()},
        "quantile": constant.quantile,
        "reserve": constant.reserve,
        "scenes": count,
        **common,
    }


def _short(number: float) -> float:
    return float(f"{number:.3g}")


def main() -> None:
    """Measure constants and write the file."""
    names = [*CONSTANTS, *SCHEMES]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}")
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--output", type=Path, default=FILE, help="by default the file read")
    arguments = parser.parse_args()
    if unknown := set(arguments.names) - set(names):
        parser.error(f"no such constant: {', '.join(sorted(unknown))}; expected some of {names}")
    table = {name: dict(entry) for name, entry in measured.measurements().items()}
    for name in arguments.names or names:
        table[name] = measure(name, arguments.scenes, arguments.seed)
        print(name, table[name], flush=True)
        # The file is written after each constant. An interrupted study keeps its results.
        ordered = {each: table[each] for each in names if each in table}
        head = "# Written by python -m benchmarks.bars.calibrate; do not edit.\n\n"
        arguments.output.write_text(head + tomli_w.dumps({"constants": ordered}))


if __name__ == "__main__":
    main()
