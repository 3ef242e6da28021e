"""Define a ladder: the values of one varied setting, called rungs, from coarse to fine."""

import math
from dataclasses import dataclass

STEP = "timestep"
# Runs on one rung use nearby values, which differ from the value of the rung by at most this
# fraction.
PHASE_WIDTH = 0.02
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
# The default ladder begins at _OWN_COARSE times the script's step, and has _OWN_RUNGS rungs.
_OWN_COARSE, _OWN_RUNGS = 2.0, 4


@dataclass(frozen=True)
class Ladder:
    """Values of one setting, from coarse to fine in equal ratios."""

    name: str  #: Name of the varied setting.
    #: Coarse end.
    coarse: float
    fine: float  #: Fine end.
    rungs: int  #: Number of values.
    counts: bool = False  #: Whether all values are whole numbers.

    def value(self, rung: int, phase: int, phases: int) -> float:
        """
        Return the value of one run of a rung.

        Phase 0 is the value of the rung itself. The other phases are nearby values. Their offsets
        are multiples of the golden ratio modulo 1, which fill the width evenly and avoid common
        phases of the steps.
        """
        share = rung / (self.rungs - 1)
        value = self.coarse ** (1.0 - share) * self.fine**share
        if phase > 0:
            place = ((rung * phases + phase) * _GOLDEN) % 1.0
            value *= 1.0 + PHASE_WIDTH * (2.0 * place - 1.0)
        elif rung in (0, self.rungs - 1):
            value = self.fine if rung else self.coarse
        return float(round(value)) if self.counts else float(f"{value:.6g}")

    def text(self, value: float) -> str:
        """Return a value as text for LAMMPS."""
        return str(int(value)) if self.counts else repr(value).removesuffix(".0")

    def step(self, value: float) -> float:
        """Return a measure that shrinks towards the fine end: the value, or its inverse."""
        return value if self.fine < self.coarse else 1.0 / value


def ladder_around(step: float, coarser: float = _OWN_COARSE) -> Ladder:
    """Return the ladder of steps around a script's own step; each step is half the one before."""
    coarse = coarser * step
    return Ladder(STEP, coarse, coarse * 0.5 ** (_OWN_RUNGS - 1), _OWN_RUNGS)
