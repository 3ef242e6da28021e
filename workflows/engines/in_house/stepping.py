"""The stepping engine: symmetric compositions of Verlet steps with contacts located to rounding."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import EndWatch
from chaincor.workflows.engines.ending import Ending, quiet_time
from chaincor.workflows.engines.in_house import motion
from chaincor.workflows.engines.in_house.chain import Chain, Stepper
from chaincor.workflows.engines.in_house.chain_coast import LookAhead
from chaincor.workflows.engines.in_house.finish import (
    KNOWN_MARGIN,
    LastContact,
    displacements_from,
    finish,
    run_single_particle,
    strain_error,
    unfinished_error,
)
from chaincor.workflows.engines.in_house.lines.running import run_line
from chaincor.workflows.engines.in_house.loops.beside import meanwhile
from chaincor.workflows.engines.outcome import Frames, Outcome
from chaincor.workflows.engines.whole_end import certain_at, next_look


def run(
    scene: Scene,
    numerics: Numerics,
    frame_interval: float | None = None,
    known: Outcome | None = None,
    follow: bool = True,
) -> Outcome:
    """
    Carry a chain through its collision, step by step.

    Parameters
    ----------
    scene : Scene
        What collides.
    numerics : Numerics
        Scheme and step; tables have no meaning here.
    frame_interval : float, optional
        Time between snapshots. Each is reached by a copy of the chain, so that asking for
        frames changes no result.
    known : Outcome, optional
        The same collision at another step, whose end was seen: this run is compared with it, and
        goes only a little beyond its last contact.
    follow : bool
        Whether an end that is not proved is followed on. Without, silence for as long as sound
        needs to cross the chain and come back ends the run: for runs that are only compared.

    Returns
    -------
    Outcome
        With the state right after the last contact. That it was the last is mostly seen by
        looking ahead with coarse steps (see ``look_ahead``); chains that break are followed with
        the steps of the run.

    Raises
    ------
    UnfinishedCollisionError
        If the chain still approaches the wall after the longest time that is followed.
    BarrierError
        If a bond of odd order is stretched over its barrier.
    CrossingError
        If two particles would pass through each other; a harmonic chain is flagged and carried on.
    TimestepError
        If the step is too large for the bonds it must resolve.
    """
    if not scene.line.plain:
        return run_line(scene, numerics, frame_interval, known, follow)
    if scene.particles == 1:
        return run_single_particle(scene, numerics.scheme, numerics.timestep, frame_interval)
    stepper = Stepper.of(scene.bond, numerics.scheme, numerics.timestep)
    chain = Chain.at_first_contact(scene, stepper.scheme)
    look_ahead = LookAhead(scene, chain, stepper, _at_first(scene, stepper))
    if not stepper.kernels.loaded.is_set():
        # Without a step to take, this only loads or compiles the loops, which is not integration.
        with meanwhile(_warm_up_coast, scene, numerics):
            chain.advance(stepper, 0)
        look_ahead.warm_up()
        stepper.kernels.loaded.set()
    frames = _Recorder(chain, stepper, frame_interval)
    collision = _Collision(scene, chain, stepper, look_ahead, frames)
    started = time.perf_counter()
    ending, duration, evaluations = collision.run(known, follow)
    seconds = time.perf_counter() - started
    ledger = chain.ledger
    frames_until = float(ledger["last_contact"]) + quiet_time(scene.particles, scene.bond.stiffness)
    return finish(
        scene,
        LastContact(
            strains=chain.arrays.last.strain,
            velocities=chain.arrays.last.velocity,
            contact_times=chain.contact_times.copy(),
            contact_speeds=chain.contact_speeds.copy(),
        ),
        scheme=numerics.scheme,
        timestep=numerics.timestep,
        ending=ending,
        duration=duration,
        bond_range=(1.0 + float(ledger["contact_min"]), 1.0 + float(ledger["contact_max"])),
        seconds=seconds,
        force_evaluations=evaluations,
        frames=frames.collected(frames_until),
    )


def follow_on(scene: Scene, chain: Chain, stepper: Stepper) -> tuple[Ending, float, int]:
    """
    Go on with a chain that was left where its end may be argued, as :func:`run` does.

    Parameters
    ----------
    scene : Scene
        What collides: a cold chain of unit masses before a hard wall.
    chain : Chain
        Which came back from its last steps with `motion.ARGUE`, its end not looked for before; it
        is changed in place, and may get new room for contacts.
    stepper : Stepper
        Its steps.

    Returns
    -------
    Ending, float, int
        How the collision ends, when that was seen, and the force evaluations so far.

    Raises
    ------
    RunError
        As :func:`run`.
    """
    look_ahead = LookAhead(scene, chain, stepper, _at_first(scene, stepper))
    frames = _Recorder(chain, stepper, None)
    collision = _Collision(scene, chain, stepper, look_ahead, frames)
    return collision.run(None, True, motion.ARGUE)


def _warm_up_coast(scene: Scene, numerics: Numerics) -> None:
    """Load or compile the loop over coarse steps alone."""
    stepper = Stepper.of(scene.bond, numerics.scheme, numerics.timestep)
    first = _at_first(scene, stepper)
    LookAhead(scene, first(), stepper, first).warm_up()


def _at_first(scene: Scene, stepper: Stepper) -> Callable[[], Chain]:
    return partial(Chain.at_first_contact, scene, stepper.scheme)


@dataclass(frozen=True)
class _Collision:
    """A collision in progress: the chain, its steps, and who looks at it on the way."""

    scene: Scene
    chain: Chain
    stepper: Stepper
    look_ahead: LookAhead
    frames: "_Recorder"

    def run(
        self, known: Outcome | None, follow: bool, left: int | None = None
    ) -> tuple[Ending, float, int]:
        """
        Step until the end; return it, when that is, and the force evaluations it took.

        `left` is why the chain came back from steps that were taken elsewhere.
        """
        scene, chain, step = self.scene, self.chain, self.stepper.step
        bond, ledger = scene.bond, chain.ledger
        particles, stiffness = scene.particles, bond.stiffness
        watch = EndWatch(particles, bond)
        if known is not None:
            ledger["argue_after"] = ledger["patience"] = math.inf
            until = float(known.contact_times[-1]) + KNOWN_MARGIN / stiffness**0.5
        while True:
            longest = until if known else watch.followed_until(float(ledger["last_contact"]))
            last_step = math.ceil(longest / step)
            goal = int(min(last_step + 1, self.frames.next_step()))
            status = chain.advance(self.stepper, goal) if left is None else left
            left = None
            if status in (motion.OUTSIDE, motion.CROWDED):
                raise strain_error(
                    scene,
                    float(ledger["strain_min"]),
                    float(ledger["strain_max"]),
                    float(ledger["steps"] * step),
                    f"take a smaller timestep than {step:g}, or a lower speed",
                )
            if status == motion.FULL:
                chain.make_room()
                continue
            now, last = float(ledger["steps"] * step), float(ledger["last_contact"])
            late = ledger["steps"] > last_step
            if late and known is not None:
                return known.ending, now, int(ledger["evaluations"])
            certain = math.inf
            if status == motion.ARGUE:
                speed, momentum = float(ledger["impact_velocity"]), float(ledger["momentum"])
                distance = float(ledger["wall_distance"])
                certain = certain_at(bond, speed, momentum, distance, chain.strain, now, last)
            if certain < math.inf:
                off, seen, evaluations = self.look_ahead.keeps_off(certain)
                if off:
                    self.frames.record_until(seen)
                    return Ending("proved"), seen, evaluations
                ledger["evaluations"] = evaluations
                ledger["argue_after"] = next_look(now, last, seen) - last
            elif status == motion.ARGUE or late:
                ending = watch.look(
                    now, last, float(ledger["wall_distance"]), chain.strain, chain.velocity
                )
                if ending is not None:
                    return self.look_ahead.doubt_about(ending), now, int(ledger["evaluations"])
                if not follow and now - last > quiet_time(particles, stiffness):
                    return Ending("argued"), now, int(ledger["evaluations"])
                settled = self.look_ahead.settle()
                if settled is not None:
                    coast, ending = settled
                    self.frames.record_until(coast.time)
                    evaluations = int(coast.chain.ledger["evaluations"])
                    return self.look_ahead.doubt_about(ending), coast.time, evaluations
                ledger["argue_after"] = watch.next_look(now, last) - last
            if status == motion.DONE:
                if late and watch.followed_until(last) < now:
                    raise unfinished_error(scene, now)
                self.frames.record()


class _Recorder:
    """Takes snapshots at multiples of an interval, with copies of the chain."""

    def __init__(self, chain: Chain, stepper: Stepper, interval: float | None) -> None:
        self._chain, self._stepper, self._interval = chain, stepper, interval
        self._times: list[float] = []
        self._displacements: list[NDArray[np.float64]] = []
        self._velocities: list[NDArray[np.float64]] = []

    def _next_time(self) -> float:
        return math.inf if self._interval is None else len(self._times) * self._interval

    def next_step(self) -> float:
        """Return the grid step from which the next snapshot is taken."""
        return math.inf if self._interval is None else self._next_time() // self._stepper.step

    def record(self) -> None:
        """Take all snapshots that lie within the step about to be done."""
        begin = self._chain.ledger["steps"] * self._stepper.step
        while self.next_step() <= self._chain.ledger["steps"]:
            now = self._next_time()
            copy = self._chain.copy()
            # One step of the size that is missing, contacts included.
            missing = self._stepper.of_size(max(now - begin, 0.0))
            copy.advance(missing, int(copy.ledger["steps"]) + 1)
            self._times.append(now)
            self._displacements.append(
                displacements_from(float(copy.ledger["wall_distance"]), copy.strain)
            )
            self._velocities.append(copy.velocity)

    def record_until(self, end: float) -> None:
        """Take all snapshots up to a time before which no contact comes; the chain is moved."""
        self._chain.ledger["argue_after"] = math.inf
        while self._next_time() <= end:
            self._chain.advance(self._stepper, int(self.next_step()))
            self.record()

    def collected(self, until: float) -> Frames | None:
        """Return the snapshots up to a time, if any were asked for."""
        if self._interval is None:
            return None
        count = sum(moment <= until for moment in self._times)
        return Frames(
            np.array(self._times[:count]),
            np.array(self._displacements[:count]),
            np.array(self._velocities[:count]),
        )
