"""Types of numbers in a scene, which exclude truth values, complex numbers and infinity."""

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field

# Codes of the NumPy types that are no numbers here: truth values, complex numbers, bytes, dates and
# durations.
_NO_NUMBERS = ("b", "c", "S", "M", "m")


def not_a_bool(expected: str) -> BeforeValidator:
    """
    Return a validator that refuses truth values, complex numbers and bytes, also those of NumPy.

    Python would take them for numbers: True is 1, and an imaginary part is dropped.
    """

    def check(value: Any) -> Any:
        kind = getattr(getattr(value, "dtype", None), "kind", "")
        if isinstance(value, bool | complex | bytes | bytearray) or kind in _NO_NUMBERS:
            raise ValueError(f"expected {expected}")
        return value

    return BeforeValidator(check)


def at_least(least: float) -> AfterValidator:
    """Return a validator that refuses smaller numbers and gives the bound in a readable form."""

    def check(value: float) -> float:
        if value < least:
            raise ValueError(f"expected {least:g} or more")
        return value

    return AfterValidator(check)


IsCount = not_a_bool("a whole number")
IsNumber = not_a_bool("a number")
Number = Annotated[float, Field(allow_inf_nan=False), IsNumber]
PositiveNumber = Annotated[float, Field(gt=0, allow_inf_nan=False), IsNumber]
