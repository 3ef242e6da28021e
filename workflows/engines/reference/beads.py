"""Run collisions of beads with a wall or a target, hard or soft, with adaptive steps."""

import math
import time
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from chaincor.lammps_inputs.bonds.hertz import Hertz
from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.outcome import Frames, Outcome
from chaincor.workflows.engines.reference import bead_loops as loops
from chaincor.workflows.engines.reference.adaptive_flight import STAGES, AdaptiveFlight
from chaincor.workflows.engines.reference.adaptive_loops import FULL, LATE, OVER
from chaincor.workflows.engines.reference.bead_step import bead_rates
from chaincor.workflows.engines.reference.compile import KEPT, LoopCompiler
from chaincor.workflows.engines.reference.finish import (
    End,
    LastContact,
    bead_time_limit,
    displacements_from,
    finish,
    unfinished_error,
)
from chaincor.workflows.engines.reference.tracked import TRACKED, tracked_values
from chaincor.workflows.errors import TimestepError

# A single step may have the error _LOCAL_SHARE, relative to the target error of the restitution,
# but at least the error _FINEST_LOCAL.
_LOCAL_SHARE = 0.03
_FINEST_LOCAL = 1e-15
# This is the length of the first step. The unit of time is the time in which two colliding beads
# stop each other.
_FIRST_STEP = 0.01
# Snapshots continue for this time after the end, in the same unit.
_SHOWN = 5.0


def run(problem: Problem, accuracy: float, frame_interval: float | None, scheme: str) -> Outcome:
    """
    Run the collision of beads with adaptive steps.

    `accuracy` is the target error of the restitution. Snapshots at multiples of `frame_interval`
    come from partial steps and leave the motion unchanged. Raises TimestepError if no step, however
    small, is accurate, and UnfinishedCollisionError if the bodies do not part.
    """
    flight = _Flight(problem, accuracy, frame_interval)
    flight.warm_up()
    started = time.perf_counter()
    flight.run()
    over = float(flight.run_state.time)
    if frame_interval is not None:
        flight.fly_on()
    seconds = time.perf_counter() - started
    run_state, line = flight.run_state, problem.line
    times, speeds, given = flight.arrays.contacts[:, : run_state.contacts].copy()
    first = float(times[0])
    beads = len(line.masses)
    last = flight.arrays.last
    skipped = 1 if line.at_wall else 0
    return finish(
        problem,
        LastContact(
            last[1 + skipped : beads].copy(),
            last[beads + skipped : 2 * beads].copy(),
            contact_times=times - first,
            contact_speeds=speeds,
            impulses=given,
            position=float(last[0]),
            lasted=float(run_state.last_contact),
            bond_range=(1.0 + float(run_state.contact_min), 1.0 + float(run_state.contact_max)),
            dissipated=float(last[-1]) if flight.damped else None,
            tracked=tracked_values(flight.arrays.tracked, line.soft),
        ),
        End(Ending("proved"), over - first, int(run_state.evaluations)),
        scheme=scheme,
        timestep=None,
        seconds=seconds,
        frames=flight.collected(first),
    )


@lru_cache(maxsize=KEPT)
def _compile(bond: Callable, law: type[ContactLaw]) -> Callable:
    compiler = LoopCompiler.for_force(bond, True, f"beads.{law.force_kernel.__qualname__}")
    register = compiler.register
    kernel, contact = register(bond), register(law.force_kernel)
    drag = None if law.drag_kernel is None else register(law.drag_kernel)
    rates = register(bead_rates(kernel, contact, drag, register))
    return compiler.compile(loops.build_bead_flight(kernel, rates, register))


class _Flight(AdaptiveFlight):
    """Collision in progress, with the arrays of the loops; decides when the collision is over."""

    def __init__(self, problem: Problem, accuracy: float, frame_interval: float | None) -> None:
        line, bond, speed = problem.line, problem.bond, problem.impact_velocity
        assert isinstance(bond, Hertz), "beads follow a power of their overlap"
        self.damped = bond.damping > 0.0 or line.contact.damped
        self._problem, self._interval = problem, frame_interval
        beads = len(line.masses)
        overlap = -bond.compressed_strain(line.mean_mass * speed**2)
        self._unit = unit = overlap / speed
        state = np.concatenate(([0.0], line.strains, line.velocities, [0.0]))
        local = max(_FINEST_LOCAL, _LOCAL_SHARE * accuracy)
        scale = local * np.repeat((overlap, speed, line.mean_mass * speed**2), (beads, beads, 1))
        slopes = np.zeros((STAGES + 1, len(state)))
        arrays = loops.BeadArrays(
            *(state, state.copy(), state.copy(), state.copy(), scale),
            *(np.zeros_like(state), np.zeros_like(state), slopes, slopes.copy()),
            errors=np.zeros((2, len(state))),
            contacts=np.zeros((3, 2 * beads + 64)),
            frames=np.zeros((1 if frame_interval is None else 64, len(state))),
            masses=line.masses.copy(),
            tracked=np.zeros(len(TRACKED)),
        )
        parameters = loops.BeadParameters(
            *(bond.parameters, line.contact.parameters, line.inverse_masses.copy()),
            *(line.pair_stiffness.copy(), line.gap),
            *(float(bond.damping), float(bond.damping_power)),
        )
        run_state = np.zeros(1, loops.RUN_STATE)[0]
        loop = _compile(bond.force_kernel, type(line.contact))
        super().__init__(loop, run_state, arrays, parameters, beads)
        run_state.gap, run_state.soft = line.gap, int(line.soft)
        run_state.longest = bead_time_limit(problem)
        run_state.frame_interval = math.inf if frame_interval is None else frame_interval
        run_state.next_frame = math.inf if frame_interval is None else 0.0
        run_state.step = _FIRST_STEP * unit

    def run(self) -> None:
        """Integrate until the bodies provably do not touch again."""
        self._until(OVER)

    def fly_on(self) -> None:
        """Record snapshots until a little later than the end of the collision."""
        self.run_state.free = 1
        self.run_state.longest = 1.2 * self.run_state.time + _SHOWN * self._unit
        self._until(LATE)

    def _until(self, wanted: int) -> None:
        while (status := self._advance()) != wanted:
            if status == FULL:
                self._make_room()
            elif status == LATE:
                raise unfinished_error(self._problem, float(self.run_state.time))
            else:
                raise TimestepError(
                    f"no step resolves the overlaps of the beads at time {self.run_state.time:.6g} "
                    "to the required accuracy. Give a larger tolerance"
                )

    def collected(self, first: float) -> Frames | None:
        """Return the snapshots, timed from the first contact; None without a `frame_interval`."""
        if self._interval is None:
            return None
        states = self.arrays.frames[: int(self.run_state.frames)]
        beads = self._particles
        moved = [displacements_from(state[0], state[1:beads]) for state in states]
        times = self._interval * np.arange(len(states)) - first
        return Frames.of(self._problem.line, times, moved, states[:, beads : 2 * beads].copy())
