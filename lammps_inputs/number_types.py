"""Types of numbers in a scene, which exclude `True` and infinity."""

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field


def not_a_bool(expected: str) -> BeforeValidator:
    """Return a validator that refuses True and False, which are 1 and 0 in Python."""

    def check(value: Any) -> Any:
        if isinstance(value, bool):
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
