"""Choose default tolerances for quantities, and give a reason for each."""

import math
from typing import NamedTuple

import numpy as np

from chaincor.analysis.ladders.verdict import LadderVerdict
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.scripts.quantities import Quantity
from chaincor.workflows.scripts.samples import Samples

# Default tolerances are the fraction _OF_SPREAD of a standard deviation, _OF_KT of kT per degree of
# freedom, or _OF_NUMBER of a printed number.
_OF_SPREAD, _OF_KT, _OF_NUMBER = 0.1, 1e-4, 1e-3
# Samples count as constant if their relative spread is at most this.
_ROUNDING = 1e-12


class Tolerance(NamedTuple):
    """Absolute tolerance and the reason for it."""

    value: float
    reason: str


def default_tolerance(
    quantity: Quantity | None, runs: list[Samples], verdict: LadderVerdict, results: Array
) -> Tolerance | None:
    """
    Return the default tolerance of a quantity; None if the runs do not show its value.

    The default is a tenth of the quantity's standard deviation, within runs and between runs. For
    the fluctuation of an energy, the default is a tenth of the kinetic energy's standard deviation.
    For the fluctuation and the drift of an energy, it is at least 1e-4 kT per degree of freedom,
    and for a drift at least a tenth of the drift that remains at small steps. For a printed or
    constant quantity, the default is a thousandth of its value, or of its largest result if the
    value is 0 within its error. `runs` are the samples on the finest rung, and `results` are the
    results of all runs.
    """
    if verdict.value is None or not np.all(np.isfinite(verdict.promised)):
        return None
    size, of = abs(verdict.value), "the number"
    if size <= (verdict.value_error or 0.0):
        size, of = float(np.max(np.abs(results))), "its largest result"
    number = Tolerance(_OF_NUMBER * size, f"a thousandth of {of}")
    if quantity is None or not runs:
        return number
    what = "ke" if quantity.is_energy_change and quantity.kind == "fluctuation" else ""
    within = float(np.median([each.spread(quantity, what) for each in runs]))
    # In a short run, a quantity may hardly vary although it differs between runs.
    between = 0.0 if what else float(np.std(results[-1], ddof=1))
    of = "the standard deviation of the kinetic energy" if what else "its standard deviation"
    found = Tolerance(_OF_SPREAD * math.hypot(within, between), f"a tenth of {of}")
    size = max(float(np.max(np.abs(each.values[what or quantity.what]))) for each in runs)
    if within <= _ROUNDING * size:
        found = number
    if quantity.is_energy_change:
        kinetic = float(np.median([thermal_tolerance(each) for each in runs]))
        thermal = Tolerance(kinetic, "1e-4 kT per degree of freedom")
        found = max(found, thermal, key=lambda each: each.value)
    if quantity.kind == "drift":
        lasting = Tolerance(
            _OF_SPREAD * abs(verdict.value), "a tenth of the drift at small timesteps"
        )
        found = max(found, lasting, key=lambda each: each.value)
    return found


def thermal_tolerance(samples: Samples) -> float:
    """Return 1e-4 kT per degree of freedom, in the unit of the sampled energies."""
    # The kinetic energy is kT/2 per degree of freedom.
    return 2.0 * _OF_KT * float(np.mean(samples.values["ke"])) if "ke" in samples.values else 0.0
