"""A ladder: the values of one variable, from coarse to fine."""

import math
from dataclasses import dataclass

STEP = "timestep"
# Nearby values of one rung lie within this share of it on either side.
PHASE_WIDTH = 0.02
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
# Coarsest step of the default ladder over the script's step, and the number of rungs.
_OWN_COARSE, _OWN_RUNGS = 2.0, 4


@dataclass(frozen=True)
class Ladder:
    """Values of one variable, from coarse to fine in equal ratios."""

    name: str  #: The LAMMPS variable.
    #: Coarse and fine end.
    coarse: float
    fine: float  #: Fine end.
    rungs: int  #: Number of values.
    counts: bool = False  #: Whether they are whole numbers.

    def value(self, rung: int, phase: int, phases: int) -> float:
        """
        Return the value of one run of a rung.

        Phase 0 is the rung itself. The others lie around it by multiples of the golden ratio, which
        fill the width evenly and never share a phase of the step.
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
        return str(int(value)) if self.counts else repr(value)

    def step(self, value: float) -> float:
        """Return the value, or its inverse if values grow towards the fine end."""
        return value if self.fine < self.coarse else 1.0 / value


def ladder_around(step: float, coarser: float = _OWN_COARSE) -> Ladder:
    """Return the ladder of steps around a script's own, each half of the one before."""
    coarse = coarser * step
    return Ladder(STEP, coarse, coarse * 0.5 ** (_OWN_RUNGS - 1), _OWN_RUNGS)
