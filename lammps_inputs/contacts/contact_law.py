"""What a contact law is: force, stiffness and energy of an overlap, and what LAMMPS runs for it."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array


class NoParameters(NamedTuple):
    """Parameters of a law that has none."""


class ContactLaw(ABC):
    r"""
    A repulsion of two bodies that overlap by :math:`d = -g`, where g < 0 is their gap.

    The force is positive where it drives the bodies apart, and zero for g > 0. Units are those of
    the chain.
    """

    name: ClassVar[str]  #: The name in scenes.
    soft: ClassVar[bool] = True  #: Whether bodies overlap while they touch.
    #: Keys in scenes, and the names of these parameters in the class.
    keys: ClassVar[dict[str, str]] = {}
    #: The key that scales the force; a smaller value makes a softer contact.
    strength_key: ClassVar[str] = ""
    #: ``f(gap, parameters)`` for compiled loops: the force, and its stiffness, which is -dF/dg.
    force_kernel: ClassVar[Callable]
    curvature_kernel: ClassVar[Callable]  #: See ``force_kernel``.
    #: The power of the overlap with which the force sets in, where no polynomial fits the force
    #: there; None where every derivative exists while bodies touch.
    onset: float | None = None

    @property
    def parameters(self) -> tuple[Any, ...]:
        """A NamedTuple for the kernels."""
        return NoParameters()

    @property
    def smooth(self) -> bool:
        """Whether the force has all derivatives while the bodies touch."""
        return self.onset is None

    def as_keys(self) -> dict[str, float]:
        """Return the parameters by their keys in scenes."""
        return {key: getattr(self, name) for key, name in self.keys.items()}

    @property
    def identity(self) -> Any:
        """What tells the law from others in a scene's hash; JSON-ready."""
        return [self.name, *self.as_keys().values()]

    @property
    def strength(self) -> float:
        """The factor of the force, which ``strength_key`` gives."""
        return float(self.as_keys()[self.strength_key])

    def force_per_strength(self, gaps: Array) -> Array:
        """Return the forces at gaps, divided by the strength: the derivative by the strength."""
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
        """Return the overlap that holds an energy."""

    def rate(self, energy: float, mass: float) -> float:
        """Return the stiffness over a mass where the overlap holds an energy: a frequency^2."""
        return self.curvature(-self.overlap(energy)) / mass

    @abstractmethod
    def lammps_force(self, overlap: str, force: float = 1.0, length: float = 1.0) -> str:
        """
        Return the force as a formula of LAMMPS.

        While bodies overlap, stages of a step may lie a little before or after. Where the law is
        smooth, its formula goes on there, and steps keep their order.

        Parameters
        ----------
        overlap : str
            Formula of the overlap, which may be negative, in parentheses.
        force, length : float
            The chain's units in those of the script.

        Returns
        -------
        str
            A formula that can be multiplied.
        """

    @property
    def description(self) -> str:
        """One line for people."""
        given = ", ".join(f"{name} {getattr(self, name):.6g}" for name in self.keys.values())
        return f"{self.name} contact" + (f": {given}" if given else "")


def lammps_number(value: float) -> str:
    """Format a number in the shortest decimal form that LAMMPS reads back to the same bits."""
    return repr(float(value))


def is_whole(power: float) -> bool:
    """Return whether a power is a whole number, so that it is a polynomial."""
    return math.isfinite(power) and float(power).is_integer()
