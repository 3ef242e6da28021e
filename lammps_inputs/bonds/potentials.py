"""
Define the named bonds.

Bonds with exponentials are in ``exponential_bonds``. This module has the keys of all bonds in
scenes.

A bond is a class. Its formula for U is a method. The force -dU/dr and U'' are kernels: plain
functions for arrays and compiled loops. Kernels lose no digits by cancellation at small strains,
and use only arithmetic and functions that ``workflows.pictures.bond_script`` can print as
JavaScript. The command-line options, the form of the live page and the checks of an installation
are made from `BondKeys` and the class attributes.

A kernel uses only scalar functions that the compiler knows. Compiled loops require that the
functions which a kernel calls are in its closure. The qualified name of a kernel distinguishes its
compiled loops.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.exponential_bonds import Morse, Toda
from chaincor.lammps_inputs.bonds.functions import expm1_minus_x, x_minus_log1p
from chaincor.lammps_inputs.bonds.hertz import Hertz
from chaincor.lammps_inputs.bonds.named_bond import NamedBond, Strain
from chaincor.lammps_inputs.bonds.potential import LogLength, NoParameters, Potential
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.lammps_inputs.errors import meant
from chaincor.lammps_inputs.number_types import IsCount, IsNumber, Number, PositiveNumber


def harmonic_force(strain: Strain, _parameters: NoParameters) -> Strain:
    """Return -s."""
    return -strain


def harmonic_curvature(strain: Strain, _parameters: NoParameters) -> Strain:
    """Return 1."""
    return 1.0 + 0.0 * strain


@dataclass(frozen=True)
class Harmonic(NamedBond):
    """U = s^2/2."""

    name = "harmonic"
    title = "springs (harmonic)"
    is_harmonic = True
    anharmonic_order = None
    force_kernel = staticmethod(harmonic_force)
    curvature_kernel = staticmethod(harmonic_curvature)
    lammps_formula = "0.5*{s}*{s}"

    def energy(self, strain: ArrayLike) -> Array:
        """Return s^2/2."""
        return 0.5 * np.square(strain)

    def _find_compressed_strain(self) -> float | None:
        return None


def lj_force(strain: Strain, _parameters: NoParameters) -> Strain:
    """
    Return (r^-13 - r^-7)/6, written as a multiple of s, which is 0 at the natural length.

    With w = 1/r, w - 1 = -s w exactly and w^6 - 1 = (w - 1)(1 + w)(1 + w^2 + w^4), so the force is
    -s w^8 (1 + w)(1 + w^2 + w^4)/6, without cancellation.
    """
    w = 1.0 / (1.0 + strain)
    w2 = w * w
    w4 = w2 * w2
    return (strain * (1.0 + w) * (1.0 + w2 * (1.0 + w2))) * ((w4 * w4) * (-1.0 / 6.0))


def lj_curvature(strain: Strain, _parameters: NoParameters) -> Strain:
    """Return (13 r^-14 - 7 r^-8)/6."""
    w = 1.0 / (1.0 + strain)
    w2 = w * w
    w4 = w2 * w2
    return (w4 * w4) * (13.0 * (w4 * w2) - 7.0) * (1.0 / 6.0)


@dataclass(frozen=True)
class LennardJones(NamedBond):
    """U = (r^-6 - 1)^2/72, which is (r^-12 - 2 r^-6 + 1)/72."""

    name = "lj"
    title = "Lennard-Jones"
    force_kernel = staticmethod(lj_force)
    curvature_kernel = staticmethod(lj_curvature)
    lammps_formula = "(1.0-(1.0+{s})^-6)^2/72.0"
    becomes_hard = True
    strain_min = -1.0
    dissociation = 1.0 / 72.0
    convex_strain = (13.0 / 7.0) ** (1.0 / 6.0) - 1.0

    def energy(self, strain: ArrayLike) -> Array:
        """Return expm1(-6 log1p(s))^2/72."""
        return np.square(np.expm1(-6.0 * np.log1p(strain))) / 72.0


def log_force(strain: Strain, _parameters: NoParameters) -> Strain:
    """Return 1/r - 1 = -s/(1 + s)."""
    return -strain / (1.0 + strain)


def log_curvature(strain: Strain, _parameters: NoParameters) -> Strain:
    """Return r^-2."""
    w = 1.0 / (1.0 + strain)
    return w * w


def log_force_of_log_length(log_length: float, _parameters: NoParameters) -> tuple[float, float]:
    """Return 1/r - 1 and 1/r as exp(-y) - 1 and exp(-y) with y = ln r, exact at any length."""
    force = np.expm1(-log_length)
    return force, 1.0 + force


@dataclass(frozen=True)
class Logarithmic(NamedBond):
    """U = s - ln(1 + s)."""

    name = "log"
    title = "log"
    force_kernel = staticmethod(log_force)
    curvature_kernel = staticmethod(log_curvature)
    lammps_formula = "{s}-ln(1.0+{s})"
    becomes_hard = True
    strain_min = -1.0
    # With y = ln r, the energy is U = r - 1 - ln r = e^y - 1 - y.
    log_length = LogLength(log_force_of_log_length, expm1_minus_x)

    def energy(self, strain: ArrayLike) -> Array:
        """Return s - log1p(s)."""
        return x_minus_log1p(strain)


_CLASSES: tuple[type[NamedBond], ...] = (
    Harmonic,
    LennardJones,
    Toda,
    Morse,
    Logarithmic,
    Power,
    Hertz,
)
NAMED_POTENTIALS: dict[str, type[NamedBond]] = {cls.name: cls for cls in _CLASSES}
# Bonds with a force in tension. LAMMPS's bond styles, fixed steps and the live page support only
# these bonds.
CHAIN_POTENTIALS = {k: cls for k, cls in NAMED_POTENTIALS.items() if not cls.only_pushes}
POTENTIAL_NAMES = (*NAMED_POTENTIALS, "table", "formula")
# Keys in scenes that belong to only one kind of bond.
BOND_KEYS = {key: cls.name for cls in _CLASSES for key in cls.keys}
BOND_KEYS |= {"bond_file": "table", "energy": "formula", "parameters": "formula"}
WHOLE_KEYS = tuple(
    key for cls in _CLASSES for key, name in cls.keys.items() if cls.__annotations__[name] is int
)


def is_harmonic(name: str) -> bool:
    """Return whether the name is that of a harmonic bond."""
    return name in NAMED_POTENTIALS and NAMED_POTENTIALS[name].is_harmonic


def missing_keys(kind: str, given: Mapping[str, Any]) -> str:
    """Return the keys that a scene lacks for a kind of bond."""
    if kind in NAMED_POTENTIALS:
        needed = NAMED_POTENTIALS[kind].needed_keys()
    else:
        needed = ["bond_file" if kind == "table" else "energy"]
    if all(key in given for key in needed):
        return ""
    example = ', such as "D*(1-exp(-a*s))^2"' if needed == ["energy"] else ""
    return " and ".join(needed) + example


def bond_of(kind: str, given: Mapping[str, Any]) -> Potential:
    """Return the named kind of bond, with parameters from the keys of a scene."""
    if kind == "table":
        from chaincor.lammps_inputs.bonds.table_bond import read_bond_table

        return read_bond_table(given["bond_file"])
    if kind == "formula":
        from chaincor.lammps_inputs.bonds.formula import formula_bond

        return formula_bond(given["energy"], tuple(given.get("parameters", {}).items()))
    return named_bond(kind, **{key: given[key] for key in given if BOND_KEYS[key] == kind})


@cache
def named_bond(name: str, **given: Any) -> NamedBond:
    """Return a shared bond, because computing v* takes longer than making the rest of a scene."""
    cls = NAMED_POTENTIALS[name]
    return cls(**{cls.keys[key]: value for key, value in given.items()})


def _known(value: Any) -> Any:
    if isinstance(value, str) and value.lower() in POTENTIAL_NAMES:
        return value.lower()
    if isinstance(value, Potential):
        return value
    near = meant(value, POTENTIAL_NAMES) if isinstance(value, str) else None
    hint = "" if near is None else f"; did you mean {near!r}?"
    raise ValueError(f"expected one of {', '.join(POTENTIAL_NAMES)}{hint}")


class BondKeys(BaseModel):
    """
    Keys of a scene for its bonds.

    The form of the live page has a label, a default value and limits for each number. Limits are
    numbers, or JavaScript functions of the scene.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    potential: Annotated[str | Potential, BeforeValidator(_known)] = Field(
        default=LennardJones.name,
        description="bond potential; from Python also a Potential object",
    )
    toda_b: PositiveNumber | None = Field(
        default=None,
        description="steepness b of the toda bond [default: 10]",
        json_schema_extra={"form": ["Steepness b", 10, "[0.1, 100]"]},
    )
    morse_a: PositiveNumber | None = Field(
        default=None,
        description="inverse width a of the morse bond [default: 6]",
        json_schema_extra={"form": ["Inverse width a", 6, "[0.1, 100]"]},
    )
    power_order: Annotated[int, Field(ge=3, le=99), IsCount] | None = Field(
        default=None,
        description="order of the power bond's anharmonic term, 3 or more",
        json_schema_extra={"form": ["Order", 4, "[3, 20]"]},
    )
    power_c: Number | None = Field(
        default=None,
        description="coefficient of the power bond's anharmonic term: positive for even order, "
        "negative for odd order",
        json_schema_extra={
            "form": ["Coefficient c", 1, "scene.power_order % 2 ? [-1e3, -1e-3] : [1e-3, 1e3]"]
        },
    )
    hertz_exponent: Annotated[float, Field(gt=1, le=9), IsNumber] | None = Field(
        default=None,
        description="exponent p of the force d^p of hertz beads that overlap by d, above 1 "
        "[default: 1.5]",
    )
    damping: PositiveNumber | None = Field(
        default=None, description="factor A of the damping of hertz beads [default: none]"
    )
    damping_law: Literal["viscoelastic", "dashpot"] | None = Field(
        default=None,
        description="damping force of hertz beads: A d^(p-1) d', or A d' of a dashpot "
        "[default: viscoelastic]",
    )
