"""
The bonds that have names: everything that is particular to one of them is said here.

A bond is a class. Its formula for U is a method, those of the force -dU/dr and of U'' are kernels:
plain functions, which arrays and compiled loops share. They are written so that nothing cancels at
small strains, in arithmetic and functions that ``workflows.pictures.bond_script``
can print as JavaScript, too.
`BondKeys` holds what scenes say of bonds; options, form and doctor are made from it and from the
class attributes.

A kernel uses only what a compiler for scalars also knows. What it calls it closes over, as compiled
loops need it, and its qualified name tells its compiled loops from others.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any, ClassVar, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from chaincor.lammps_inputs.bonds.exponential import exp_less_one, exponential
from chaincor.lammps_inputs.bonds.potential import Array, LogLength, NoParameters, Potential
from chaincor.lammps_inputs.bonds.series import expm1_minus_x, x_minus_log1p
from chaincor.lammps_inputs.errors import PotentialError, meant
from chaincor.lammps_inputs.number_types import IsCount, Number, PositiveNumber

# Parameters whose squares and inverse squares floating point can hold.
_SMALLEST, _LARGEST = 1e-100, 1e100
Strain = TypeVar("Strain", float, Array)


class NamedBond(Potential):
    """
    A bond with a name.

    Attributes
    ----------
    title : str
        What people call it.
    keys : dict
        Keys in scenes, and what its class calls these parameters; those without default must be
        given.
    example : dict
        Parameters for a bond of this kind, by the names of its class, where it has no defaults.
    constants : dict
        Names that its kernel closes over, as formulas of the parameters.
    """

    smooth = True
    title: ClassVar[str]
    keys: ClassVar[dict[str, str]] = {}
    example: ClassVar[dict[str, Any]] = {}
    constants: ClassVar[dict[str, str]] = {}

    def as_keys(self) -> dict[str, Any]:
        """Return the parameters by their keys in scenes."""
        return {key: getattr(self, name) for key, name in self.keys.items()}

    @classmethod
    def needed_keys(cls) -> list[str]:
        """Return the keys of parameters that have no default."""
        return [key for key, name in cls.keys.items() if not hasattr(cls, name)]


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

    def energy(self, strain: ArrayLike) -> Array:
        """Return s^2/2."""
        return 0.5 * np.square(strain)

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"0.5*{strain}*{strain}"

    def _find_compressed_strain(self) -> float | None:
        return None


def lj_force(strain: Strain, _parameters: NoParameters) -> Strain:
    """
    Return (r^-13 - r^-7)/6 with the root at r = 1 divided out.

    With w = 1/r, w - 1 = -s w exactly and w^6 - 1 = (w - 1)(1 + w)(1 + w^2 + w^4), so that
    nothing cancels: the force is -s w^8 (1 + w)(1 + w^2 + w^4)/6.
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
    strain_min = -1.0
    dissociation = 1.0 / 72.0
    convex_strain = (13.0 / 7.0) ** (1.0 / 6.0) - 1.0

    def energy(self, strain: ArrayLike) -> Array:
        """Return expm1(-6 log1p(s))^2/72."""
        return np.square(np.expm1(-6.0 * np.log1p(strain))) / 72.0

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"(1.0-(1.0+{strain})^-6)^2/72.0"


