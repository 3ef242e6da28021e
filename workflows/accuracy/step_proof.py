r"""
The error of a step h, proved by the same collision at two larger ones.

Where the error falls with the power q of the step, eta at 1.3 h differs from that at h by
:math:`1.3^q - 1` of it: by more than the error itself if q is larger than
:math:`\ln 2/\ln 1.3 = 2.64`. That it is, the run at 2 h shows, which then differs by more than
:math:`2^q - 1 = 5.2` times as much. Nothing is known of the order beforehand, so that a chain that
grazes the wall, breaks or amplifies what steps miss is not trusted with that of its scheme. A step
that is cut by the first contact is the same in all three runs: where the last contact comes within
two steps, they may agree however large these are, and tell nothing.

Three values of eta may also agree by chance, as errors of single contacts cancel in their sum.
These errors themselves do not: eta is taken to differ by what the changes of all closing speeds
make of it, added up as if each had its sign by chance.
"""

import math
import sys
from typing import Any

import numpy as np

from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.engines.schemes import STEP_SCHEMES

# A run is proved by runs at so many times its step: the far one and the near one.
COARSER = (2.0, 1.3)
_LEAST_ORDER = math.log(2.0) / math.log(COARSER[1])
_STEEPEST = 1.0 / (COARSER[0] ** _LEAST_ORDER - 1.0)
# Part of the scatter of contacts that counts. With all of it, bars of 28 breaking lj chains were
# 1.6 times their errors or more, and 19 times in the median.
_SCATTER = 0.75
# The scatter of few contacts, the first of which is the same at every step, is itself a chance: of
# 17,231 plain cold chains all five outside their bars, by up to 1.3, had two contacts.
_OF_FEW = 2.0
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


def difference(line: Line, e: Any, other: Any, fine_speeds: Any, speeds: Any, velocity: Any) -> Any:
    """
    Return how far apart two runs are, in eta and in their contacts, of as many each.

    `e` and `other` are the velocities with which the bodies part, in units of the impact velocity
    `velocity`; the closing speeds at contacts are of shape (..., contacts), 0 where there is none.
    """
    squares = np.square(np.subtract(speeds, fine_speeds))
    # One after the other, so that zeros at the end change no digit.
    scatter = np.sqrt(np.cumsum(squares, axis=-1)[..., -1])
    changes = np.maximum(np.count_nonzero(fine_speeds, axis=-1) - 1, 1)
    share = _SCATTER * (1.0 + _OF_FEW / changes)
    change = share * 2.0 * line.contact_mass / line.reduced_mass * scatter / velocity
    by_contacts = (2.0 * np.abs(e) + change) * change
    return np.maximum(np.abs(np.square(other) - np.square(e)), by_contacts)


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
    usually remains of the far one. Else the larger difference; inf where the runs tell nothing.

    All but the scheme may be arrays. `steps` is the time to the end of the last contact, in steps;
    `far` and `near` are the :func:`difference` to runs at the larger steps of `COARSER`, inf where
    a run tells nothing, `rounding` by how much for other roundings, whatever the steps; `alike` is
    whether all three runs have as many contacts.
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
    Return the error at a step over the difference to a run at so many times that step.

    Where errors fall with the power p of the step, that is :math:`1/(k^p - 1)`.
    """
    return float(1.0 / (times**order - 1.0))
