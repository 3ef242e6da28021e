"""Define the bonds with exponentials of the strain: Toda and Morse."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.functions import exp_less_one, expm1_minus_x, exponential
from chaincor.lammps_inputs.bonds.named_bond import LARGEST, SMALLEST, NamedBond, Strain
from chaincor.lammps_inputs.errors import PotentialError


class _Exponential(NamedBond):
    """Bond with an inverse length b as its only parameter, and U(s; b) = U(b s; 1)/b^2."""

    becomes_hard = True

    def __post_init__(self) -> None:
        """Refuse an inverse length that is not positive or has no finite positive square."""
        ((key, given),) = self.as_keys().items()
        if not SMALLEST <= given <= LARGEST:
            usual = type(self)().as_keys()[key]
            raise PotentialError(
                f"{key} is {given!r}. Give a positive number from {SMALLEST:g} to {LARGEST:g}, "
                f"such as {usual:g}"
            )

    def _find_compressed_strain(self) -> float | None:
        (given,) = self.as_keys().values()
        if given == 1.0:
            return super()._find_compressed_strain()
        root = type(self)(1.0)._find_compressed_strain()  # type: ignore[call-arg]
        return None if root is None else root / given


class TodaParameters(NamedTuple):
    """Steepness b."""

    b: float


def _toda_kernels(exp: Callable, expm1: Callable) -> tuple[Callable, Callable]:
    def toda_force(strain: Strain, parameters: TodaParameters) -> Strain:
        """Return (exp(-b s) - 1)/b."""
        return expm1(-parameters.b * strain) / parameters.b

    def toda_curvature(strain: Strain, parameters: TodaParameters) -> Strain:
        """Return exp(-b s)."""
        return exp(-parameters.b * strain)

    return toda_force, toda_curvature


@dataclass(frozen=True)
class Toda(_Exponential):
    """U = (exp(-b s) - 1 + b s)/b^2 with b > 0."""

    b: float = 10.0

    name = "toda"
    title = "Toda"
    keys: ClassVar = {"toda_b": "b"}
    parameters_type = TodaParameters
    force_kernel, curvature_kernel = map(staticmethod, _toda_kernels(exponential, exp_less_one))
    lammps_formula = "(exp(-{bond.b!r}*{s})-1.0+{bond.b!r}*{s})/({bond.b!r}*{bond.b!r})"

    def energy(self, strain: ArrayLike) -> Array:
        """Return (expm1(-b s) + b s)/b^2."""
        return expm1_minus_x(-self.b * np.asarray(strain, dtype=float)) / self.b**2


class MorseParameters(NamedTuple):
    """Inverse width a."""

    a: float


def _morse_kernels(exp: Callable, expm1: Callable) -> tuple[Callable, Callable]:
    def morse_force(strain: Strain, parameters: MorseParameters) -> Strain:
        """Return e (1 + e)/a with e = exp(-a s) - 1; squares of e remain finite."""
        e = expm1(np.minimum(-parameters.a * strain, 350.0))
        return e * (1.0 + e) / parameters.a

    def morse_curvature(strain: Strain, parameters: MorseParameters) -> Strain:
        """Return e (2 e - 1) with e = exp(-a s); squares of e remain finite."""
        e = exp(np.minimum(-parameters.a * strain, 350.0))
        return e * (2.0 * e - 1.0)

    return morse_force, morse_curvature


@dataclass(frozen=True)
class Morse(_Exponential):
    """U = (1 - exp(-a s))^2/(2 a^2) with a > 0; U is finite at zero length."""

    a: float = 6.0

    name = "morse"
    title = "Morse"
    keys: ClassVar = {"morse_a": "a"}
    parameters_type = MorseParameters
    force_kernel, curvature_kernel = map(staticmethod, _morse_kernels(exponential, exp_less_one))
    lammps_formula = "(1.0-exp(-{bond.a!r}*{s}))^2/(2.0*{bond.a!r}*{bond.a!r})"

    @property
    def dissociation(self) -> float:  # type: ignore[override]
        """The depth D = 1/(2 a^2)."""
        return 0.5 / self.a**2

    def energy(self, strain: ArrayLike) -> Array:
        """Return expm1(-a s)^2/(2 a^2)."""
        return np.square(np.expm1(-self.a * np.asarray(strain, dtype=float))) * self.dissociation

    @property
    def convex_strain(self) -> float:  # type: ignore[override]
        """The inflection, ln(2)/a."""
        return math.log(2.0) / self.a