class _Exponential(NamedBond):
    """A bond of one inverse length, on which U depends as U(s; b) = U(b s; 1)/b^2."""

    def __post_init__(self) -> None:
        """Refuse what is not a positive number, or whose square is none."""
        ((key, given),) = self.as_keys().items()
        if not _SMALLEST <= given <= _LARGEST:
            usual = type(self)().as_keys()[key]
            raise PotentialError(
                f"{key} is {given!r}; expected a positive number from {_SMALLEST:g} to "
                f"{_LARGEST:g}, such as {usual:g}"
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


def _toda_kernel(expm1: Callable) -> Callable:
    def toda_force(strain: Strain, parameters: TodaParameters) -> Strain:
        """Return (exp(-b s) - 1)/b."""
        return expm1(-parameters.b * strain) / parameters.b

    toda_force.__qualname__ = "toda_force"
    return toda_force


def _toda_curvature(exp: Callable) -> Callable:
    def toda_curvature(strain: Strain, parameters: TodaParameters) -> Strain:
        """Return exp(-b s)."""
        return exp(-parameters.b * strain)

    toda_curvature.__qualname__ = "toda_curvature"
    return toda_curvature


@dataclass(frozen=True)
class Toda(_Exponential):
    """U = (exp(-b s) - 1 + b s)/b^2 with b > 0."""

    b: float = 10.0

    name = "toda"
    title = "Toda"
    keys: ClassVar = {"toda_b": "b"}
    force_kernel = staticmethod(_toda_kernel(exp_less_one))
    curvature_kernel = staticmethod(_toda_curvature(exponential))

    @property
    def parameters(self) -> TodaParameters:
        """Of the kernel: b."""
        return TodaParameters(float(self.b))

    def energy(self, strain: ArrayLike) -> Array:
        """Return (expm1(-b s) + b s)/b^2."""
        return expm1_minus_x(-self.b * np.asarray(strain, dtype=float)) / self.b**2

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"(exp(-{self.b!r}*{strain})-1.0+{self.b!r}*{strain})/{self.b**2!r}"


class MorseParameters(NamedTuple):
    """Inverse width a."""

    a: float


def _morse_kernel(expm1: Callable) -> Callable:
    def morse_force(strain: Strain, parameters: MorseParameters) -> Strain:
        """Return e (1 + e)/a with e = exp(-a s) - 1, of which squares stay finite."""
        e = expm1(np.minimum(-parameters.a * strain, 350.0))
        return e * (1.0 + e) / parameters.a

    morse_force.__qualname__ = "morse_force"
    return morse_force


def _morse_curvature(exp: Callable) -> Callable:
    def morse_curvature(strain: Strain, parameters: MorseParameters) -> Strain:
        """Return e (2 e - 1) with e = exp(-a s), of which squares stay finite."""
        e = exp(np.minimum(-parameters.a * strain, 350.0))
        return e * (2.0 * e - 1.0)

    morse_curvature.__qualname__ = "morse_curvature"
    return morse_curvature


@dataclass(frozen=True)
class Morse(_Exponential):
    """U = (1 - exp(-a s))^2/(2 a^2) with a > 0; at zero length it is finite."""

    a: float = 6.0

    name = "morse"
    title = "Morse"
    keys: ClassVar = {"morse_a": "a"}
    force_kernel = staticmethod(_morse_kernel(exp_less_one))
    curvature_kernel = staticmethod(_morse_curvature(exponential))

    @property
    def parameters(self) -> MorseParameters:
        """Of the kernel: a."""
        return MorseParameters(float(self.a))

    @property
    def dissociation(self) -> float:  # type: ignore[override]
        """The depth D = 1/(2 a^2)."""
        return 0.5 / self.a**2

    def energy(self, strain: ArrayLike) -> Array:
        """Return expm1(-a s)^2/(2 a^2)."""
        return np.square(np.expm1(-self.a * np.asarray(strain, dtype=float))) * self.dissociation

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"(1.0-exp(-{self.a!r}*{strain}))^2/{2.0 * self.a**2!r}"

    @property
    def convex_strain(self) -> float:
        """The inflection, ln(2)/a."""
        return math.log(2.0) / self.a


def log_force(strain: Strain, _parameters: NoParameters) -> Strain:
    """Return 1/r - 1 = -s/(1 + s)."""
    return -strain / (1.0 + strain)


def log_curvature(strain: Strain, _parameters: NoParameters) -> Strain:
    """Return r^-2."""
    w = 1.0 / (1.0 + strain)
    return w * w


def log_force_of_log_length(log_length: float, _parameters: NoParameters) -> tuple[float, float]:
    """Return 1/r - 1 and 1/r at ln r, exact at any length: exp(-y) - 1 and exp(-y)."""
    force = np.expm1(-log_length)
    return force, 1.0 + force


@dataclass(frozen=True)
class Logarithmic(NamedBond):
    """U = s - ln(1 + s)."""

    name = "log"
    title = "log"
    force_kernel = staticmethod(log_force)
    curvature_kernel = staticmethod(log_curvature)
    strain_min = -1.0

    @property
    def log_length(self) -> LogLength:
        """U = r - 1 - ln r = e^y - 1 - y at y = ln r."""
        return LogLength(log_force_of_log_length, expm1_minus_x)

    def energy(self, strain: ArrayLike) -> Array:
        """Return s - log1p(s)."""
        return x_minus_log1p(strain)

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"{strain}-ln(1.0+{strain})"


class PowerParameters(NamedTuple):
    """Coefficient c of the anharmonic term; its order is the kernel's own."""

    c: float


@cache
def power_force(order: int) -> Callable:
    """
    Return the kernel -s - order c s^(order - 1) for one order.

    To a compiler the order is then a constant, and the power a few multiplications.

    Parameters
    ----------
    order : int
        Order of the anharmonic term, 3 or more.

    Returns
    -------
    callable
        ``kernel(strain, parameters)``.
    """
    exponent = order - 2

    def kernel(strain: Strain, parameters: PowerParameters) -> Strain:
        return -strain * (1.0 + order * parameters.c * strain**exponent)

    kernel.__qualname__ = f"power{order}_force"
    return kernel


@cache
def power_curvature(order: int) -> Callable:
    """Return the kernel 1 + order (order - 1) c s^(order - 2) for one order."""
    exponent = order - 2
    factor = order * (order - 1)

    def kernel(strain: Strain, parameters: PowerParameters) -> Strain:
        return 1.0 + factor * parameters.c * strain**exponent

    kernel.__qualname__ = f"power{order}_curvature"
    return kernel


@dataclass(frozen=True)
class Power(NamedBond):
    """U = s^2/2 + c s^order; c > 0 for even order, c < 0 for odd order."""

    order: int
    c: float

    name = "power"
    title = "power"
    keys: ClassVar = {"power_order": "order", "power_c": "c"}
    example: ClassVar = {"order": 4, "c": 1.0}
    constants: ClassVar = {"exponent": "order - 2", "factor": "order * (order - 1)"}

    def __post_init__(self) -> None:
        """Refuse orders below 3 and the sign of c that softens compression."""
        if self.order < 3:
            raise PotentialError(f"power_order is {self.order}; expected an integer of 3 or more")
        sign, word = (1, "positive") if self.order % 2 == 0 else (-1, "negative")
        if not _SMALLEST <= self.c * sign <= _LARGEST:
            raise PotentialError(
                f"power_c is {self.c!r}; order {self.order} needs a {word} number, such as "
                f"{sign}.0, so that compression stiffens the bond (and from {_SMALLEST:g} to "
                f"{_LARGEST:g} in size)"
            )

    @property
    def force_kernel(self) -> Callable:
        """The kernel of this order."""
        return power_force(int(self.order))

    @property
    def curvature_kernel(self) -> Callable:
        """The same of U''."""
        return power_curvature(int(self.order))

    @property
    def parameters(self) -> PowerParameters:
        """Of the kernel, which knows the order: c."""
        return PowerParameters(float(self.c))

    @property
    def anharmonic_order(self) -> int | None:
        """The order itself."""
        return self.order

    def energy(self, strain: ArrayLike) -> Array:
        """Return s^2 (1/2 + c s^(order - 2))."""
        s = np.asarray(strain, dtype=float)
        return s * s * (0.5 + self.c * s ** (self.order - 2))

    def lammps_energy(self, strain: str) -> str:
        """Return the formula of U."""
        return f"{strain}*{strain}*(0.5+({self.c!r})*{strain}^{self.order - 2})"

    @property
    def convex_strain(self) -> float:
        """Odd orders soften when stretched: U'' = 0 here."""
        if self.order % 2 == 0:
            return math.inf
        return (-self.order * (self.order - 1) * self.c) ** (-1.0 / (self.order - 2))

    @property
    def barrier_strain(self) -> float:
        """Strain at which a stretched bond of odd order is pulled no further back: U' = 0."""
        if self.order % 2 == 0:
            return math.inf
        return (-self.order * self.c) ** (-1.0 / (self.order - 2))

    def _find_compressed_strain(self) -> float | None:
        """Solve |c| |s|^(order - 2) = 1/2 in closed form."""
        return -((2.0 * abs(self.c)) ** (-1.0 / (self.order - 2)))


_CLASSES: tuple[type[NamedBond], ...] = (Harmonic, LennardJones, Toda, Morse, Logarithmic, Power)
NAMED_POTENTIALS: dict[str, type[NamedBond]] = {cls.name: cls for cls in _CLASSES}
POTENTIAL_NAMES = (*NAMED_POTENTIALS, "table", "formula")
# What only bonds of one name have.
BOND_KEYS = {key: cls.name for cls in _CLASSES for key in cls.keys}
WHOLE_KEYS = tuple(
    key for cls in _CLASSES for key, name in cls.keys.items() if cls.__annotations__[name] is int
)


def is_harmonic(name: str) -> bool:
    """Return whether bonds of a name are springs."""
    return name in NAMED_POTENTIALS and NAMED_POTENTIALS[name].is_harmonic


@cache
def named_bond(name: str, **given: Any) -> NamedBond:
    """Return a shared bond: finding v* takes longer than the rest of making a scene."""
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
    What a scene says of its bonds by name.

    Beside a number the form of the live page is told how to call it, what is usual, and between
    which limits it lies there: numbers, or a function of the scene, in JavaScript.
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
        description="its coefficient: positive for even order, negative for odd",
        json_schema_extra={
            "form": ["Coefficient c", 1, "scene.power_order % 2 ? [-1e3, -1e-3] : [1e-3, 1e3]"]
        },
    )
