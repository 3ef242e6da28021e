r"""
The error of a step h, proved by the same collision at two larger ones.

Where the error falls with the power q of the step, eta at 1.3 h differs from that at h by
:math:`1.3^q - 1` of it: by more than the error itself if q is larger than
:math:`\ln 2/\ln 1.3 = 2.64`. That it is, the run at 2 h shows, which then differs by more than
:math:`2^q - 1 = 5.2` times as much. Nothing is known of the order beforehand, so that a chain that
grazes the wall, breaks or amplifies what steps miss is not trusted with that of its scheme. A step
that is cut by the first contact is the same in all three runs: where the last contact comes within
two steps, they may agree however large these are, and tell nothing.
"""

import math
import sys
from typing import Any

import numpy as np

from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.engines.schemes import STEP_SCHEMES

# A run is proved by runs at so many times its step: the far one and the near one.
COARSER = (2.0, 1.3)
_LEAST_ORDER = math.log(2.0) / math.log(COARSER[1])
_STEEPEST = 1.0 / (COARSER[0] ** _LEAST_ORDER - 1.0)
# What the far run leaves, by the order of the scheme, is taken so many times: its own error may be
# smaller than usual. Taken once, 3 of 779 random scenes had up to 1.4 times their bar, all of them
# chains with an error that changes its sign between the steps.
_LUCK = 3.0
# A little less, as the time to the last contact is another at every step.
_ENOUGH = 0.9


def runs_differ(order: float, steps: Any) -> Any:
    """
    Return whether runs at `COARSER` times a step are others: not where all is one part of it.

    `steps` is the time to the end of the last contact, in steps of an order, or an array of it.
    Also true of so short a part that no digit tells what it errs by.
    """
    short = sys.float_info.epsilon ** (1.0 / (order + 1.0))
    return np.logical_or(steps > COARSER[0], steps <= short)


def telling_step(scheme: StepSchemeName, step: float, lasted: float) -> float:
    """Return a step at which runs differ: itself, or one that the time `lasted` has enough of."""
    if runs_differ(STEP_SCHEMES[scheme].order, lasted / step):
        return step
    return _ENOUGH * lasted / COARSER[0]


def proved_error(
    scheme: StepSchemeName, steps: Any, far: Any, near: Any, rounding: Any, alike: Any
) -> tuple[Any, Any]:
    """
    Return the error of eta at a step, and whether it falls as it must for the near run to tell.

    That is the difference to the near run, where that bounds the error, but not less than what
    usually remains of the far one: an error that changes its sign between two steps makes one
    difference small. Else the larger difference; inf where the runs tell nothing.

    All but the scheme may be arrays. `steps` is the time to the end of the last contact, in steps;
    `far` and `near` are by how much eta differs at the larger steps of `COARSER`, inf where a run
    tells nothing, `rounding` by how much for other roundings, whatever the steps; `alike` is
    whether all three runs have as many contacts.
    """
    order = STEP_SCHEMES[scheme].order
    seen = runs_differ(order, steps)
    falls = seen & alike & (near <= _STEEPEST * far + rounding)
    usual = min(1.0, _LUCK * share_of_difference(order, COARSER[0])) * far
    error = np.maximum(near, np.where(falls, usual, far))
    return np.where(seen, error, np.inf)[()], falls


def usual_share(scheme: StepSchemeName) -> float:
    """Return the error at a step over the difference to the far run, by the scheme's order."""
    order = STEP_SCHEMES[scheme].order
    near, far = (k**order - 1.0 for k in reversed(COARSER))
    return max(near, min(far, _LUCK)) / far


def share_of_difference(order: float, times: float) -> float:
    r"""
    Return the error at a step over the difference to a run at so many times that step.

    Where errors fall with the power p of the step, that is :math:`1/(k^p - 1)`.
    """
    return float(1.0 / (times**order - 1.0))
