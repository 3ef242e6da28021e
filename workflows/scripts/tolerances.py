"""Default tolerances of numbers, with their reasons."""

import math
from typing import NamedTuple

import numpy as np

from chaincor.analysis.ladders.verdict import LadderVerdict
from chaincor.workflows.scripts.quantities import Quantity
from chaincor.workflows.scripts.samples import Samples

# Tolerances over a standard deviation, kT per degree of freedom, and a printed number.
_OF_SPREAD, _OF_KT, _OF_NUMBER = 0.1, 1e-4, 1e-3
# Smallest tolerance, in bounds of the finest rung, that an advice can keep.
_OF_FINEST = 3.0
# Relative spread of samples below which they count as constant.
_ROUNDING = 1e-12


class Tolerance(NamedTuple):
    """Absolute tolerance and its reason."""

    value: float
    reason: str


def default_tolerance(
    quantity: Quantity | None, runs: list[Samples], verdict: LadderVerdict
) -> Tolerance | None:
    """
    Return the default tolerance of a number; None if the ladder gives no answer.

    The default is a tenth of the quantity's standard deviation in a run. For the drift of an energy
    it is 1e-4 kT per degree of freedom, if that is more. For the fluctuation of an energy it is a
    tenth of the standard deviation of the kinetic energy, and for a printed or constant number a
    thousandth of the number. If one run on the finest rung has a larger error, the tolerance is
    three times that error. `runs` are the samples on the finest rung.
    """
    keeps = float(verdict.promised[-1])
    if verdict.value is None or not math.isfinite(keeps):
        return None
    wanted = _wanted(quantity, runs, verdict.value)
    least = _OF_FINEST * keeps
    if wanted.value >= least:
        return wanted
    longer = "" if wanted.value <= 0.0 else f"; {wanted.reason}, {wanted.value:.2g}, is beyond them"
    return Tolerance(least, f"the least that these runs can show{longer}")


def thermal_tolerance(samples: Samples) -> float:
    """Return 1e-4 kT per degree of freedom, in the unit of the sampled energies."""
    # The kinetic energy is kT/2 per degree of freedom.
    return 2.0 * _OF_KT * float(np.mean(samples.values["ke"])) if "ke" in samples.values else 0.0


def _wanted(quantity: Quantity | None, runs: list[Samples], value: float) -> Tolerance:
    number = Tolerance(_OF_NUMBER * abs(value), "a thousandth of the number")
    if quantity is None or not runs:
        return number
    what = "ke" if quantity.is_energy_change and quantity.kind == "fluctuation" else ""
    spread = float(np.median([each.spread(quantity, what) for each in runs]))
    size = max(float(np.max(np.abs(each.values[what or quantity.what]))) for each in runs)
    of = "the standard deviation of the kinetic energy" if what else "its standard deviation"
    found = Tolerance(_OF_SPREAD * spread, f"a tenth of {of}")
    if spread <= _ROUNDING * size:
        found = number
    if quantity.is_energy_change and quantity.kind == "drift":
        kinetic = float(np.median([thermal_tolerance(each) for each in runs]))
        thermal = Tolerance(kinetic, "1e-4 kT per degree of freedom")
        found = max(found, thermal, key=lambda each: each.value)
    return found
