"""Where the bodies meet: how near they are, and what a contact does to them."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

from chaincor.lammps_inputs.contact_script import contact_force, contact_force_off, contact_force_on
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.scene import Scene

if TYPE_CHECKING:
    from chaincor.workflows.engines.lammps.instance import LammpsChain


# How long steps are graded for, in units of 1/frequency of the fastest bond.
_ZONE = 1.0


@dataclass(frozen=True)
class Contact:
    """One contact of particle 1 with the target."""

    time: float  #: Time since the first contact; of soft bodies, when they touched.
    speed: float  #: Speed of approach then, positive.
    impulse: float  #: Momentum that the chain was given.
    end: float  #: When the bodies parted: the same time where they are hard.


class Meeting(ABC):
    """
    The contact of two bodies, as a distance whose fall through zero is an event.

    Parameters
    ----------
    chain : LammpsChain
        The bodies in LAMMPS.
    line : Line
        Their masses.

    Attributes
    ----------
    touching : bool
        Whether soft bodies overlap.
    reduced_mass : float
        Of the two particles that meet.
    """

    touching = False

    def __init__(self, chain: "LammpsChain", line: Line) -> None:
        self.chain, self.line = chain, line
        self.reduced_mass = line.contact_mass
        self._mass = float(line.chain_masses[0])
        # Of the target's first particle: where it is, and its mass.
        self._place = None if line.rigid else len(line.chain_masses)
        self._target_mass = float(line.masses[line.gap])

    @abstractmethod
    def state(self) -> list[float]:
        """Return the distance to the next event, its rate of change, and that of the rate."""

    @abstractmethod
    def arrive(self, time: float) -> Contact | None:
        """
        Carry the event out, of which the bodies are within rounding.

        None where no contact comes to its end with it.
        """

    def step(self, time: float, state: list[float]) -> float:
        """Return how long the next composed step may be, from a state at a time."""
        return self.chain.timestep

    def reset(self) -> None:  # noqa: B027 - hard bodies have nothing to forget
        """Forget an event that was carried out, for a start from a state before it."""

    def _gap(self) -> list[float]:
        """Return the distance of the bodies, its rate of change, and that of the rate."""
        x, v, f = self.chain.x, self.chain.v, self.chain.f
        gap, opening, acceleration = float(x[0]), float(v[0]), float(f[0]) / self._mass
        if self._place is not None:
            gap -= float(x[self._place])
            opening -= float(v[self._place])
            acceleration -= float(f[self._place]) / self._target_mass
        return [gap, opening, acceleration]

    def _close(self) -> None:
        """Put particle 1 where the target's first is: they are within rounding of it."""
        x = self.chain.x
        x[0] = 0.0 if self._place is None else x[self._place]


class HardBodies(Meeting):
    """Bodies that exchange the momentum 2 mu w, mu the reduced mass of the two that meet."""

    def state(self) -> list[float]:
        """Return the distance of the bodies and its rates."""
        return self._gap()

    def arrive(self, time: float) -> Contact | None:
        """Reverse the relative velocity of the two that meet, where they approach."""
        speed = -self._gap()[1]
        self._close()
        if speed <= 0.0:
            return None
        v = self.chain.v
        impulse = 2.0 * self.reduced_mass * speed
        if self._place is None:
            v[0] = speed
        else:
            v[0] += impulse / self._mass
            v[self._place] -= impulse / self._target_mass
        return Contact(time, speed, impulse, time)


