"""Scene: the validated and immutable description of one collision and of the wanted results."""

import warnings
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
import tomli_w
from pydantic import ValidationError, model_validator

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import BOND_KEYS, bond_of
from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_KEYS, contact_of
from chaincor.lammps_inputs.errors import SceneError, mistakes_in
from chaincor.lammps_inputs.initial_state import InitialState, read_initial_state
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.run_files import RunFiles
from chaincor.lammps_inputs.scene_parts.given_bodies import chain_masses, line_of
from chaincor.lammps_inputs.scene_parts.identity import DEFAULT_TOLERANCE as DEFAULT_TOLERANCE
from chaincor.lammps_inputs.scene_parts.identity import (
    canonical_fields,
    canonical_json,
    hash_of,
    plain_fields,
    shown_fields,
)
from chaincor.lammps_inputs.scene_parts.rules import check_together, scene_error
from chaincor.lammps_inputs.scene_parts.scene_fields import FILE_KEYS as FILE_KEYS
from chaincor.lammps_inputs.scene_parts.scene_fields import NUMERICS_KEYS as NUMERICS_KEYS
from chaincor.lammps_inputs.scene_parts.scene_fields import OUTPUT_KEYS as OUTPUT_KEYS
from chaincor.lammps_inputs.scene_parts.scene_fields import SceneFields
from chaincor.lammps_inputs.scene_parts.scene_file import read_from_anywhere, read_scene_fields
from chaincor.lammps_inputs.toml_text import parse_toml

DEFAULT_SPEED = 0.4  # units of v*
DEFAULT_HARMONIC_VELOCITY = 0.1
# Velocities from 1/_USUAL_VELOCITY to _USUAL_VELOCITY are valid for all standard chains.
_USUAL_VELOCITY = 1e120
# Properties that are computed once and do not depend on the speed.
_WITHOUT_SPEED = {"bond", "explicit"}


