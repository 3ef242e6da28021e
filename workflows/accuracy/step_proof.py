r"""
Error of a step h, proved by the same collision at two larger steps.

If the error falls with the power q of the step, eta at 1.3 h differs from eta at h by :math:`1.3^q
- 1` times the error. This is more than the error itself if q is larger than :math:`\ln 2/\ln 1.3 =
2.64`. The run at 2 h shows whether q is larger: its difference is then more than :math:`2^q - 1 =
5.2` times the error. The order of the scheme is not assumed, because it does not hold for a chain
that grazes the wall, breaks or amplifies errors of the steps. A step that ends at the first contact
is the same in all three runs. If the last contact comes within two steps, the runs may therefore
agree for any step size and prove nothing.

Three values of eta may also agree by chance, because errors of single contacts cancel in their sum.
The errors of single contacts do not cancel: the difference of eta is therefore also estimated from
the changes of all closing speeds, summed with random signs.
"""

import math
import sys
from typing import Any

import numpy as np

from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.engines.schemes import STEP_SCHEMES

# The two runs that prove a run have steps longer by these factors: the far run and the near run.
COARSER = (2.0, 1.3)
_LEAST_ORDER = math.log(2.0) / math.log(COARSER[1])
_STEEPEST = 1.0 / (COARSER[0] ** _LEAST_ORDER - 1.0)
# Fraction of the scatter of contacts that enters the error. With it, no error bar of 20,114 plain
# cold chains of 2 to 7 particles is exceeded (`python -m benchmarks.bars.plain_scenes --seed 53
# --particles 2 3 4 5 7`), and those of 24 breaking lj chains of 10 to 97 are at least 2.6 times
# their errors.
_SCATTER = 0.75
# Additional share for few contacts, whose scatter is itself uncertain; the first contact is the
# same at every step. Among 17,231 plain cold chains all five outside their error bars, by a factor
# of up to 1.3, had two contacts.
_OF_FEW = 2.0
# The time to the last contact depends on the step, so it is multiplied by this factor.
_ENOUGH = 0.9


def runs_differ(order: float, steps: Any) -> Any:
    """
    Return whether runs at `COARSER` times a step differ; they do not if all fits into one step.

    `steps` is the time to the end of the last contact in units of the step, or an array of it;
    `order` is the order of the scheme. The result is also true for a part of a step so short that
    its error is below rounding.
    """
    short = sys.float_info.epsilon ** (1.0 / (order + 1.0))
    return np.logical_or(steps > COARSER[0], steps <= short)


def difference(line: Line, e: Any, other: Any, fine_speeds: Any, speeds: Any, velocity: Any) -> Any:
    """Return the difference of two runs in eta and in their contacts, of equal number."""
    squares = np.square(np.subtract(speeds, fine_speeds))
    # A cumulative sum is taken, so that zeros at the end change no digit.
    scatter = np.sqrt(np.cumsum(squares, axis=-1)[..., -1])
    changes = np.maximum(np.count_nonzero(fine_speeds, axis=-1) - 1, 1)
    share = _SCATTER * (1.0 + _OF_FEW / changes)
    change = share * 2.0 * line.contact_mass / line.reduced_mass * scatter / velocity
    by_contacts = (2.0 * np.abs(e) + change) * change
    return np.maximum(np.abs(np.square(other) - np.square(e)), by_contacts)


def telling_step(scheme: StepSchemeName, step: float, lasted: float) -> float:
    """Return a step at which runs differ: `step`, or a smaller one if `lasted` is too short."""
    if runs_differ(STEP_SCHEMES[scheme].order, lasted / step):
        return step
    return _ENOUGH * lasted / COARSER[0]


def proved_error(
    scheme: StepSchemeName, steps: Any, far: Any, near: Any, rounding: Any, alike: Any
) -> tuple[Any, Any]:
    """
    Return the error of eta at a step, and whether the runs converge fast enough.

    If they do, the error is the difference to the near run, but at least the share of the far
    difference that the order of the scheme leaves. Otherwise it is the larger difference, or inf if
    the runs prove nothing.

    All arguments but the scheme may be arrays. `steps` is the time to the end of the last contact
    in units of the step. `far` and `near` are the :func:`difference` to runs at the larger steps of
    `COARSER`, inf if such a run failed. `rounding` is the difference between runs with other
    roundings at any step. `alike` says whether all three runs have equally many contacts.
    """
    order = STEP_SCHEMES[scheme].order
    seen = runs_differ(order, steps)
    falls = seen & alike & (near <= _STEEPEST * far + rounding)
    usual = min(1.0, share_of_difference(order, COARSER[0])) * far
    error = np.maximum(near, np.where(falls, usual, far))
    return np.where(seen, error, np.inf)[()], falls


def usual_share(scheme: StepSchemeName) -> float:
    """Return the error at a step over the difference to the far run, by the scheme's order."""
    order = STEP_SCHEMES[scheme].order
    near, far = (k**order - 1.0 for k in reversed(COARSER))
    return max(near, 1.0) / far


def share_of_difference(order: float, times: float) -> float:
    r"""
    Return the error at a step over the difference to a run at `times` times that step.

    If errors fall with the power p of the step, it is :math:`1/(k^p - 1)`.
    """
    return float(1.0 / (times**order - 1.0))
