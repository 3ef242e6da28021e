"""Error bar of a restitution, as the sum of its causes."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ErrorBar:
    """Error of the restitution, split by cause; a part that was not measured is None."""

    step: float | None  #: Error due to the step, from the run at another step.
    table: float  #: Error due to the bond table, from its certified force error.
    rounding: float  #: Error due to the rounding of absolute coordinates or of the arithmetic.
    #: Possible change of eta by later contacts; 0 unless the end is open.
    ending: float = 0.0

    @property
    def total(self) -> float | None:
        """Sum of the parts; None if the step error is unknown."""
        if self.step is None:
            return None
        return self.step + self.table + self.rounding + self.ending


def error_alone(details: Mapping[str, Any], bar: float) -> float:
    """
    Return the error of a result's eta that does not depend on the reference engine.

    With a tolerance, the error bar of LAMMPS's run includes the distance to a run of the reference
    engine, so that the two would always agree. The error here comes from the difference of LAMMPS's
    run and its own run at twice the step, with the parts of the table, rounding and ending.
    """
    return float(details.get("choice", {}).get("error_alone", bar))
