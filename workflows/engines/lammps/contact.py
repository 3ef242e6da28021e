"""Where the bodies meet: how near they are, and what a contact does to them."""

import math
from dataclasses import dataclass

import numpy as np

from chaincor.lammps_inputs.chain_data import initial_state
from chaincor.lammps_inputs.contact_script import contact_force, contact_force_off, contact_force_on
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.contact_search import PathPoint
from chaincor.workflows.engines.lammps.instance import LammpsChain

# So much more is waited than bodies can take to meet.
_LATEST = 1.1
# How long steps are graded for, in units of 1/frequency of the fastest bond.
_ZONE = 1.0


@dataclass(frozen=True)
class Contact:
    """One contact of particle 1 with the target."""

    time: float  #: Time since the first contact; of soft bodies, when they touched.
    speed: float  #: Speed of approach then, positive.
    impulse: float  #: Momentum that the chain was given.
    end: float  #: When the bodies parted: the same time where they are hard.


class Meeting:
    """
    The contact of two bodies, as a distance whose fall through zero is an event.

    These are hard: they exchange the momentum 2 mu w, mu the reduced mass of the two particles that
    meet.
    """

    touching = False  #: Whether soft bodies overlap.

    def __init__(self, chain: LammpsChain, line: Line) -> None:
        self.chain, self.line = chain, line
        self.reduced_mass = line.contact_mass
        self._mass = float(line.chain_masses[0])
        # Of the target's first particle: where it is, and its mass.
        self._place = None if line.rigid else len(line.chain_masses)
        self._target_mass = float(line.masses[line.gap])

    def state(self) -> PathPoint:
        """Return the distance to the next event, its rate of change, and that of the rate."""
        x, v, f = self.chain.x, self.chain.v, self.chain.f
        gap, opening, acceleration = float(x[0]), float(v[0]), float(f[0]) / self._mass
        if self._place is not None:
            gap -= float(x[self._place])
            opening -= float(v[self._place])
            acceleration -= float(f[self._place]) / self._target_mass
        return gap, opening, acceleration

    def arrive(self, time: float) -> Contact | None:
        """
        Carry the event out, of which the bodies are within rounding.

        None where no contact comes to its end with it.
        """
        speed = self._close()
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

    def step(self, time: float, state: PathPoint) -> float:
        """Return how long the next composed step may be, from a state at a time."""
        return self.chain.timestep

    def reset(self) -> None:
        """Forget an event that was carried out, for a start from a state before it."""

    def _close(self) -> float:
        """Put particle 1 where the target's first is, within rounding; return how fast it comes."""
        x = self.chain.x
        x[0] = 0.0 if self._place is None else x[self._place]
        return -self.state()[1]


class SoftMeeting(Meeting):
    r"""
    The contact of bodies that repel with :math:`K d^q` while they overlap by d.

    There are two events: the bodies touch, and they part. LAMMPS has the force between them only,
    by ``fix addforce``: no step reaches across the kink of the force at either event, where its
    order would be lost.

    Where the force sets in as a power q that is no whole number, no polynomial fits the force.
    Composed steps are graded there: the time t from one, or to one, is divided at :math:`\tau
    (k/m)^g`, so that the errors of steps of order p, :math:`h^p t^{q+1-p}` each, sum up to one of
    order p in 1/m. Without it the order would be q + 1, whatever that of the scheme.
    """

    def __init__(self, chain: LammpsChain, scene: Scene, order: int) -> None:
        super().__init__(chain, scene.line)
        self._graded = grading(scene, order)
        self._began = (0.0, 0.0, 0.0)
        chain.commands("\n".join(contact_force(scene.line)))

    def state(self) -> PathPoint:
        """Return the distance of the bodies and its rates; while they touch, their overlap's."""
        gap, opening, acceleration = super().state()
        sign = -1.0 if self.touching else 1.0
        return sign * gap, sign * opening, sign * acceleration

    def step(self, time: float, state: PathPoint) -> float:
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
        speed = self._close()
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
    onset = line.contact.onset
    if onset is None:
        return None
    return _ZONE / scene.fast_stiffness**0.5, max(1.0, order / (onset + 1.0))


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


def approach_time(scene: Scene) -> float:
    """
    Return how long the bodies take to meet at most; 0 where they start at their first contact.

    They meet before their centres of mass could, which come together with v0.
    """
    n, masses = scene.particles, scene.line.chain_masses
    positions, velocities = initial_state(scene.line)
    if positions[0] == 0.0 and velocities[0] < 0.0:
        return 0.0
    way = float(masses @ positions[:n]) / float(np.sum(masses))
    if scene.line.targets:
        # Of one particle, whose surface is where it is met: no way at all, but for rounding.
        targets = scene.line.target_masses
        way += 1.0 - float(targets @ positions[n:]) / float(np.sum(targets))
    return _LATEST * way / scene.impact_velocity
