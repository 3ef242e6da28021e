"""The error bar of a restitution, cause by cause."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ErrorBar:
    """
    Error of the restitution, cause by cause; None where it was not measured.

    Attributes
    ----------
    step : float or None
        From the run at another step.
    table : float
        From the certified force error of the bond table.
    rounding : float
        From coordinates held as absolute numbers, or from the arithmetic.
    ending : float
        What contacts could change that may still come; 0 unless the end is open.
    """

    step: float | None
    table: float
    rounding: float
    ending: float = 0.0

    @property
    def total(self) -> float | None:
        """Sum of the parts; None if the step error is unknown."""
        if self.step is None:
            return None
        return self.step + self.table + self.rounding + self.ending
