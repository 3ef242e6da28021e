"""The course of one collision in LAMMPS: contacts, bonds, frames and the end."""

import numpy as np
from numpy.typing import NDArray

from lammps_inputs.numerics import Numerics
from lammps_inputs.scene import Scene
from workflows.engines.ending import argue_end, find_fragments, longest_collision, look_interval
from workflows.engines.lammps_blind import BlindBound
from workflows.engines.lammps_flight import Flight, VerletFlight
from workflows.engines.lammps_lookahead import LookAhead
from workflows.engines.outcome import Frames, Outcome
from workflows.errors import (
    BarrierError,
    BondRangeError,
    CrossingError,
    LostAtomsError,
    RunError,
    UnfinishedCollisionError,
)

# Contacts are 1.4 to 2.3 apart, in units of 1/sqrt(U''), and seldom more than this: a look ahead
# that meets one is cheap, but for nothing.
_PATIENCE = 3.5


class ChainCollision:
    """
    The course of one collision: contacts, looks for the end, frames.

    Parameters
    ----------
    scene : Scene
        The collision.
    flight : Flight
        What carries the chain from contact to contact.
    frame_interval : float or None
        Least time between frames; None for those of the scene's dump, if it has one: at
        contacts, or so many per sound crossing.
    blind : BlindBound or None
        For looking ahead; None for a single particle.
    """

    def __init__(
        self,
        scene: Scene,
        flight: Flight,
        frame_interval: float | None,
        blind: BlindBound | None,
    ) -> None:
        self.scene = scene
        self.bond = scene.bond
        self.flight = flight
        self.chain = flight.chain
        self.contacts: list[tuple[float, float]] = []
        self.rest = np.arange(scene.particles, dtype=float)
        self.after_contact = self._state()
        self.shortest, self.longest = np.inf, -np.inf
        self.ending: str | None = None
        dumped = scene.dump is not None and frame_interval is None
        self.frames_at_contacts = dumped and scene.dump_frames == "contacts"
        if dumped and not isinstance(scene.dump_frames, str):
            frame_interval = scene.particles / scene.dump_frames
        self.frame_interval = frame_interval
        self.next_frame = np.inf if frame_interval is None else 0.0
        self.frames: list[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = []
        # How long after a contact, and when, a next one would be late.
        self.patience = _PATIENCE / self.bond.stiffness**0.5
        self.overdue = np.inf
        # Frames have to be exact to the end.
        self.look_ahead = None
        wants_frames = self.frames_at_contacts or frame_interval is not None
        if blind is not None and not wants_frames:
            reflect = isinstance(flight, VerletFlight) and flight.reflect
            self.look_ahead = LookAhead(scene, self.chain, blind, reflect)

    def _state(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return self.chain.x - self.rest, self.chain.v.copy()

    def carry_out(self) -> None:
        """Go from contact to contact until no further one can come."""
        n, stiffness = self.scene.particles, self.bond.stiffness
        cap = longest_collision(n, stiffness)
        interval = look_interval(n, stiffness)
        next_look = interval
        while self.ending is None:
            try:
                contact = self.flight.advance(min(next_look, self.next_frame, self.overdue))
            except BondRangeError as error:
                raise self._named(error) from None
            except OverflowError:
                raise LostAtomsError(
                    f"coordinates at time {self.flight.time:g} are beyond all numbers; expected a "
                    "stable integration: use a smaller timestep"
                ) from None
            if contact is not None:
                self.contacts.append((contact.time, contact.speed))
                self.after_contact = self._state()
                if self.frames_at_contacts:
                    self._take_frame()
                if self.look_ahead is not None:
                    self.overdue = contact.time + self.patience
            self._watch_bonds()
            now = self.flight.time
            if now >= self.overdue:
                self.overdue = np.inf
                self._settle()
                continue
            if now >= self.next_frame:
                self._take_frame()
            if now >= next_look:
                next_look = now + interval
                self._look_for_end()
                if self.ending is not None and self.frames and self.frames[-1][0] < now:
                    self._take_frame()
                if now > cap and self.ending is None:
                    raise UnfinishedCollisionError(
                        f"after a time of {now:g} particle 1 may still hit the wall; expected an "
                        f"end within {cap:g}: check the potential, or use a smaller timestep"
                    )

    def _named(self, error: BondRangeError) -> BondRangeError:
        """Say which bond it was, and when: LAMMPS tells only its length."""
        lengths = np.abs(np.diff(self.chain.x))
        bond = int(np.argmin(np.abs(lengths - error.length))) + 1
        side = "below" if error.length < 1.0 else "beyond"
        named = BondRangeError(
            f"bond {bond} is {error.length:.6g} long, {side} the end of its table, after step "
            f"{self.chain.stages_done} at time {self.flight.time:.6g}"
        )
        named.length = error.length
        return named

    def _watch_bonds(self) -> None:
        if self.scene.particles == 1:
            return
        x = self.chain.x
        lengths = x[1:] - x[:-1]  # half the time of np.diff
        shortest, longest = float(lengths.min()), float(lengths.max())
        if not shortest > 0.0:
            bond = int(np.argmin(lengths)) + 1
            raise CrossingError(
                f"bond {bond} is {shortest:g} long at time {self.flight.time:g}; LAMMPS knows only "
                "its absolute length, so particles that pass through each other come out wrong: "
                "lower the speed or the timestep, or use engine 'reference'"
            )
        self.shortest = min(self.shortest, shortest)
        self.longest = max(self.longest, longest)
        barrier = getattr(self.bond, "barrier_strain", np.inf)
        if longest - 1.0 > barrier:
            bond = int(np.argmax(lengths)) + 1
            raise BarrierError(
                f"bond {bond} is {longest:g} long at time {self.flight.time:g}, beyond the barrier "
                f"of its potential at {1.0 + barrier:g}, from where it runs away; expected bonds "
                "that hold: lower the speed"
            )

    def _look_for_end(self) -> None:
        since = self.flight.time - self.contacts[-1][0]
        chain = self.chain
        # While contacts follow one another there is no end to argue.
        if since < self.patience or float(chain.v.sum()) <= 0.0:
            return
        self.ending = argue_end(
            float(chain.x[0]),
            np.diff(chain.x - self.rest),
            chain.v.copy(),
            since,
            self.bond,
        )
        if self.ending is None and self.look_ahead is not None:
            self._settle()

    def _settle(self) -> None:
        assert self.look_ahead is not None
        settled = self.look_ahead.settle(self.flight.time, self.contacts[-1][0], self.shortest)
        if settled is not None:
            self.flight.time, self.ending = settled
            self._watch_bonds()

    def _take_frame(self) -> None:
        now = self.flight.time
        displacements, velocities = self._state()
        self.frames.append((now, displacements, velocities))
        if self.scene.dump is not None:
            self.chain.write_frame(now)
        while self.frame_interval is not None and self.next_frame <= now:
            self.next_frame += self.frame_interval

    def outcome(self, numerics: Numerics, seconds: float) -> Outcome:
        """Gather what is known at the end."""
        assert self.ending is not None
        displacements, velocities = self.after_contact
        times, speeds = np.array(self.contacts).T
        strains = np.diff(displacements)
        energy_end = 0.5 * float(velocities @ velocities) + float(np.sum(self.bond.energy(strains)))
        frames = None
        if self.frames:
            frame_times, frame_displacements, frame_velocities = zip(*self.frames, strict=True)
            frames = Frames(
                np.array(frame_times), np.array(frame_displacements), np.array(frame_velocities)
            )
        last = self.chain.x - self.rest
        fragments = find_fragments(np.diff(last), self.chain.v.copy(), self.bond)
        single = self.scene.particles == 1
        if not np.all(np.isfinite(velocities)):
            raise RunError("the final velocities are not finite; use a smaller timestep")
        return Outcome(
            engine="lammps",
            wall=numerics.wall,
            scheme=numerics.scheme,
            timestep=numerics.timestep,
            displacements=displacements,
            velocities=velocities,
            contact_times=times,
            contact_speeds=speeds,
            impulses=2.0 * speeds,
            ending=self.ending,
            duration=self.flight.time,
            bond_min=1.0 if single else self.shortest,
            bond_max=1.0 if single else self.longest,
            energy_start=0.5 * self.scene.particles * self.scene.impact_velocity**2,
            energy_end=energy_end,
            fragments=len(fragments.sizes),
            seconds=seconds,
            force_evaluations=self.chain.stages_done,
            frames=frames,
        )
