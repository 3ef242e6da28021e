r"""
Prove a bound of the error due to a step h by runs of the same collision at two larger steps.

If the error is proportional to the power q of the step, eta at 1.3 h differs from eta at h by
:math:`1.3^q - 1` times the error. This difference exceeds the error if q is larger than :math:`\ln
2/\ln 1.3 = 2.64`. The run at 2 h shows whether q is larger: the difference in eta is then more than
:math:`2^q - 1 = 5.2` times the error. The order of the scheme is not assumed, because errors do not
follow it if a chain grazes the wall, breaks or amplifies the errors of steps. A step that ends at
the first contact is the same in all three runs. If the last contact comes within two steps, the
runs may therefore agree for any step, and prove nothing.

Three values of eta may also agree by chance, because the errors of single contacts may cancel in
their sum. The difference in eta is therefore also estimated from the changes of all closing speeds,
summed with random signs.
"""

import math
import sys
from typing import Any

import numpy as np

from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.engines.schemes import STEP_SCHEMES

# Two runs whose steps are longer by these factors prove the error of a run at a step h. The run at
# 2 h is called the far run, the run at 1.3 h the near run.
COARSER = (2.0, 1.3)
_LEAST_ORDER = math.log(2.0) / math.log(COARSER[1])
_STEEPEST = 1.0 / (COARSER[0] ** _LEAST_ORDER - 1.0)
# Fraction of the scatter of contacts that enters the error. The scatter is the root of the sum of
# the squared differences between the contact speeds of two runs. With this fraction, no error bar
# among 20,114 plain cold chains of 2 to 7 particles is exceeded (`python -m
# benchmarks.bars.plain_scenes --seed 53 --particles 2 3 4 5 7`). The error bars of 24 breaking lj
# chains of 10 to 97 particles are at least 2.6 times their errors.
_SCATTER = 0.75
# Additional share for few contacts, whose scatter is itself uncertain; the first contact is the
# same at every step. Without this share, the errors of five among 17,231 plain cold chains exceeded
# their error bars, by a factor of up to 1.3; all five had two contacts.
_OF_FEW = 2.0
# The time to the last contact depends on the step; it is multiplied by this factor as a reserve.
_ENOUGH = 0.9


def runs_differ(order: float, steps: Any) -> Any:
    """
    Return whether the collision is long enough for runs at `COARSER` times a step to differ.

    Runs do not differ if the whole collision fits into one step. `steps` is the time to the end of
    the last contact in units of the step, or an array of such times; `order` is the order of the
    scheme. The result is also true if the collision takes so short a part of a step that its error
    is below rounding.
    """
    short = sys.float_info.epsilon ** (1.0 / (order + 1.0))
    return np.logical_or(steps > COARSER[0], steps <= short)


def difference(line: Line, e: Any, other: Any, fine_speeds: Any, speeds: Any, velocity: Any) -> Any:
    """Return the difference in eta between two runs, or its estimate from contacts if larger."""
    squares = np.square(np.subtract(speeds, fine_speeds))
    # Records of contacts may end with zeros as padding. In a cumulative sum, these zeros change no
    # digit.
    scatter = np.sqrt(np.cumsum(squares, axis=-1)[..., -1])
    changes = np.maximum(np.count_nonzero(fine_speeds, axis=-1) - 1, 1)
    share = _SCATTER * (1.0 + _OF_FEW / changes)
    change = share * 2.0 * line.contact_mass / line.reduced_mass * scatter / velocity
    by_contacts = (2.0 * np.abs(e) + change) * change
    return np.maximum(np.abs(np.square(other) - np.square(e)), by_contacts)


def distinguishing_step(scheme: StepSchemeName, step: float, lasted: float) -> float:
    """Return a step at which runs differ: `step`, or a smaller step for a short collision."""
    if runs_differ(STEP_SCHEMES[scheme].order, lasted / step):
        return step
    return _ENOUGH * lasted / COARSER[0]


def proved_error(
    scheme: StepSchemeName, steps: Any, far: Any, near: Any, rounding: Any, alike: Any
) -> tuple[Any, Any]:
    """
    Return the error of eta at a step, and whether the runs converge fast enough.

    If the runs converge fast enough, the error is the larger of two values: the difference from the
    near run, and the difference from the far run times the share that the order of the scheme
    predicts. Otherwise the error is the larger of both differences, or inf if the runs prove
    nothing.

    All arguments except the scheme may be arrays. `steps` is the time to the end of the last
    contact in units of the step. `far` and `near` are the :func:`difference` from the runs at the
    larger steps `COARSER`, inf if such a run failed. `rounding` is the difference that other
    rounding errors cause at any step. `alike` states whether all three runs have the same number of
    contacts.
    """
    order = STEP_SCHEMES[scheme].order
    seen = runs_differ(order, steps)
    falls = seen & alike & (near <= _STEEPEST * far + rounding)
    usual = min(1.0, share_of_difference(order, COARSER[0])) * far
    error = np.maximum(near, np.where(falls, usual, far))
    return np.where(seen, error, np.inf)[()], falls


def usual_share(scheme: StepSchemeName) -> float:
    """Return the ratio of the proved error to the far run's difference, as the order predicts."""
    order = STEP_SCHEMES[scheme].order
    near, far = (k**order - 1.0 for k in reversed(COARSER))
    return max(near, 1.0) / far


def share_of_difference(order: float, times: float) -> float:
    r"""
    Return the ratio of the error at a step to the difference from a run at a longer step.

    If errors are proportional to the power p of the step, and the longer step is k times the step,
    the ratio is :math:`1/(k^p - 1)`.
    """
    return float(1.0 / (times**order - 1.0))
