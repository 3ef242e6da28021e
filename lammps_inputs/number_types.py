"""What numbers of a scene may be: `True` is none, nor is infinity."""

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field


def not_a_bool(expected: str) -> BeforeValidator:
    """Return what refuses True and False, which Python takes for 1 and 0."""

    def check(value: Any) -> Any:
        if isinstance(value, bool):
            raise ValueError(f"expected {expected}")
        return value

    return BeforeValidator(check)


def at_least(least: float) -> AfterValidator:
    """Return what refuses smaller numbers, with the bound in a readable form."""

    def check(value: float) -> float:
        if value < least:
            raise ValueError(f"expected {least:g} or more")
        return value

    return AfterValidator(check)


IsCount = not_a_bool("a whole number")
IsNumber = not_a_bool("a number")
Number = Annotated[float, Field(allow_inf_nan=False), IsNumber]
PositiveNumber = Annotated[float, Field(gt=0, allow_inf_nan=False), IsNumber]
