"""What single fields of a scene may be."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

from chaincor.lammps_inputs.bonds.formula_text import check_parameters
from chaincor.lammps_inputs.number_types import IsCount, IsNumber, PositiveNumber
from chaincor.lammps_inputs.scene_parts.given_bodies import read_masses
from chaincor.lammps_inputs.thermal_state import LARGEST_SEED

Engine = Literal["lammps", "reference"]
Wall = Literal["event", "reflect"]
TableStyle = Literal["linear", "spline"]
Contact = Literal["hard", "power"]


def _frames(value: Any) -> Any:
    if isinstance(value, bool | str) and value != "contacts":
        raise ValueError("expected a positive number, or 'contacts'")
    return value


def _without_null_characters(value: Path) -> Path:
    if "\0" in str(value):
        raise ValueError("expected a path without null characters")
    return value


Tolerance = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False), IsNumber]
ContactExponent = Annotated[float, Field(ge=1, le=9), IsNumber]
Compression = Annotated[float, Field(gt=-1, lt=1), IsNumber]
ParticleCount = Annotated[int, Field(ge=1, le=10_000_000), IsCount]
TableRows = Annotated[int, Field(ge=3, le=10_000_000), IsCount]
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED), IsCount]
Masses = Annotated[
    tuple[Annotated[float, Field(gt=0, allow_inf_nan=False)], ...],
    Field(min_length=1),
    BeforeValidator(read_masses),
]
Parameters = Annotated[dict[str, float], BeforeValidator(check_parameters)]
Frames = Annotated[PositiveNumber | Literal["contacts"], BeforeValidator(_frames)]
FilePath = Annotated[Path, AfterValidator(_without_null_characters)]
