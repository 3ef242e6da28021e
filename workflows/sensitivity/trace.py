"""Trace of a collision: stretches of steps that can be followed again, from the last one back."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference import bookkeeping, motion
from chaincor.workflows.engines.reference.line_traits import LineParameters
from chaincor.workflows.engines.reference.moving import Motion, Stepper
from chaincor.workflows.engines.time_limit import check_time
from chaincor.workflows.errors import SensitivityError
from chaincor.workflows.sensitivity.loops import Loops, Substeps, Tape, loops_for

SCHEME = "order8"
# If the force of a soft contact begins as a fractional power of the time, derivatives have one
# order less than eta, so steps are shorter than in a collision.
GRADING, SHORTEST_SHARE = 0.25, 2.0**-14
# Numbers of a tape that fit into a cache, and the smallest number of stretches, because the last
# one goes beyond the last contact.
TAPE, LEAST_STRETCHES = 2.0**19, 4.0
# A small change can remove a contact that is slower than this part of the impact velocity.
GRAZING = 1e-6


@dataclass(frozen=True)
class Stretch:
    """Some steps of a motion."""

    #: Strains before the steps, along x, with the gap; of shape (N - 1,).
    strain: Array
    velocity: Array  #: Velocities before the steps; of shape (N,).
    substeps: Substeps  #: Substeps of the steps.


@dataclass(frozen=True)
class Trace:
    """A collision from its start to right after its last contact."""

    line: Line  #: Bodies with their initial state.
    loops: Loops  #: Loops of the bonds.
    parameters: LineParameters  #: Parameters of the loops.
    stretches: list[Stretch]  #: Stretches of the motion.

    @cached_property
    def _room(self) -> Tape:
        most = max(len(stretch.substeps.times) for stretch in self.stretches)
        shape = most, len(self.stretches[0].substeps.kicks), len(self.line.strains)
        return Tape(np.empty(shape), np.zeros((most, 3)), np.empty(shape))

    def follow(self, stretch: Stretch) -> tuple[Tape, Array, Array]:
        """Return the tape of a stretch, good until the next is followed, and its last state."""
        strain, velocity = stretch.strain.copy(), stretch.velocity.copy()
        tape = Tape(*(each[: len(stretch.substeps.times)] for each in self._room))
        self.loops.follow(strain, velocity, stretch.substeps, tape, self.parameters)
        speeds = tape.impacts[stretch.substeps.hits == 1.0, 0]
        slowest = GRAZING * abs(self.line.separation(self.line.velocities))
        if np.any(speeds <= slowest):
            raise SensitivityError(
                f"a contact has the speed {np.min(speeds):.2g}: it grazes, and eta has no "
                "derivative there. Change the speed"
            )
        return tape, strain, velocity

    def backward(self) -> Iterator[tuple[Stretch, Tape, Array, Array]]:
        """Yield the stretches from the last to the first, with their tapes and last states."""
        for stretch in reversed(self.stretches):
            check_time()
            yield stretch, *self.follow(stretch)

    def accelerations(self, strain: Array) -> Array:
        """Return the accelerations of all particles in a state."""
        shape = 1, 1, len(strain)
        tape = Tape(np.empty(shape), np.zeros((1, 3)), np.empty(shape))
        kick = Substeps(np.ones(1), np.zeros(1), np.zeros(2), np.ones(1))
        gained = np.zeros(len(strain) + 1)
        self.loops.follow(strain.copy(), gained, kick, tape, self.parameters)
        return gained


def trace(scene: Scene, step: float, contacts: int, duration: float) -> Trace:
    """
    Carry out a collision with a known number of contacts, up to the last of them.

    `step` is a whole step of the scheme; the last contact has ended by `duration` after the first.
    Raises SensitivityError if it has other contacts with this step, or no loops.
    """
    line = scene.line
    if line.contact.damped:
        raise SensitivityError(
            f"contact {line.contact.name!r} damps the motion, and its derivatives are not known. "
            "Use a contact without damping"
        )
    loops = loops_for(scene.bond, type(line.contact))
    if loops is None:
        raise SensitivityError(
            f"the force of bond '{scene.label}' cannot be compiled. Use functions of "
            "numbers that Numba knows, such as the functions of a formula"
        )
    stepper = Stepper.of(line, scene.bond, SCHEME, step)
    moving = Motion.at_start(scene.problem, stepper)
    law, inverse = line.contact.parameters, line.inverse_masses.copy()
    parameters = LineParameters(loops.parameters, inverse, line.gap, law)
    drifts, kicks = stepper.scheme.fractions
    # The kept states and the tape of a stretch have similar sizes. Each stretch costs calls, so a
    # motion whose tape fits into a cache has few stretches.
    wanted_steps = duration / step
    cached = min(TAPE / (2.0 * len(kicks) * len(line.strains)), wanted_steps / LEAST_STRETCHES)
    steps = 8 + math.ceil(max(math.sqrt(2.0 * wanted_steps / len(kicks)), cached))
    room = np.empty((2, 2 * steps + motion.SPARE_GRADED_SUBSTEPS))
    moving.arrays = moving.arrays._replace(log=room)
    if not line.contact.smooth:
        moving.ledger["grading"], moving.ledger["shortest_share"] = GRADING, SHORTEST_SHARE
    mark, wanted = (2.0, 2 * contacts) if line.soft else (1.0, contacts)
    met, stretches = 0, []
    if moving.ledger["contacts"] > 0:
        meeting = Substeps(np.zeros(1), np.full(1, mark), drifts, kicks)
        stretches.append(Stretch(line.strains.copy(), line.velocities.copy(), meeting))
        met = 1
    bookkeeping.never_argue(moving.ledger)
    gone = 0.0
    while met < wanted:
        check_time()
        strain, velocity = (each.copy() for each in moving.along_x())
        times, hits = _advanced(moving, steps)
        ends = np.flatnonzero(hits)[: wanted - met]
        gone = gone + float(np.sum(times)) if met or len(ends) else 0.0
        met += len(ends)
        if met == wanted:
            times, hits = times[: ends[-1] + 1], hits[: ends[-1] + 1]
        stretches.append(Stretch(strain, velocity, Substeps(times, mark * hits, drifts, kicks)))
        if met < wanted and gone > duration + (steps + 1) * step:
            raise SensitivityError(
                f"with the step {step:.3g} the collision has {met} contacts by t = {gone:.6g}, "
                f"but {wanted} are known. Choose a collision whose contacts do not depend on "
                "the step"
            )
    return Trace(line, loops, parameters, stretches)


def _advanced(moving: Motion, steps: int) -> tuple[Array, Array]:
    """Take steps, and return the duration of each substep and whether a contact ends it."""
    stepper, ledger = moving.stepper, moving.ledger
    ledger["substeps"] = 0
    status = stepper.advance(ledger, moving.arrays, int(ledger["steps"]) + steps)
    if status == bookkeeping.FULL:
        moving.make_room()
    elif status != bookkeeping.DONE:
        raise SensitivityError(
            f"steps of {stepper.step:.3g} do not resolve the bonds. Lower the speed"
        )
    times, hits = moving.arrays.log[:, : ledger["substeps"]].copy()
    return times, hits
