"""The stepping engine for two bodies on a line: unequal masses, free targets, soft contacts."""

import math
import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import EndWatch
from chaincor.workflows.engines.ending import Ending, quiet_time
from chaincor.workflows.engines.in_house.finish import (
    KNOWN_MARGIN,
    refuse_growth,
    strain_error,
    unfinished_error,
)
from chaincor.workflows.engines.in_house.lines import loop
from chaincor.workflows.engines.in_house.lines.bodies import LineInMotion
from chaincor.workflows.engines.outcome import Frames, Outcome
from chaincor.workflows.engines.pieces import count_fragments

Array = NDArray[np.float64]

# Soft bodies may overlap for so many times what two free particles would.
LONGEST_TOUCHES = 100.0


def watch_of(scene: Scene) -> EndWatch:
    """Return the watch for the end of a scene with a line."""
    return EndWatch(scene.span, scene.bond, scene.slow_stiffness)


def run_line(
    scene: Scene,
    numerics: Numerics,
    frame_interval: float | None = None,
    known: Outcome | None = None,
    follow: bool = True,
) -> Outcome:
    """
    Carry two bodies through their collision, step by step.

    Parameters and errors are those of :func:`chaincor.workflows.engines.in_house.stepping.run`.
    """
    line = scene.line
    moving = LineInMotion.of(
        line, scene.bond, numerics.scheme, numerics.timestep, line.strains, line.velocities
    )
    moving.advance(0)  # loads or compiles the loop, which is not integration
    frames = _Recorder(moving, frame_interval)
    started = time.perf_counter()
    ending = _carry_out(scene, moving, frames, known, follow)
    seconds = time.perf_counter() - started
    return _outcome(scene, numerics, moving, ending, seconds, frames)


def _carry_out(
    scene: Scene,
    moving: LineInMotion,
    frames: "_Recorder",
    known: Outcome | None,
    follow: bool,
) -> Ending:
    """Step until the end; return it."""
    watch, ledger = watch_of(scene), moving.ledger
    bodies, stiffness = scene.span, scene.slow_stiffness
    # Times of outcomes count from the first contact, those of the motion from its start.
    look = 0.0
    margin = KNOWN_MARGIN / stiffness**0.5
    frames.record()
    while True:
        until = look
        if known is not None:
            until = moving.time + margin
            if ledger.contacts > 0:
                until = float(moving.contacts[0, 0] + known.contact_times[-1]) + margin
        advance_to(scene, moving, frames.steps_until(until), unresolved=f"{moving.step:g}")
        frames.record()
        now = moving.time
        if now < until:
            continue
        if ledger.contacts == 0:
            # The chain's mean comes nearer: a contact comes, soon or late.
            look = now + 1.0 / stiffness**0.5
            continue
        last = float(ledger.parted)
        if known is not None:
            compared = float(moving.contacts[0, 0] + known.contact_times[-1])
            if now >= compared and not ledger.touching:
                return known.ending
            continue
        if not ledger.touching:
            ending = watch.look_at(now, last, moving.bodies())
            if ending is not None:
                return ending
            if not follow and now - last > quiet_time(bodies, stiffness):
                return Ending("argued")
        patience = watch.followed_until(last)
        if ledger.touching:
            begun = float(moving.contacts[0, -1])
            patience = max(patience, begun + LONGEST_TOUCHES * scene.contact_duration)
        if now > patience:
            raise unfinished_error(scene, now)
        # While contacts follow one another, looks would be for nothing.
        look = max(watch.next_look(now, last), now + 2.0 / stiffness**0.5)


def advance_to(scene: Scene, moving: LineInMotion, goal: int, unresolved: str) -> None:
    """Take steps; raises what is wrong where the loop stops."""
    if moving.advance(goal) != loop.DONE:
        raise strain_error(
            scene,
            float(moving.ledger.strain_min),
            float(moving.ledger.strain_max),
            moving.time,
            f"take a smaller timestep than {unresolved}, or a lower speed",
        )


def _outcome(
    scene: Scene,
    numerics: Numerics,
    moving: LineInMotion,
    ending: Ending,
    seconds: float,
    frames: "_Recorder",
) -> Outcome:
    line, ledger, last = moving.line, moving.ledger, moving.arrays.last
    times, speeds, impulses = moving.contacts.copy()
    begin = float(times[0])
    energy_start = line.energy(scene.bond, line.strains, line.velocities)
    energy_end = line.energy(scene.bond, last.strain, last.velocity)
    refuse_growth(scene, energy_start, energy_end)
    first, targets = line.first, line.targets
    displacements = moving.displacements(float(ledger.last_position), last.strain)
    return Outcome(
        engine="reference",
        wall="event",
        scheme=numerics.scheme,
        timestep=numerics.timestep,
        displacements=displacements[first:],
        velocities=last.velocity[first:].copy(),
        contact_times=times - begin,
        contact_speeds=speeds,
        impulses=impulses,
        ending=ending,
        duration=moving.time - begin,
        bond_min=1.0 + float(ledger.contact_min),
        bond_max=1.0 + float(ledger.contact_max),
        energy_start=energy_start,
        energy_end=energy_end,
        fragments=count_fragments(
            last.strain[first:], last.velocity[first:], scene.bond, line.chain_masses
        ),
        seconds=seconds,
        force_evaluations=int(ledger.evaluations),
        crossed=1.0 + float(ledger.contact_min) < 0.0,
        frames=frames.collected(
            begin, float(ledger.parted) + quiet_time(scene.span, scene.slow_stiffness)
        ),
        target_displacements=displacements[:targets][::-1],
        target_velocities=last.velocity[:targets][::-1].copy(),
    )


@dataclass
class _Recorder:
    """Takes snapshots at multiples of an interval after the first contact."""

    moving: LineInMotion
    interval: float | None
    _before: LineInMotion | None = None
    _times: list[float] = field(default_factory=list)
    _states: list[tuple[Array, Array]] = field(default_factory=list)

    def _next(self) -> float:
        """Time of the next snapshot, in that of the motion."""
        if self.interval is None or self.moving.ledger.contacts == 0:
            return math.inf
        return float(self.moving.contacts[0, 0]) + len(self._times) * self.interval

    def steps_until(self, time: float) -> int:
        """Return how many steps to take to a time, or to the one in which a snapshot is due."""
        moving = self.moving
        goal = moving.steps_until(time)
        if self.interval is None:
            return goal
        done, due = int(moving.ledger.steps), self._next() / moving.step
        if math.isfinite(due):
            return min(goal, max(done + 1, math.floor(due)))
        self._before = moving.copy()
        return done + 1

    def record(self) -> None:
        """Take all snapshots in the step about to be done, or in the one with the first contact."""
        while self._next() < self.moving.time + self.moving.step:
            now = self._next()
            begun = self.moving if now >= self.moving.time else self._before
            assert begun is not None
            self._times.append(now)
            self._states.append(begun.state_at(now))

    def collected(self, begin: float, until: float) -> Frames | None:
        """Return the snapshots up to a time, if any were asked for."""
        if self.interval is None:
            return None
        line = self.moving.line
        states = self._states[: sum(now <= until for now in self._times)]
        times = np.array(self._times[: len(states)]) - begin
        displacements, velocities = (np.array(each) for each in zip(*states, strict=True))
        first, targets = line.first, line.targets
        return Frames(
            times,
            displacements[:, first:],
            velocities[:, first:],
            displacements[:, :targets][:, ::-1] if targets else None,
            velocities[:, :targets][:, ::-1] if targets else None,
        )