class SoftBodies(Meeting):
    r"""
    Bodies that repel with :math:`K d^q` while they overlap by d.

    There are two events: the bodies touch, and they part. LAMMPS has the force between them only,
    by ``fix addforce``: no step reaches across the kink of the force at either event, where its
    order would be lost.

    Where q is no whole number, no polynomial fits the force at these events. Composed steps are
    graded there: the time t from one, or to one, is divided at :math:`\tau (k/m)^g`, so that the
    steps' errors, :math:`h^p t^{q+1-p}` each, sum up to one of order p in 1/m. Without it the order
    would be q + 1, whatever that of the scheme.

    Parameters
    ----------
    chain : LammpsChain
        The bodies.
    scene : Scene
        Their masses, the force between them, and their bonds.
    order : int
        Order p of the steps.
    """

    def __init__(self, chain: "LammpsChain", scene: Scene, order: int) -> None:
        line = scene.line
        super().__init__(chain, line)
        self._graded = grading(scene, order)
        self._began = (0.0, 0.0, 0.0)
        chain.commands("\n".join(contact_force(line)))

    def state(self) -> list[float]:
        """Return the distance of the bodies and its rates; while they touch, their overlap's."""
        gap = self._gap()
        return [-each for each in gap] if self.touching else gap

    def step(self, time: float, state: list[float]) -> float:
        """Return the step H, or less where soft bodies have just touched or are about to part."""
        step = self.chain.timestep
        if not self.touching or self._graded is None:
            return step
        zone, power = self._graded
        cells = math.ceil(power * zone / step)
        passed = max(time - self._began[0], 0.0)
        if passed < zone:
            cell = cells * (passed / zone) ** (1.0 / power) + 1.0
            step = min(step, zone * (cell / cells) ** power - passed)
        left = time_to_zero(*state)
        if left < zone:
            cell = max(cells * (left / zone) ** (1.0 / power) - 1.0, 0.0)
            last = zone * (1.0 / cells) ** power
            step = min(step, max(left - zone * (cell / cells) ** power, last))
        return step

    def _momentum(self) -> float:
        """Return the momentum along x that contacts give: the target's, taken negative."""
        v, n = self.chain.v, len(self.line.chain_masses)
        if self._place is None:
            return float(self.line.chain_masses @ v)
        return -float(self.line.target_masses @ v[n:])

    def arrive(self, time: float) -> Contact | None:
        """Let the force begin where the bodies come to touch, and end where they part."""
        speed = -self.state()[1]
        self._close()
        if speed <= 0.0:
            return None
        if not self.touching:
            self._began = (time, speed, self._momentum())
            self._switch(True)
            return None
        self._switch(False)
        touched, speed, before = self._began
        return Contact(touched, speed, self._momentum() - before, time)

    def reset(self) -> None:
        """Take the force away that the event began."""
        if self.touching:
            self._switch(False)

    def _switch(self, on: bool) -> None:
        self.touching = on
        commands = contact_force_on(self.line) if on else contact_force_off(self.line)
        # A run of no steps makes the change known, and computes the forces.
        self.chain.commands("\n".join([*commands, "run 0 post no"]))


def grading(scene: Scene, order: int) -> tuple[float, float] | None:
    """
    Return for how long, and with which power g, steps of an order are graded where bodies touch.

    None where they are not: for hard bodies, and where the force is a polynomial.
    """
    line = scene.line
    if not line.soft or line.contact_exponent.is_integer():
        return None
    return _ZONE / scene.fast_stiffness**0.5, max(1.0, order / (line.contact_exponent + 1.0))


def time_to_zero(distance: float, rate: float, acceleration: float) -> float:
    """
    Return when x + v t + a t^2/2 falls to zero; inf where it does not.

    It is the root in which nothing cancels, also where v is positive and the fall comes after.
    """
    square = rate * rate - 2.0 * distance * acceleration
    if square < 0.0 or (rate >= 0.0 and acceleration >= 0.0):
        return math.inf
    root = math.sqrt(square)
    return 2.0 * distance / (root - rate) if rate < 0.0 else -(rate + root) / acceleration


def meeting_of(chain: "LammpsChain", scene: Scene, order: int) -> Meeting:
    """Return how the bodies of a scene meet, in steps of some order."""
    return SoftBodies(chain, scene, order) if scene.line.soft else HardBodies(chain, scene.line)
