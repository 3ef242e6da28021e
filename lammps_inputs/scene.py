"""A scene: the validated, frozen description of one collision and of what is wanted from it."""

from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
import tomli_w
from pydantic import ConfigDict, Field, ValidationError, model_validator

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import NAMED_POTENTIALS, BondKeys, named_bond
from chaincor.lammps_inputs.errors import SceneError, mistakes_in
from chaincor.lammps_inputs.initial_state import InitialState, read_initial_state
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.number_types import PositiveNumber
from chaincor.lammps_inputs.scene_parts.field_types import (
    Compression,
    Contact,
    ContactExponent,
    Engine,
    FilePath,
    Frames,
    Masses,
    Parameters,
    ParticleCount,
    Seed,
    TableRows,
    TableStyle,
    Tolerance,
    Wall,
)
from chaincor.lammps_inputs.scene_parts.given_bodies import chain_masses, line_of
from chaincor.lammps_inputs.scene_parts.identity import DEFAULT_TOLERANCE as DEFAULT_TOLERANCE
from chaincor.lammps_inputs.scene_parts.identity import FILE_KEYS as FILE_KEYS
from chaincor.lammps_inputs.scene_parts.identity import OUTPUT_KEYS as OUTPUT_KEYS
from chaincor.lammps_inputs.scene_parts.identity import (
    canonical_fields,
    canonical_json,
    hash_of,
    plain_fields,
    shown_fields,
)
from chaincor.lammps_inputs.scene_parts.rules import NUMERICS_KEYS, check_together, told
from chaincor.lammps_inputs.scene_parts.scene_file import parse_toml, read_scene_fields
from chaincor.lammps_inputs.schemes import Scheme

DEFAULT_SPEED = 0.4  # units of v*
DEFAULT_HARMONIC_VELOCITY = 0.1


