"""Follow the gap of two bodies in LAMMPS, and apply their contacts."""

import math
from dataclasses import dataclass

from chaincor.lammps_inputs.contact_script import contact_force, contact_force_off, contact_force_on
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.contact_search import PathPoint
from chaincor.workflows.engines.lammps.instance import LammpsChain

# Steps that are closer to an event than this time are graded (see :class:`SoftContactEvents`). The
# unit is 1/frequency of the fastest bond.
_ZONE = 1.0


@dataclass(frozen=True)
class ContactRecord:
    """Contact of particle 1 with the target."""

    time: float  #: Time since the first contact, at which the bodies touched.
    speed: float  #: Closing speed at `time`, positive.
    impulse: float  #: Momentum given to the chain.
    end: float  #: Time at which the bodies parted; equal to `time` for hard bodies.


class HardContactEvents:
    """
    Contact of two hard bodies; the event is the time at which their gap falls to zero.

    The bodies exchange the momentum 2 mu w. Here mu is the reduced mass of the two particles in
    contact and w the closing speed.
    """

    touching = False  #: Whether soft bodies overlap.

    def __init__(self, chain: LammpsChain, line: Line) -> None:
        self.chain, self.line = chain, line
        self.reduced_mass = line.contact_mass
        self._mass = float(line.chain_masses[0])
        # Index of the target's particle at the contact; None for a rigid wall.
        self._place = None if line.rigid else len(line.chain_masses)
        self._target_mass = float(line.masses[line.gap])

    def state(self) -> PathPoint:
        """Return the distance to the next event and its first and second derivatives in time."""
        x, v, f = self.chain.x, self.chain.v, self.chain.f
        gap, gap_velocity, acceleration = float(x[0]), float(v[0]), float(f[0]) / self._mass
        if self._place is not None:
            gap -= float(x[self._place])
            gap_velocity -= float(v[self._place])
            acceleration -= float(f[self._place]) / self._target_mass
        return gap, gap_velocity, acceleration

    def arrive(self, time: float) -> ContactRecord | None:
        """
        Apply the event; the state has reached it up to rounding.

        Return the contact that ends with the event, or None if no contact ends.
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
        return ContactRecord(time, speed, impulse, time)

    def step(self, time: float, state: PathPoint) -> float:
        """Return the length of the next composed step, which begins at `time` in `state`."""
        return self.chain.timestep

    def reset(self) -> None:
        """Undo an event, so that the motion can start from an earlier state."""

    def _close(self) -> float:
        """Set the gap, which is within rounding of zero, to zero; return the closing speed."""
        x = self.chain.x
        x[0] = 0.0 if self._place is None else x[self._place]
        return -self.state()[1]


class SoftContactEvents(HardContactEvents):
    r"""
    Contact of bodies that repel with :math:`K d^q` while they overlap by d.

    There are two events: the bodies touch, and they part. LAMMPS applies the force only between
    these events, with ``fix addforce``. No step crosses an event, because the kink of the force at
    the event would reduce the order of the step.

    If the exponent q is not an integer, no polynomial fits the force near an event. Composed steps
    are graded there: they end at the times :math:`t_k = \tau (k/m)^g` from the event. A step h of
    order p at the time t from the event has the error :math:`h^p t^{q+1-p}`; with grading, the sum
    of these errors is of order p in 1/m. Without grading the order would be q + 1 for any scheme.
    """

    def __init__(self, chain: LammpsChain, line: Line, graded: tuple[float, float] | None) -> None:
        super().__init__(chain, line)
        self._graded = graded
        self._began = (0.0, 0.0, 0.0)
        chain.commands("\n".join(contact_force(line)))

    def state(self) -> PathPoint:
        """Return the gap, or the overlap during contact, with its first two derivatives in time."""
        gap, gap_velocity, acceleration = super().state()
        sign = -1.0 if self.touching else 1.0
        return sign * gap, sign * gap_velocity, sign * acceleration

    def step(self, time: float, state: PathPoint) -> float:
        """Return H, or a graded step if soft bodies have just touched or are about to part."""
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
        """Return the momentum of the chain, or minus the momentum of a free target, along x."""
        v, n = self.chain.v, len(self.line.chain_masses)
        if self._place is None:
            return float(self.line.chain_masses @ v)
        return -float(self.line.target_masses @ v[n:])

    def arrive(self, time: float) -> ContactRecord | None:
        """Switch the force on if the bodies now touch, and off if they now part."""
        speed = self._close()
        if speed <= 0.0:
            return None
        if not self.touching:
            self._began = (time, speed, self._momentum())
            self._switch(True)
            return None
        self._switch(False)
        touched, speed, before = self._began
        return ContactRecord(touched, speed, self._momentum() - before, time)

    def reset(self) -> None:
        """Switch off the force if the bodies touch."""
        if self.touching:
            self._switch(False)

    def _switch(self, on: bool) -> None:
        self.touching = on
        commands = contact_force_on(self.line) if on else contact_force_off(self.line)
        # In a run of zero steps, LAMMPS applies the change and computes the forces.
        self.chain.commands("\n".join([*commands, "run 0 post no"]))


def grading(onset: float | None, stiffness: float, order: int) -> tuple[float, float] | None:
    """
    Return the time tau and the power g of graded steps, see :class:`SoftContactEvents`.

    `onset` is the power with which the force of the contact begins, None if a polynomial fits the
    force; steps are then not graded. `stiffness` is the squared frequency of the fastest bond.
    """
    if onset is None:
        return None
    return _ZONE / stiffness**0.5, max(1.0, order / (onset + 1.0))


def time_to_zero(distance: float, rate: float, acceleration: float) -> float:
    """
    Return the time at which x + v t + a t^2/2 falls to zero; inf if it does not.

    The formula avoids cancellation, also if v is positive and x falls only later.
    """
    square = rate * rate - 2.0 * distance * acceleration
    if square < 0.0 or (rate >= 0.0 and acceleration >= 0.0):
        return math.inf
    root = math.sqrt(square)
    return 2.0 * distance / (root - rate) if rate < 0.0 else -(rate + root) / acceleration
