"""Units in LAMMPS's styles, in which natural length, mass and stiffness are not 1."""

import math
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import tomli_w

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.small_file import read_small_file, why_unreadable
from chaincor.lammps_inputs.toml_text import parse_toml

# Factor from mass times velocity squared to energy, in the units of a style; LAMMPS calls it mvv2e
# (update.cpp). The units are eV, g/mol and Angstrom/ps for metal, and kcal/mol, g/mol and
# Angstrom/fs for real.
_ENERGY_OF_MOTION = {"metal": 1.0364269e-4, "real": 48.88821291**2, "si": 1.0, "lj": 1.0}
UNITS_FILE = "units.toml"
_DERIVED = ("time", "speed", "energy")
_LARGEST = 1e100


@dataclass(frozen=True)
class UnitSystem:
    """Units of the chain, expressed in the units of a LAMMPS style."""

    length: float = 1.0  #: Natural length of a bond.
    mass: float = 1.0  #: Mass of a particle.
    stiffness: float = (
        1.0  #: U'' of a bond at its natural length, an energy divided by a squared length.
    )
    style: str = "lj"  #: LAMMPS style: ``metal``, ``real``, ``si`` or ``lj``.

    @classmethod
    def from_fields(cls, fields: Any) -> "UnitSystem":
        """Return the units in a table ``[units]``; raise SceneError for a faulty table."""
        keys = ("length", "mass", "stiffness", "style")
        given = set(fields) if isinstance(fields, dict) else set()
        if given != set(keys):
            wrong = [f"no {key}" for key in keys if key not in given]
            wrong += [f"{key[:40]!a}, which it does not know" for key in sorted(given - set(keys))]
            raise SceneError(
                f"units has {' and '.join(wrong)}. Give a table [units] with length, mass, "
                "stiffness and style, each once"
            )
        style = fields["style"]
        if not isinstance(style, str) or style not in _ENERGY_OF_MOTION:
            raise SceneError(f"units.style is {str(style)[:40]!a}. Use metal, real, si or lj")
        for key in keys[:3]:
            value = fields[key]
            is_number = isinstance(value, int | float) and not isinstance(value, bool)
            # A whole number may be too large for a float.
            if not (is_number and 0.0 < value <= sys.float_info.max):
                raise SceneError(f"units.{key} is {str(value)[:40]!a}. Give a positive number")
        found = cls(**{key: float(fields[key]) for key in keys[:3]}, style=style)
        derived = (*_DERIVED, "force")
        for name in (*keys[:3], *derived):
            try:
                scale = getattr(found, name)
            except ArithmeticError:
                scale = math.nan
            if not 1.0 / _LARGEST <= scale <= _LARGEST:
                own = f"units.{name}" if name in keys else f"the unit of {name} of [units]"
                raise SceneError(
                    f"{own} is {scale:g} in units of style {style}. Give units between "
                    f"{1.0 / _LARGEST:g} and {_LARGEST:g}, so that squares and products stay finite"
                )
        return found

    @classmethod
    def from_file(cls, path: Path) -> "UnitSystem":
        """Read the table ``[units]`` of a TOML file; return the chain's units without a table."""
        try:
            fields = parse_toml(read_small_file(path), str(path))
        except (OSError, ValueError) as error:  # text that is not UTF-8 raises ValueError
            raise SceneError(
                f"{str(path)!a} cannot be read: {why_unreadable(error)}. Give a TOML file"
            ) from None
        if "units" in fields:
            return cls.from_fields(fields["units"])
        if path.name == UNITS_FILE:
            raise SceneError(
                f"{str(path)!a} has no table [units]. Add [units] with length, mass, stiffness "
                "and style"
            )
        return cls()

    @property
    def force_to_acceleration(self) -> float:
        """Factor from force/mass to acceleration in units of the style; LAMMPS calls it ftm2v."""
        return 1.0 / _ENERGY_OF_MOTION[self.style]

    @property
    def time(self) -> float:
        """The chain's unit of time, sqrt(mass/stiffness)."""
        return math.sqrt(_ENERGY_OF_MOTION[self.style] * self.mass / self.stiffness)

    @property
    def speed(self) -> float:
        """The chain's unit of speed."""
        return self.length / self.time

    @property
    def energy(self) -> float:
        """The chain's unit of energy."""
        return self.stiffness * self.length**2

    @property
    def force(self) -> float:
        """The chain's unit of force."""
        return self.stiffness * self.length

    def to_dict(self) -> dict[str, Any]:
        """Return the units for JSON, including the units of time, speed and energy."""
        derived = {name: getattr(self, name) for name in _DERIVED}
        return asdict(self) | derived

    def to_toml(self) -> str:
        """Return the text of a job's file ``units.toml``."""
        return tomli_w.dumps({"units": asdict(self)})


CHAIN_UNITS = UnitSystem()
