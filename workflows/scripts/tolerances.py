"""The accuracy that a number needs where the user gives no tolerance, and why."""

import math
from typing import NamedTuple

import numpy as np

from chaincor.analysis.ladders.verdict import LadderVerdict
from chaincor.workflows.scripts.quantities import Quantity
from chaincor.workflows.scripts.samples import Samples

# Parts of a standard deviation, of kT per degree of freedom, and of a number.
_OF_SPREAD, _OF_KT, _OF_NUMBER = 0.1, 1e-4, 1e-3
# A tolerance below this many bounds of the finest rung has no advice.
_OF_FINEST = 3.0
# Samples that differ by less than roundings do have no spread.
_ROUNDING = 1e-12


class Tolerance(NamedTuple):
    """An absolute error to keep, and its reason."""

    value: float
    reason: str


def default_tolerance(
    quantity: Quantity | None, runs: list[Samples], verdict: LadderVerdict
) -> Tolerance | None:
    """
    Return the error to keep in a number; None where the ladder says nothing of it.

    It is a tenth of the quantity's standard deviation in a run; for the drift of an energy 1e-4 kT
    per degree of freedom, where that is more; for the fluctuation of an energy a tenth of the
    standard deviation of the kinetic energy; for a number that is printed or constant a thousandth
    of it. Where one run on the finest rung keeps no such error, it is three times what that run
    keeps.
    `runs` are the samples on the finest rung.
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
