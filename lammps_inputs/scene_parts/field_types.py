"""What single fields of a scene may be."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from chaincor.lammps_inputs.bonds.formula_text import check_parameters
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import NAMED_POTENTIALS
from chaincor.lammps_inputs.errors import meant
from chaincor.lammps_inputs.scene_parts.given_bodies import read_masses
from chaincor.lammps_inputs.thermal_state import LARGEST_SEED

PotentialName = Literal["harmonic", "lj", "toda", "morse", "log", "power", "table", "formula"]
POTENTIAL_NAMES = (*NAMED_POTENTIALS, "table", "formula")
Engine = Literal["lammps", "reference"]
Wall = Literal["event", "reflect"]
Scheme = Literal["verlet", "order4", "order6", "order8"]
TableStyle = Literal["linear", "spline"]
Contact = Literal["hard", "power"]


def _potential(value: Any) -> Any:
    if isinstance(value, str) and value.lower() in POTENTIAL_NAMES:
        return value.lower()
    if isinstance(value, Potential):
        return value
    near = meant(value, POTENTIAL_NAMES) if isinstance(value, str) else None
    hint = "" if near is None else f"; did you mean {near!r}?"
    raise ValueError(f"expected one of {', '.join(POTENTIAL_NAMES)}{hint}")


def _not_a_bool(expected: str) -> BeforeValidator:
    def check(value: Any) -> Any:
        if isinstance(value, bool):
            raise ValueError(f"expected {expected}")
        return value

    return BeforeValidator(check)


def _frames(value: Any) -> Any:
    if isinstance(value, bool | str) and value != "contacts":
        raise ValueError("expected a positive number, or 'contacts'")
    return value


def _without_null_characters(value: Path) -> Path:
    if "\0" in str(value):
        raise ValueError("expected a path without null characters")
    return value


_IsCount = _not_a_bool("a whole number")
_IsNumber = _not_a_bool("a number")

AnyPotential = Annotated[PotentialName | Potential, BeforeValidator(_potential)]
Number = Annotated[float, Field(allow_inf_nan=False), _IsNumber]
PositiveNumber = Annotated[float, Field(gt=0, allow_inf_nan=False), _IsNumber]
Tolerance = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False), _IsNumber]
ContactExponent = Annotated[float, Field(ge=1, le=9), _IsNumber]
Compression = Annotated[float, Field(gt=-1, lt=1), _IsNumber]
ParticleCount = Annotated[int, Field(ge=1, le=10_000_000), _IsCount]
TableRows = Annotated[int, Field(ge=3, le=10_000_000), _IsCount]
PowerOrder = Annotated[int, Field(ge=3, le=99), _IsCount]
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED), _IsCount]
Masses = Annotated[
    tuple[Annotated[float, Field(gt=0, allow_inf_nan=False)], ...],
    Field(min_length=1),
    BeforeValidator(read_masses),
]
Parameters = Annotated[dict[str, float], BeforeValidator(check_parameters)]
Frames = Annotated[PositiveNumber | Literal["contacts"], BeforeValidator(_frames)]
FilePath = Annotated[Path, AfterValidator(_without_null_characters)]
