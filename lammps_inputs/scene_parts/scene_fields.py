"""Keys of a scene, with type, default, description and group, and the keys that they exclude."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from chaincor.lammps_inputs.bonds.formula_text import check_parameters
from chaincor.lammps_inputs.bonds.potentials import BondKeys
from chaincor.lammps_inputs.contacts.contact_keys import ContactKeys
from chaincor.lammps_inputs.number_types import IsCount, IsNumber, PositiveNumber, at_least
from chaincor.lammps_inputs.scene_parts.given_masses import read_masses
from chaincor.lammps_inputs.schemes import COMPOSITIONS, Scheme
from chaincor.lammps_inputs.thermal_state import LARGEST_SEED

Engine = Literal["lammps", "reference"]
Wall = Literal["event", "reflect"]
TableStyle = Literal["linear", "spline"]


def _listed(values: Iterable[object]) -> str:
    *first, last = map(str, values)
    return f"{', '.join(first)} or {last}"


_COMPOSED = [scheme for scheme in COMPOSITIONS.values() if scheme.half]
_ORDERS = _listed(scheme.order for scheme in _COMPOSED)
_STAGES = _listed(len(scheme.weights) for scheme in _COMPOSED)
_STEPS = _listed(scheme.usual_step for scheme in COMPOSITIONS.values())


def _frames(value: Any) -> Any:
    if isinstance(value, bool | str) and value != "contacts":
        raise ValueError("expected a positive number, or 'contacts'")
    return value


def _without_null_characters(value: Path) -> Path:
    if "\0" in str(value):
        raise ValueError("expected a path without null characters")
    return value


ToleranceNumber = Annotated[float, Field(gt=0, le=1, allow_inf_nan=False), IsNumber]
# At lower temperatures, roots and quotients underflow or overflow.
Temperature = Annotated[PositiveNumber, at_least(1e-290)]
Compression = Annotated[float, Field(gt=-1, lt=1), IsNumber]
ParticleCount = Annotated[int, Field(ge=1, le=10_000_000), IsCount]
TableRows = Annotated[int, Field(ge=3, le=10_000_000), IsCount]
Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED), IsCount]
Masses = Annotated[
    tuple[Annotated[float, Field(gt=0, allow_inf_nan=False)], ...],
    Field(min_length=1),
    BeforeValidator(read_masses),
]
GivenParameters = Annotated[dict[str, float], BeforeValidator(check_parameters)]
FrameCount = Annotated[PositiveNumber | Literal["contacts"], BeforeValidator(_frames)]
FilePath = Annotated[Path, AfterValidator(_without_null_characters)]


@dataclass(frozen=True)
class Excludes:
    """Annotation of a key with the keys that it excludes."""

    keys: tuple[str, ...]  #: Keys that must not be given together with this key.


class ChainKeys(BondKeys):
    """Keys for the chain and its bonds."""

    bond_file: FilePath | None = Field(
        default=None, description="LAMMPS bond table of your own, for potential table"
    )
    energy: str | None = Field(
        default=None,
        description="bond energy as a formula in the strain s or the length r, for potential "
        "formula",
    )
    parameters: GivenParameters | None = Field(
        default=None, description="values of the parameters in the formula, such as D=0.0139,a=6"
    )
    particles: ParticleCount = Field(default=100, description="number of particles in the chain")


class TargetKeys(BaseModel):
    """Keys for the masses and the target."""

    masses: Masses | None = Field(
        default=None,
        description="masses of the particles, from the contact outward, repeated along the chain: "
        "1,2 or a file of numbers [default: 1]",
    )
    diameters: Masses | None = Field(
        default=None,
        description="diameters of hertz beads, from the contact outward, repeated along the "
        "column; they determine the stiffness of the contacts, and their cubes are the default "
        "masses [default: 1]",
    )
    target_particles: ParticleCount | None = Field(
        default=None,
        description="number of particles of a free body that replaces the wall; the body is at "
        "rest and has the same bonds as the chain",
    )
    target_masses: Masses | None = Field(
        default=None,
        description="masses of the target's particles, from the contact outward [default: 1]",
    )


class StateKeys(BaseModel):
    """Keys for the initial state."""

    initial: FilePath | None = Field(
        default=None,
        description="state in which the chain arrives: CSV file with one row for each particle and "
        "the columns position or strain, velocity, mass",
    )
    compression: Compression | None = Field(
        default=None,
        description="fraction by which all bonds of the chain are compressed at the start",
    )
    temperature: Temperature | None = Field(
        default=None,
        description="k_B T of both bodies at the start, in thermal equilibrium; bond lengths and "
        "velocities are drawn at random [default: cold]",
    )
    seed: Seed | None = Field(
        default=None, description="seed of the random initial state, an integer [default: 1]"
    )


class SpeedKeys(BaseModel):
    """Keys for the impact speed."""

    speed: PositiveNumber | None = Field(
        default=None, description="impact speed in units of v* [default: 0.4]"
    )
    velocity: Annotated[PositiveNumber | None, Excludes(("speed",))] = Field(
        default=None, description="impact speed in absolute units, instead of --speed"
    )


class EngineKeys(BaseModel):
    """Keys for the engine and its accuracy."""

    engine: Engine = Field(
        default="lammps",
        description="program that integrates the motion: "
        "LAMMPS, or chaincor's own reference engine",
    )
    tolerance: Annotated[
        ToleranceNumber | None, Excludes(("wall", "scheme", "timestep", "table", "table_points"))
    ] = Field(default=None, description="absolute error allowed in the restitution [default: 1e-6]")


class NumericsKeys(BaseModel):
    """Keys for explicit numerics."""

    wall: Wall | None = Field(
        default=None,
        description="wall that ends a step at the impact, or LAMMPS's fix wall/reflect [default: "
        "event]",
    )
    scheme: Scheme | None = Field(
        default=None,
        description=f"integration method: Verlet steps, or steps of order {_ORDERS}, which are "
        f"composed of {_STAGES} Verlet steps [default: chosen for the tolerance; if you give "
        "timestep, table or wall: order6, or verlet with wall reflect]",
    )
    timestep: PositiveNumber | None = Field(
        default=None,
        description="time step H; for a composed scheme, the length of the whole step [default: "
        f"chosen for the tolerance; if you give scheme, table or wall: {_STEPS} "
        f"for {', '.join(COMPOSITIONS)}, or 0.005 with wall reflect]",
    )
    table: TableStyle | None = Field(
        default=None,
        description="interpolation in the table of the bond [default: spline; linear for kinks]",
    )
    table_points: TableRows | None = Field(
        default=None,
        description="number of rows in the table of the bond [default: as the scene needs]",
    )
    error: bool = Field(
        default=True, description="repeat the run at H/2 and two other steps for the error bar"
    )


class FileKeys(BaseModel):
    """Keys for the files that a run writes."""

    dump: FilePath | None = Field(default=None, description="write the motion to this LAMMPS dump")
    dump_frames: FrameCount = Field(
        default=20.0,
        description="number of frames in the time that sound needs to cross the chain, or "
        "'contacts' for one frame after each contact",
    )
    save: FilePath | None = Field(default=None, description="keep the LAMMPS job in this folder")
    arrays: FilePath | None = Field(default=None, description="write the arrays to this NPZ file")


class SceneFields(
    FileKeys, NumericsKeys, EngineKeys, SpeedKeys, StateKeys, ContactKeys, TargetKeys, ChainKeys
):
    """All keys of a scene, each validated separately, in the order of their groups."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", arbitrary_types_allowed=True, allow_inf_nan=False
    )


