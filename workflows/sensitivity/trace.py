"""Record a collision as sections of steps, which can be computed again in reverse order."""

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
# The force of a soft contact may begin as a fractional power of time. The derivatives then converge
# with an order that is lower by one than the order of eta. For this reason, the steps at contacts
# are shorter than in runs that compute only eta.
GRADING, SHORTEST_SHARE = 0.25, 2.0**-14
# The tape of a section has about TAPE numbers, so that it fits into a cache. A motion has at least
# about LEAST_STRETCHES sections, because the last section continues beyond the last contact.
TAPE, LEAST_STRETCHES = 2.0**19, 4.0
# If a contact is slower than this fraction of the impact velocity, a small change of the input may
# remove it.
GRAZING = 1e-6


@dataclass(frozen=True)
class Stretch:
    """Section of a motion, with some of its steps."""

    #: Strains before the steps, along x, including the gap, of shape (N - 1,).
    strain: Array
    velocity: Array  #: Velocities before the steps, of shape (N,).
    substeps: Substeps  #: Substeps of this section.


@dataclass(frozen=True)
class Trace:
    """Record of a collision from its start to right after its last contact."""

    line: Line  #: Bodies with their initial state.
    loops: Loops  #: Compiled loops for the bonds.
    parameters: LineParameters  #: Parameters for the loops.
    stretches: list[Stretch]  #: Sections of the motion.

    @cached_property
    def _room(self) -> Tape:
        most = max(len(stretch.substeps.times) for stretch in self.stretches)
        shape = most, len(self.stretches[0].substeps.kicks), len(self.line.strains)
        return Tape(np.empty(shape), np.zeros((most, 3)), np.empty(shape))

    def follow(self, stretch: Stretch) -> tuple[Tape, Array, Array]:
        """
        Return the tape and the last state of a section.

        The next call overwrites the tape.
        """
        strain, velocity = stretch.strain.copy(), stretch.velocity.copy()
        tape = Tape(*(each[: len(stretch.substeps.times)] for each in self._room))
        self.loops.follow(strain, velocity, stretch.substeps, tape, self.parameters)
        speeds = tape.impacts[stretch.substeps.hits == 1.0, 0]
        slowest = GRAZING * abs(self.line.separation(self.line.velocities))
        if np.any(speeds <= slowest):
            raise SensitivityError(
                f"a contact is grazing (speed {np.min(speeds):.2g}), so eta has no "
                "derivative. Change the impact speed"
            )
        return tape, strain, velocity

    def backward(self) -> Iterator[tuple[Stretch, Tape, Array, Array]]:
        """Yield all sections from the last to the first, each with its tape and last state."""
        for stretch in reversed(self.stretches):
            check_time()
            yield stretch, *self.follow(stretch)

    def accelerations(self, strain: Array) -> Array:
        """Return the accelerations of all particles."""
        shape = 1, 1, len(strain)
        tape = Tape(np.empty(shape), np.zeros((1, 3)), np.empty(shape))
        kick = Substeps(np.ones(1), np.zeros(1), np.zeros(2), np.ones(1))
        gained = np.zeros(len(strain) + 1)
        self.loops.follow(strain.copy(), gained, kick, tape, self.parameters)
        return gained


def trace(scene: Scene, step: float, contacts: int, duration: float) -> Trace:
    """
    Record a collision, which has a known number of contacts, up to its last contact.

    `step` is a whole step of the scheme. `duration` is the time from the first contact to some time
    after the last one. Raise SensitivityError if the number of contacts differs, or if the loops
    cannot be compiled.
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
    # The number of steps per section makes the stored states about as large as the tape of a
    # section. Because each section costs function calls, sections are longer if the tape then still
    # fits into a cache.
    wanted_steps = duration / step
    cached = min(TAPE / (2.0 * len(kicks) * len(line.strains)), wanted_steps / LEAST_STRETCHES)
    steps = 8 + math.ceil(max(math.sqrt(2.0 * wanted_steps / len(kicks)), cached))
    room = np.empty((2, 2 * steps + motion.SPARE_GRADED_SUBSTEPS))
    moving.arrays = moving.arrays._replace(log=room)
    if not line.contact.smooth:
        moving.run_state["grading"], moving.run_state["shortest_share"] = GRADING, SHORTEST_SHARE
    mark, wanted = (2.0, 2 * contacts) if line.soft else (1.0, contacts)
    met, stretches = 0, []
    if moving.run_state["contacts"] > 0:
        meeting = Substeps(np.zeros(1), np.full(1, mark), drifts, kicks)
        stretches.append(Stretch(line.strains.copy(), line.velocities.copy(), meeting))
        met = 1
    bookkeeping.never_argue(moving.run_state)
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
                f"at the step {step:.3g} the collision has {met} contacts by t = "
                f"{gone:.6g}, instead of {wanted}. Choose a collision whose contacts do "
                "not depend on the step"
            )
    return Trace(line, loops, parameters, stretches)


def _advanced(moving: Motion, steps: int) -> tuple[Array, Array]:
    """Take steps, and return the duration of each substep and whether a contact ends it."""
    stepper, run_state = moving.stepper, moving.run_state
    run_state["substeps"] = 0
    status = stepper.advance(run_state, moving.arrays, int(run_state["steps"]) + steps)
    if status == bookkeeping.FULL:
        moving.make_room()
    elif status != bookkeeping.DONE:
        raise SensitivityError(
            f"a step of {stepper.step:.3g} does not resolve the bonds. Lower the speed"
        )
    times, hits = moving.arrays.log[:, : run_state["substeps"]].copy()
    return times, hits
