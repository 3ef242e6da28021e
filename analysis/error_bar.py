"""Error bar of a restitution, as the sum of errors by cause."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class ErrorBar:
    """Error of the restitution, split by cause; a part that was not measured is None."""

    step: float | None  #: Error due to the time step, from a second run at another time step.
    table: float  #: Error due to the bond table, from its certified force error.
    rounding: float  #: Error due to the rounding of absolute coordinates or of the arithmetic.
    #: Possible change of eta by later contacts; 0 unless later contacts are possible.
    ending: float = 0.0

    @property
    def total(self) -> float | None:
        """Sum of all errors; None if the error due to the time step is unknown."""
        if self.step is None:
            return None
        return self.step + self.table + self.rounding + self.ending


def error_alone(details: Mapping[str, Any], bar: float) -> float:
    """
    Return an error of eta that does not depend on the reference engine.

    With a tolerance, the error bar of a LAMMPS run includes its difference from a run by the
    reference engine. With that error bar the two engines would always agree. The error returned
    here comes from two LAMMPS runs instead: the difference between the run and its repetition at
    twice the time step. The errors due to the bond table, rounding and later contacts are added.
    """
    return float(details.get("choice", {}).get("error_alone", bar))
