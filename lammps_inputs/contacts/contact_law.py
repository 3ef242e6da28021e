"""Base class of contact laws: force, stiffness and energy of an overlap, and a LAMMPS formula."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import SceneError


class NoParameters(NamedTuple):
    """Empty parameters."""


class ContactLaw(ABC):
    r"""
    Repulsion of two bodies that overlap by :math:`d = -g`, with the gap g < 0.

    The force is zero for g > 0, and positive if it drives the bodies apart. All quantities are in
    the chain's units.
    """

    name: ClassVar[str]  #: Name of the law in scenes.
    summary: ClassVar[str]  #: Phrase for the help of scenes: the bodies and their force.
    soft: ClassVar[bool] = True  #: Whether bodies overlap while they touch.
    #: Keys of the parameters in scenes, with the names of the attributes.
    keys: ClassVar[dict[str, str]] = {}
    #: Key of the factor of the force. A smaller factor makes the contact softer.
    strength_key: ClassVar[str] = ""
    #: Whether the hash of a scene contains the name of the law. One law is hashed without its name,
    #: because old results stores have such hashes.
    named_in_identity: ClassVar[bool] = True
    force_kernel: ClassVar[Callable]  #: Force ``f(gap, parameters)`` for compiled loops.
    curvature_kernel: ClassVar[Callable]  #: Stiffness -dF/dg as ``f(gap, parameters)``.
    #: Damping c as ``f(gap, parameters)``: the force is F - c dg/dt, but not less than 0. It is
    #: None without damping. LAMMPS has no damped contact of chains.
    drag_kernel: ClassVar[Callable | None] = None
    #: Exponent of the force at small overlaps if it is not a whole number; None if the force has
    #: all derivatives while the bodies touch.
    onset: float | None = None

    @property
    def parameters(self) -> tuple[Any, ...]:
        """Parameters of the kernels, as a NamedTuple."""
        return NoParameters()

    @property
    def smooth(self) -> bool:
        """Whether the force has all derivatives while the bodies touch."""
        return self.onset is None and not self.damped

    @property
    def damped(self) -> bool:
        """Whether the force depends on the rate of change of the gap."""
        return self.drag_kernel is not None

    @property
    def is_hertzian(self) -> bool:
        """Whether the force is K d^(3/2), as in LAMMPS's granular styles."""
        return False

    def as_keys(self) -> dict[str, float]:
        """Return the parameters by their keys in scenes."""
        return {key: getattr(self, name) for key, name in self.keys.items()}

    @property
    def identity(self) -> Any:
        """Name and parameters of the law for the hash of a scene, as JSON."""
        name = [self.name] if self.named_in_identity else []
        return [*name, *self.as_keys().values()]

    @classmethod
    def place_in_identity(cls, key: str) -> int:
        """Return the position of a parameter in `identity`."""
        return list(cls.keys).index(key) + cls.named_in_identity

    @property
    def strength(self) -> float:
        """Factor of the force, which is the parameter named by ``strength_key``."""
        return float(self.as_keys()[self.strength_key])

    def force_per_strength(self, gaps: Array) -> Array:
        """Return the derivative of forces with respect to the strength."""
        found = np.zeros(gaps.shape)
        found[gaps < 0.0] = [self.force(gap) / self.strength for gap in gaps[gaps < 0.0].tolist()]
        return found

    def force(self, gap: float) -> float:
        """Return the force at a gap."""
        return float(type(self).force_kernel(gap, self.parameters))

    def curvature(self, gap: float) -> float:
        """Return the stiffness -dF/dg at a gap."""
        return float(type(self).curvature_kernel(gap, self.parameters))

    @abstractmethod
    def energy(self, overlap: float) -> float:
        """Return the energy of an overlap d >= 0."""

    @abstractmethod
    def overlap(self, energy: float) -> float:
        """Return the overlap d >= 0 at which the energy has a given value."""

    def rate(self, energy: float, mass: float) -> float:
        """Return stiffness/mass, a squared frequency, at the overlap with a given energy."""
        return self.curvature(-self.overlap(energy)) / mass

    def lammps_force(self, overlap: str, force: float = 1.0, length: float = 1.0) -> str:
        """
        Return the force as a formula of LAMMPS.

        Stages of a step may be slightly outside the contact, with a negative overlap. The formula
        of a smooth law is also used there, because steps would otherwise lose their order.

        Parameters
        ----------
        overlap : str
            Formula of the overlap, which may be negative, in parentheses.
        force, length : float
            The chain's units of force and length, in units of the script.

        Returns
        -------
        str
            A formula that can be a factor of a product.

        Raises
        ------
        SceneError
            If LAMMPS cannot compute the law.
        """
        raise SceneError(f"LAMMPS has no contact {self.name!r}. Set engine to 'reference'")

    def between_spheres(self, diameter: float) -> "ContactLaw":
        """Return the law between the wall and a sphere with a diameter other than 1."""
        if not self.soft:
            return self
        stiffer = dict(self.as_keys())
        stiffer[self.strength_key] *= diameter**0.5
        return type(self)(**{self.keys[key]: value for key, value in stiffer.items()})

    @property
    def description(self) -> str:
        """Description of the law in one line."""
        given = ", ".join(f"{name} {getattr(self, name):.6g}" for name in self.keys.values())
        return f"{self.name} contact" + (f": {given}" if given else "")

    @property
    def shape(self) -> str:
        """Name of the law, with all parameters except its strength."""
        rest = [f"{k} {v:g}" for k, v in self.as_keys().items() if k != self.strength_key]
        return ", ".join([repr(self.name), *rest])


def lammps_number(value: float) -> str:
    """Format a number in the shortest decimal form that LAMMPS reads back to the same bits."""
    return repr(float(value))


def is_whole(power: float) -> bool:
    """Return whether a power is a whole number."""
    return math.isfinite(power) and float(power).is_integer()