def keys_of(*groups: type[BaseModel]) -> tuple[str, ...]:
    """Return the keys that some classes declare, in order of declaration."""
    return tuple(key for group in groups for key in group.model_fields)


def _keys_with(kind: Any) -> tuple[str, ...]:
    fields = SceneFields.model_fields.items()
    return tuple(key for key, field in fields if kind in get_args(field.annotation))


# Groups of options in the help, with titles and keys.
GROUPS: dict[str, tuple[str, ...]] = {
    "What collides": keys_of(ChainKeys),
    "Masses, target, contact and initial state": keys_of(TargetKeys, ContactKeys, StateKeys),
    "Impact speed": keys_of(SpeedKeys),
    "Engine and accuracy": keys_of(EngineKeys),
    "Explicit numerics, instead of a tolerance": keys_of(NumericsKeys),
    "Files to write": keys_of(FileKeys),
}
BODY_KEYS = keys_of(TargetKeys, ContactKeys, StateKeys)
FILE_KEYS = keys_of(FileKeys)
OUTPUT_KEYS = (*FILE_KEYS, "error")
NUMERICS_KEYS = tuple(key for key in keys_of(NumericsKeys) if key != "error")
# Keys whose values are files to read. Values of MASSES_READ may also be lists of numbers.
FILES_READ = tuple(key for key in _keys_with(FilePath) if key not in FILE_KEYS)
MASSES_READ = _keys_with(Masses)


def _excluded() -> dict[str, tuple[str, ...]]:
    found: dict[str, tuple[str, ...]] = {}
    for key, field in SceneFields.model_fields.items():
        declared = [each.keys for each in field.metadata if isinstance(each, Excludes)]
        for other in (other for keys in declared for other in keys):
            found[key] = (*found.get(key, ()), other)
            found[other] = (*found.get(other, ()), key)
    return found


# For each key, the keys that cannot be given together with it.
EXCLUDED = _excluded()
