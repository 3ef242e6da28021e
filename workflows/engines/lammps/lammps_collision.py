"""Run one collision in LAMMPS: its contacts, bonds, frames and end."""

import math
from dataclasses import replace

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.run_files import NO_FILES, RunFiles
from chaincor.workflows.engines.end_watch import longest_collision, look_interval
from chaincor.workflows.engines.ending import Ending, sound_round_trip
from chaincor.workflows.engines.fragments import count_fragments
from chaincor.workflows.engines.lammps.contact import ContactRecord
from chaincor.workflows.engines.lammps.flight import LammpsFlight
from chaincor.workflows.engines.outcome import Frames, Outcome
from chaincor.workflows.engines.reference.finish import unfinished_error
from chaincor.workflows.engines.reference.look_ahead import follow
from chaincor.workflows.errors import (
    BarrierError,
    BondRangeError,
    CrossingError,
    LostAtomsError,
    RunError,
)

# The reference engine searches for the end at this time after a contact, in units of 1/sqrt(U'').
# In this unit, the time between two contacts is 1.4 to 2.3 and seldom longer than PATIENCE; an
# earlier search would usually find another contact.
PATIENCE = 3.5


class ChainCollision:
    """
    State of one collision: contacts, search for the end, and frames.

    A flight moves the chain from contact to contact. `frame_interval` is the least time between
    frames. If `frame_interval` is None and `files` include a dump, frames are taken only for the
    dump, at contacts or at the dump's own interval.
    """

    def __init__(
        self,
        problem: Problem,
        flight: LammpsFlight,
        frame_interval: float | None,
        files: RunFiles = NO_FILES,
    ) -> None:
        self.problem, self.bond, self.line = problem, problem.bond, problem.line
        self.flight, self.chain = flight, flight.chain
        # _rest contains the rest positions of all particles in the order of LAMMPS, the chain
        # first; _order sorts the particles along x.
        n, targets = problem.particles, problem.line.targets
        self._rest = np.append(np.arange(n, dtype=float), -np.arange(targets, dtype=float))
        self._order = np.append(np.arange(n + targets)[: n - 1 : -1], np.arange(n))
        self.contacts: list[ContactRecord] = []
        self.after_contact = self._state()
        # shortest_seen and longest_seen are the extreme bond lengths from the first contact until
        # now; shortest and longest are the extreme bond lengths from the first to the last contact.
        lengths = self.chain.lengths() if problem.longest_body > 1 else np.ones(1)
        self.shortest_seen, self.longest_seen = float(lengths.min()), float(lengths.max())
        self.shortest, self.longest = self.shortest_seen, self.longest_seen
        # longest_ever is the length of the longest bond at any time; the bond table must cover it.
        self.longest_ever = self.longest_seen
        self._touched = False
        self.ending: Ending | None = None
        self._dumps = files.dump is not None
        dumped = self._dumps and frame_interval is None
        self.frames_at_contacts = dumped and files.frame_interval is None
        if dumped:
            frame_interval = files.frame_interval
        self.frame_interval = frame_interval
        self.next_frame = np.inf if frame_interval is None else 0.0
        self.frames: list[tuple[float, Array, Array]] = []
        # If no contact follows within `patience`, the search for the end begins at the time
        # `overdue`.
        self.patience = PATIENCE / problem.slow_stiffness**0.5
        self.overdue = np.inf
        # ended_at is the time at which the end was found; frames are taken until frames_until.
        self.ended_at, self.frames_until = 0.0, np.inf
        # doubt is the momentum of late contacts about which nearly equal motions disagree.
        self.doubt = 0.0

    def _state(self) -> tuple[Array, Array]:
        """Return displacements and velocities along x; a rigid wall counts as a particle."""
        u, v = (self.chain.x - self._rest)[self._order], self.chain.v[self._order]
        return (np.append(0.0, u), np.append(0.0, v)) if self.line.rigid else (u, v)

    def carry_out(self) -> None:
        """Run from contact to contact until no further contact can come."""
        if self.problem.longest_body == 1:  # neither body has bonds
            self._bounce_once()
            return
        self._approach()
        interval = look_interval(self.problem.longest_body, self.problem.slow_stiffness)
        next_watch = self.flight.time + interval
        while self.ending is None or self.flight.time < self.frames_until:
            limit = min(next_watch, self.next_frame, self.overdue, self.frames_until)
            contact = self._advance(limit)
            self._watch_bonds()
            if contact is not None:
                self._take_contact(contact)
            now = self.flight.time
            if now >= next_watch:
                next_watch = now + interval
            if now >= self.next_frame:
                self._take_frame()
            if now >= self.overdue:
                if self.flight.contact_events.touching:
                    self.overdue = now + self.patience
                else:
                    self._predict_next_event()
        if self.frames and self.frames[-1][0] < self.flight.time:
            self._take_frame()

    def _advance(self, limit: float) -> ContactRecord | None:
        try:
            return self.flight.advance(limit)
        except BondRangeError as error:
            raise self._named(error) from None
        except OverflowError:
            raise LostAtomsError(
                f"coordinates overflow at time {self.flight.time:g}. Use a smaller timestep"
            ) from None

    def _approach(self) -> None:
        """Set the clock to minus the time of approach if the bodies start apart."""
        gap, gap_velocity, _ = self.flight.contact_events.state()
        if gap == 0.0 and gap_velocity < 0.0:
            return
        start, stages = self.chain.snapshot(), self.chain.stages_done
        longest = self.problem.approach_time
        while self._advance(self.flight.time + self.patience) is None:
            self._watch_bonds()
            if self.flight.contact_events.touching:
                break
            if self.flight.time > longest:
                raise unfinished_error(self.problem, self.flight.time)
        self.flight.contact_events.reset()
        self._touched = False
        self.chain.restore(start)
        self.chain.stages_done = stages
        self.flight.time *= -1.0
        if self.frame_interval is not None:
            self.next_frame = self.flight.time

    def _bounce_once(self) -> None:
        contact = None
        while contact is None:
            contact = self.flight.advance(self.flight.time + self.patience)
        self._take_contact(contact)
        if self.frame_interval is not None:
            self._take_frame()
        self.ending = Ending("proved")

    def _take_contact(self, contact: ContactRecord) -> None:
        if not self.contacts:  # times count from the first contact
            self.flight.time -= contact.time
            contact = replace(contact, time=0.0, end=contact.end - contact.time)
        self.contacts.append(contact)
        self.after_contact = self._state()
        self.shortest, self.longest = self.shortest_seen, self.longest_seen
        self.ending, self.frames_until = None, np.inf
        self.overdue = contact.end + self.patience
        if self.frames_at_contacts:
            self._take_frame()

    def _named(self, error: BondRangeError) -> BondRangeError:
        """Add the bond and the time to an error; LAMMPS reports only the length."""
        lengths = np.abs(self.chain.lengths())
        bond = int(np.argmin(np.abs(lengths - error.length))) + 1
        side = "below" if error.length < 1.0 else "beyond"
        named = BondRangeError(
            f"bond {bond} is {error.length:.6g} long, {side} the end of its table, after step "
            f"{self.chain.stages_done} at time {self.flight.time:.6g}"
        )
        named.length = error.length
        return named

    def _watch_bonds(self) -> None:
        lengths = self.chain.lengths()
        shortest, longest = float(lengths.min()), float(lengths.max())
        if not shortest > 0.0:
            bond = int(np.argmin(lengths)) + 1
            raise CrossingError(
                f"bond {bond} is {shortest:g} long at time {self.flight.time:g}. LAMMPS knows "
                "only its absolute length, so particles that pass through each other get wrong "
                "forces. Lower the speed or the timestep, or use engine 'reference'"
            )
        if not self.contacts and not self._touched:
            # The range of bond lengths starts at the first contact. Soft bodies touch for a while
            # before their contact is recorded; the range starts when they touch.
            self.shortest_seen, self.longest_seen = shortest, longest
            self._touched = self.flight.contact_events.touching
        self.shortest_seen = min(self.shortest_seen, shortest)
        self.longest_seen = max(self.longest_seen, longest)
        self.longest_ever = max(self.longest_ever, longest)
        barrier = self.bond.barrier_strain
        if longest - 1.0 > barrier:
            bond = int(np.argmax(lengths)) + 1
            raise BarrierError(
                f"bond {bond} is {longest:g} long at time {self.flight.time:g}, beyond the "
                f"energy barrier of its potential at {1.0 + barrier:g}. Lower the speed"
            )

    def _predict_next_event(self) -> None:
        """Let the reference engine decide whether another contact follows."""
        now, last = self.flight.time, self.contacts[-1].end
        displacements, velocities = self._state()
        if self.line.is_standard and not self.line.separation(velocities) > 0.0:
            if now > longest_collision(
                self.problem.longest_body, self.problem.slow_stiffness, last
            ):
                raise unfinished_error(self.problem, now)
            self.overdue = now + self.patience
            return
        times = {"now": now, "last_contact": last, "shortest": self.shortest_seen}
        # Both particles in contact have the same rest position; therefore the difference between
        # their displacements is the gap.
        next_event = follow(self.problem, np.diff(displacements), velocities, **times)
        self.overdue = next_event.time + self.patience
        self.doubt = max(self.doubt, next_event.doubt)
        if next_event.ending is None:
            return
        self.ending = next_event.ending.doubted(self.doubt)
        self.ended_at, self.overdue = next_event.time, np.inf
        self.frames_until = now
        if self.frame_interval is not None or self.frames_at_contacts:
            quiet = sound_round_trip(self.problem.longest_body, self.problem.slow_stiffness)
            self.frames_until = min(self.ended_at, last + quiet)

    def _take_frame(self) -> None:
        now = self.flight.time
        displacements, velocities = self._state()
        self.frames.append((now, displacements, velocities))
        if self._dumps:
            self.chain.write_frame(now)
        if self.frame_interval is None or self.next_frame > now:
            return
        self.next_frame += self.frame_interval
        if self.next_frame <= now:
            # Choose the first frame time after the present time. A step may be longer than many
            # intervals. At large times, rounding may make the next frame time equal to the present
            # time.
            past = math.fmod(now - self.next_frame, self.frame_interval)
            later = now + (self.frame_interval - past)
            self.next_frame = max(later, math.nextafter(now, math.inf))

    def outcome(self, numerics: Numerics, seconds: float) -> Outcome:
        """Return the outcome of the collision."""
        assert self.ending is not None
        line, bond, contacts = self.line, self.bond, self.contacts
        first, targets = line.first, line.targets
        u, v = self.after_contact
        displacements, velocities = u[first:].copy(), v[first:].copy()
        if not np.all(np.isfinite(velocities)):
            raise RunError("the final velocities are not finite. Use a smaller timestep")
        return Outcome(
            problem=self.problem,
            engine="lammps",
            wall=numerics.wall,
            scheme=numerics.scheme,
            timestep=numerics.timestep,
            displacements=displacements,
            velocities=velocities,
            target_displacements=u[:targets][::-1].copy(),
            target_velocities=v[:targets][::-1].copy(),
            contact_times=np.array([contact.time for contact in contacts]),
            contact_speeds=np.array([contact.speed for contact in contacts]),
            impulses=np.array([contact.impulse for contact in contacts]),
            ending=self.ending,
            duration=max(self.flight.time, self.ended_at),
            bond_min=self.shortest,
            bond_max=self.longest,
            energy_start=self.problem.start_energy,
            energy_end=line.energy(bond, np.diff(u), v),
            fragments=count_fragments(np.diff(displacements), velocities, bond, line.chain_masses),
            seconds=seconds,
            force_evaluations=self.chain.stages_done,
            frames=Frames.of(line, *zip(*self.frames, strict=True)) if self.frames else None,
        )