class Scene(BondKeys):
    """
    One collision of a chain with a wall.

    Lengths, masses and stiffnesses are in units of the natural bond length, the particle mass and
    the bond stiffness. Field names are the keys of a scene file and, with dashes, the options of
    ``chaincor run``.

    Raises
    ------
    SceneError
        A line for each mistake, naming the field, what was given and what is expected.

    Examples
    --------
    >>> from chaincor import Scene
    >>> print(Scene(potential="toda", particles=50).replace(speed=0.8).to_toml().strip())
    potential = "toda"
    particles = 50
    speed = 0.8
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", arbitrary_types_allowed=True, allow_inf_nan=False
    )

    bond_file: FilePath | None = Field(
        default=None, description="LAMMPS bond table of your own, for potential table"
    )
    energy: str | None = Field(
        default=None,
        description="U as a formula of the strain s, or the length r, for potential formula",
    )
    parameters: Parameters | None = Field(
        default=None, description="numbers for the other names in the formula, such as D=0.0139,a=6"
    )
    particles: ParticleCount = Field(default=100, description="number of particles in the chain")
    masses: Masses | None = Field(
        default=None,
        description="masses of the particles, from the contact outward, repeated along the chain: "
        "1,2 or a file of numbers [default: 1]",
    )
    target_particles: ParticleCount | None = Field(
        default=None,
        description="particles of a free body at rest, with the same bonds, in place of the wall",
    )
    target_masses: Masses | None = Field(
        default=None,
        description="masses of the target's particles, from the contact outward [default: 1]",
    )
    contact: Contact | None = Field(
        default=None,
        description="hard bodies, or soft ones, which repel with the force K d^q where they "
        "overlap by d [default: hard]",
    )
    contact_stiffness: PositiveNumber | None = Field(
        default=None, description="K of contact power [default: 1]"
    )
    contact_exponent: ContactExponent | None = Field(
        default=None, description="q of contact power, 1 to 9; 1.5 is Hertz's [default: 1.5]"
    )
    initial: FilePath | None = Field(
        default=None,
        description="state in which the chain arrives: CSV file with one row for each particle and "
        "the columns position or strain, velocity, mass",
    )
    compression: Compression | None = Field(
        default=None, description="fraction by which all bonds of the chain are compressed at first"
    )
    temperature: PositiveNumber | None = Field(
        default=None,
        description="k_B T at which both bodies are in equilibrium at first: bond lengths and "
        "velocities are drawn at random [default: cold]",
    )
    seed: Seed | None = Field(
        default=None, description="seed of the random first state, a whole number [default: 1]"
    )
    speed: PositiveNumber | None = Field(
        default=None, description="impact speed in units of v* [default: 0.4]"
    )
    velocity: PositiveNumber | None = Field(
        default=None, description="impact speed in absolute units, instead of --speed"
    )
    engine: Engine = Field(default="lammps", description="who integrates the motion")
    tolerance: Tolerance | None = Field(
        default=None, description="absolute error asked of the restitution [default: 1e-6]"
    )
    wall: Wall | None = Field(
        default=None,
        description="impact-located wall, or the stock fix wall/reflect [default: event]",
    )
    scheme: Scheme | None = Field(
        default=None,
        description="integration method: Verlet steps, or 5, 9 or 17 of them composed into one "
        "step of order 4, 6 or 8 [default: chosen for the tolerance; order6 with other numerics "
        "of your own, verlet with wall reflect]",
    )
    timestep: PositiveNumber | None = Field(
        default=None,
        description="time step H, that of a whole composed step [default: chosen for the "
        "tolerance; with other numerics of your own 0.0125, 0.05, 0.1 or 0.2 for the four "
        "schemes, 0.005 with wall reflect]",
    )
    table: TableStyle | None = Field(
        default=None,
        description="interpolation of the tabulated bond [default: spline; linear for kinks]",
    )
    table_points: TableRows | None = Field(
        default=None, description="rows of the tabulated bond [default: as the scene needs]"
    )
    error: bool = Field(
        default=True, description="run again at H/2 and two other steps for the error bar"
    )
    dump: FilePath | None = Field(default=None, description="write the motion to this LAMMPS dump")
    dump_frames: Frames = Field(
        default=20.0,
        description="frames of the dump per sound crossing of the chain, or 'contacts' for one "
        "after each",
    )
    save: FilePath | None = Field(default=None, description="keep the LAMMPS job in this folder")
    arrays: FilePath | None = Field(default=None, description="write the arrays to this NPZ file")

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise told(error, type(self).model_fields) from None

    @model_validator(mode="after")
    def _check_together(self) -> Self:
        check_together(self)
        return self

    def __repr_args__(self) -> Iterable[tuple[str, Any]]:
        """Yield what decides the collision, and whatever else was given, as it may be typed."""
        yield from shown_fields(self).items()

    def __str__(self) -> str:
        return repr(self)

    @property
    def label(self) -> str:
        """Name of the potential, for people."""
        return self.potential if isinstance(self.potential, str) else self.potential.name

    @cached_property
    def bond(self) -> Potential:
        """The potential of the bonds."""
        if isinstance(self.potential, Potential):
            return self.potential
        if self.potential == "table":
            from chaincor.lammps_inputs.bonds.table_file import read_bond_table

            assert self.bond_file is not None
            return read_bond_table(self.bond_file)
        if self.potential == "formula":
            from chaincor.lammps_inputs.bonds.formula import formula_bond

            assert self.energy is not None
            return formula_bond(self.energy, tuple((self.parameters or {}).items()))
        given = {key: getattr(self, key) for key in NAMED_POTENTIALS[self.potential].keys}
        return named_bond(self.potential, **{k: v for k, v in given.items() if v is not None})

    @property
    def impact_velocity(self) -> float:
        """v0 > 0 in absolute units; the chain's centre of mass arrives with velocity -v0."""
        if self.initial_state is not None and self.initial_state.velocities is not None:
            masses = chain_masses(self)
            return -float(masses @ self.initial_state.velocities) / float(np.sum(masses))
        if self.velocity is not None:
            return self.velocity
        scale = self.bond.natural_speed
        if scale is None:
            return DEFAULT_HARMONIC_VELOCITY
        return (DEFAULT_SPEED if self.speed is None else self.speed) * scale

    @cached_property
    def initial_state(self) -> InitialState | None:
        """What the chain comes with, where a file says so."""
        return None if self.initial is None else read_initial_state(self.initial)

    @cached_property
    def line(self) -> Line:
        """Both bodies along x, and the state in which they come."""
        return line_of(self)

    @property
    def fast_stiffness(self) -> float:
        """U''(1) over the smallest mass: the square of the fastest bond's frequency."""
        return self.bond.stiffness / self.line.lightest

    @property
    def slow_stiffness(self) -> float:
        """U''(1) over the mean mass of the slower body: sound crosses bonds at its root."""
        return self.bond.stiffness / self.line.mean_mass

    @property
    def contact_duration(self) -> float:
        """For how long two particles that meet at the impact speed overlap, about; 0 if hard."""
        line = self.line
        if not line.soft:
            return 0.0
        return 3.0 * line.overlap(self.impact_velocity) / self.impact_velocity

    @property
    def span(self) -> int:
        """Particles of the longer body, which sound has to cross."""
        return max(self.particles, self.target_particles or 0)

    @property
    def frame_interval(self) -> float | None:
        """Time between the frames of a dump; None where its frames are those of contacts."""
        if isinstance(self.dump_frames, str):
            return None
        return self.span / self.slow_stiffness**0.5 / self.dump_frames

    @property
    def comes_moving(self) -> bool:
        """Whether particles come with velocities of their own, given or drawn."""
        state = self.initial_state
        return self.temperature is not None or (state is not None and state.velocities is not None)

    @property
    def all_particles(self) -> int:
        """Particles of both bodies."""
        return self.particles + (self.target_particles or 0)

    @cached_property
    def explicit(self) -> bool:
        """Whether the numerics are given, not to be chosen from a tolerance."""
        return any(getattr(self, key) is not None for key in NUMERICS_KEYS)

    @property
    def asked_tolerance(self) -> float | None:
        """Error asked of eta, the default one where none is given; None with explicit numerics."""
        return None if self.explicit else self.tolerance or DEFAULT_TOLERANCE

    def replace(self, **changes: Any) -> "Scene":
        """
        Return a copy with some fields changed, validated anew.

        Parameters
        ----------
        **changes
            Fields and their new values.

        Returns
        -------
        Scene
            The changed scene.
        """
        return Scene(**({k: getattr(self, k) for k in self.model_fields_set} | changes))

    def without(self, *names: str) -> "Scene":
        """
        Return a copy in which some fields are not given.

        Parameters
        ----------
        *names : str
            Fields.

        Returns
        -------
        Scene
            The rest, validated anew.
        """
        return Scene(**{k: getattr(self, k) for k in self.model_fields_set - set(names)})

    @classmethod
    def from_toml(cls, text: str, source: str = "scene") -> "Scene":
        """
        Read a scene from TOML text.

        Parameters
        ----------
        text : str
            Flat keys, as in ``particles = 100``.
        source : str
            What to call the text in an error.

        Returns
        -------
        Scene
            The validated scene.

        Raises
        ------
        SceneError
            If the text is not TOML or not a scene.
        """
        with mistakes_in(source):
            return cls(**parse_toml(text, source))

    @classmethod
    def from_file(cls, path: Path | str) -> "Scene":
        """
        Read a scene file.

        Parameters
        ----------
        path : pathlib.Path or str
            A TOML file. A relative `bond_file` in it is looked for beside it.

        Returns
        -------
        Scene
            The validated scene.

        Raises
        ------
        SceneError
            If the file cannot be read or is not a scene.
        """
        with mistakes_in(path):
            return cls(**read_scene_fields(path))

    def to_toml(self) -> str:
        """
        Write the scene as TOML that reads back to the same scene.

        Returns
        -------
        str
            The keys that were set.

        Raises
        ------
        SceneError
            If the potential is a Python object, which a file cannot hold.
        """
        if not isinstance(self.potential, str):
            raise SceneError(
                f"potential '{self.label}' is a Python object; expected a named potential or "
                "'table' with a bond_file to write the scene as TOML"
            )
        return tomli_w.dumps(plain_fields(self))

    @cached_property
    def canonical_fields(self) -> dict[str, Any]:
        """Everything that decides the result, in one way of many to write it (JSON-ready)."""
        return canonical_fields(self)

    @cached_property
    def canonical_json(self) -> str:
        """The same as JSON."""
        return canonical_json(self.canonical_fields)

    @cached_property
    def sha256(self) -> str:
        """Hash of everything that decides the result (not of where outputs are written)."""
        return hash_of(self.canonical_json)

    @cached_property
    def collision_sha256(self) -> str:
        """Hash of the same without the tolerance: one collision, however exactly it is asked."""
        fields = {k: v for k, v in self.canonical_fields.items() if k != "tolerance"}
        return hash_of(canonical_json(fields))