class Scene(SceneFields):
    """
    One collision of a chain with a wall.

    Lengths, masses and stiffnesses are in units of the natural bond length, the particle mass and
    the bond stiffness. Field names are the keys of a scene file and, with dashes, the options of
    ``chaincor run``.

    Raises
    ------
    SceneError
        If a field is wrong. The message has a line for each mistake, with the field, the given
        value and the expected values.

    Examples
    --------
    >>> from chaincor import Scene
    >>> print(Scene(potential="toda", particles=50).replace(speed=0.8).to_toml().strip())
    potential = "toda"
    particles = 50
    speed = 0.8
    """

    def __init__(self, **fields: Any) -> None:
        try:
            super().__init__(**fields)
        except ValidationError as error:
            raise scene_error(error, type(self).model_fields) from None

    @model_validator(mode="after")
    def _check_together(self) -> Self:
        check_together(self)
        return self

    def __repr_args__(self) -> Iterable[tuple[str, Any]]:
        """Yield the fields that determine the collision, and all other given fields."""
        yield from shown_fields(self).items()

    def __str__(self) -> str:
        return repr(self)

    @property
    def label(self) -> str:
        """Name of the potential in output."""
        return self.potential if isinstance(self.potential, str) else self.potential.name

    @cached_property
    def bond(self) -> Potential:
        """Potential of the bonds."""
        if isinstance(self.potential, Potential):
            return self.potential
        return bond_of(self.potential, self.bond_fields)

    @property
    def bond_fields(self) -> dict[str, Any]:
        """Parameters of the bonds that are given, by key."""
        given = {key: getattr(self, key) for key in BOND_KEYS}
        return {key: value for key, value in given.items() if value is not None}

    @property
    def impact_velocity(self) -> float:
        """v0 > 0 in absolute units; the chain's centre of mass arrives with the velocity -v0."""
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
        """Initial state of the chain from a file; None without a file."""
        return None if self.initial is None else read_initial_state(self.initial)

    @property
    def contact_law(self) -> ContactLaw:
        """Contact law of the bodies; by default, beads have the law of their bonds."""
        if self.contact is None and self.bond.contact is not None:
            return self.bond.contact
        return contact_of(self.contact, {key: getattr(self, key) for key in CONTACT_KEYS})

    @cached_property
    def line(self) -> Line:
        """Both bodies along x, with their initial state."""
        return line_of(self)

    @cached_property
    def problem(self) -> Problem:
        """Physics of the collision, for solvers."""
        state = self.initial_state
        moving = state is not None and state.velocities is not None
        return Problem(
            bond=self.bond,
            line=self.line,
            impact_velocity=self.impact_velocity,
            label=self.label,
            named=isinstance(self.potential, str),
            temperature=self.temperature,
            comes_moving=moving or self.temperature is not None,
        )

    @property
    def frame_interval(self) -> float | None:
        """Time between the frames of a dump; None if frames are written at contacts."""
        if isinstance(self.dump_frames, str):
            return None
        return self.problem.longest_body / self.problem.slow_stiffness**0.5 / self.dump_frames

    @property
    def run_files(self) -> RunFiles:
        """Files that a run in LAMMPS writes."""
        kept = self.save is not None and isinstance(self.potential, str)
        return RunFiles(
            dump=self.dump,
            frame_interval=self.frame_interval,
            save=self.save,
            scene=read_from_anywhere(self.without(*FILE_KEYS)).to_toml() if kept else None,
        )

    @cached_property
    def explicit(self) -> bool:
        """Whether the user gives the numerics instead of a tolerance."""
        return any(getattr(self, key) is not None for key in NUMERICS_KEYS)

    @property
    def asked_tolerance(self) -> float | None:
        """Tolerance of eta, given or by default; None with explicit numerics."""
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
        return Scene(**self._given(changes))

    def _given(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Return the given fields, with some changed."""
        return {k: getattr(self, k) for k in self.model_fields_set} | dict(changes)

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """
        Return a copy; changed fields are validated anew, as by `replace`.

        pydantic's own method would keep the problem and the hash of the original scene.
        """
        return super().model_copy(deep=deep) if not update else type(self)(**self._given(update))

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
            Scene with the remaining fields, validated anew.
        """
        return Scene(**{k: getattr(self, k) for k in self.model_fields_set - set(names)})

    def at_speed(self, key: str, value: Any) -> "Scene":
        """
        Return a copy with another impact speed.

        A standard chain keeps all parts that do not depend on its speed, because it takes ten times
        longer to construct and validate them anew.

        Parameters
        ----------
        key : str
            ``speed`` or ``velocity``, whichever was given.
        value : float
            New value.

        Returns
        -------
        Scene
            The changed scene.
        """
        usual = isinstance(value, float) and value > 0.0 and not self.explicit
        if not (usual and key in self.model_fields_set and self.line.is_standard):
            return self.replace(**{key: value})
        other = super().model_copy(update={key: value})
        velocity = other.impact_velocity
        if not 1.0 / _USUAL_VELOCITY < velocity < _USUAL_VELOCITY:
            return self.replace(**{key: value})
        known = vars(other)
        for name in known.keys() - type(self).model_fields.keys() - _WITHOUT_SPEED:
            del known[name]
        known["problem"] = self.problem.at_velocity(velocity)
        known["line"] = known["problem"].line
        known["canonical_fields"] = self.canonical_fields | {"velocity": velocity}
        return other

    @classmethod
    def from_toml(cls, text: str, source: str = "scene") -> "Scene":
        """
        Read a scene from TOML text.

        Parameters
        ----------
        text : str
            Flat keys, as in ``particles = 100``.
        source : str
            Name of the text in error messages.

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
            Path of a TOML file. A relative `bond_file` is relative to the folder of this file.

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
            TOML text with all keys that were given.

        Raises
        ------
        SceneError
            If the potential is a Python object, which a file cannot describe.
        """
        if not isinstance(self.potential, str):
            raise SceneError(
                f"potential '{self.label}' is a Python object. To write the scene as TOML, use "
                "a named potential or 'table' with a bond_file"
            )
        return tomli_w.dumps(plain_fields(self))

    @cached_property
    def canonical_fields(self) -> dict[str, Any]:
        """Fields that determine the result, in a canonical form for JSON."""
        return canonical_fields(self)

    @cached_property
    def canonical_json(self) -> str:
        """JSON text of the canonical fields."""
        return canonical_json(self.canonical_fields)

    @cached_property
    def sha256(self) -> str:
        """Hash of all fields that determine the result; paths of outputs are not included."""
        return hash_of(self.canonical_json)

    @cached_property
    def collision_sha256(self) -> str:
        """Hash of the scene without its tolerance."""
        fields = {k: v for k, v in self.canonical_fields.items() if k != "tolerance"}
        return hash_of(canonical_json(fields))


def _of_problem(name: str) -> property:
    """Return a deprecated attribute of a scene, which is now an attribute of its problem."""

    def read(scene: Scene) -> Any:
        said = f"Scene.{name} is deprecated. Use Scene.problem.{name}"
        warnings.warn(said, DeprecationWarning, stacklevel=2)
        return getattr(scene.problem, name)

    return property(read)


for _name in (
    *("slow_stiffness", "fast_stiffness", "longest_body", "all_particles"),
    *("start_energy", "contact_duration", "comes_moving"),
):
    setattr(Scene, _name, _of_problem(_name))
