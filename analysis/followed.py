"""Read a dump's frames once: find contacts, judge the end, and bound the error of digits."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chaincor.analysis.collision_frames import CollisionFrames
from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.contact_detection import ContactDetector, DetectedContacts
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.masses import mass_resolution
from chaincor.analysis.history import Record
from chaincor.analysis.modes import are_equal
from chaincor.analysis.restitution import bond_strains
from chaincor.lammps_inputs.bonds.potential import Potential, stiffness_of
from chaincor.lammps_inputs.errors import InputError

# Largest accepted velocity along y or z, divided by v0. Motion at this velocity has 1e-12 of the
# energy at impact.
_SIDEWAYS = 1e-6


@dataclass(frozen=True, eq=False)
class Followed:
    """Data collected from all frames of a collision."""

    reading: CollisionFrames  #: Frames, which have been read to the end.
    parted: ChainState  #: State in the first frame after the last contact.
    last: ChainState  #: State in the last frame.
    since_contact: float  #: Time from the last contact to the last frame.
    detection: DetectedContacts  #: Contacts, and how they were found.
    records: list[Record]  #: Motion and energies in time, one record for each body.

    @property
    def parting(self) -> bool:
        """Whether the chain recedes."""
        return self.last.separation(self.reading.masses) > 0.0

    @property
    def alone(self) -> bool:
        """Whether each body is a single particle. Then only one contact is possible."""
        return all(m.size == 1 for m in self.reading.masses)

    @property
    def sound_returns(self) -> float:
        """Time that sound needs to cross the longer body and come back."""
        root = stiffness_of(self.reading.known.bond) ** 0.5
        # Long waves are the fastest, and their speed depends on the mean mass.
        return max(2.0 * m.size * float(np.mean(m)) ** 0.5 / root for m in self.reading.masses)

    @cached_property
    def argument(self) -> str | None:
        """Why no further contact with a hard wall follows: ``proved``, ``argued``, or None."""
        known, masses, last = self.reading.known, self.reading.masses[0], self.last
        ask, bond = known.end_argument, known.bond
        if bond is None or ask is None or known.targets or known.soft or not are_equal(masses):
            return None
        # The argument assumes masses of 1. With time in units of sqrt(m/k), chains of any mass m
        # move alike.
        root = float(np.sqrt(masses[0]))
        strains, since = bond_strains(last.displacements), self.since_contact / root
        return ask(last.gap, strains, root * last.velocities, since, bond)

    @property
    def finished(self) -> bool:
        """
        Whether the collision is over in the last frame, as far as the frames show.

        The chain must recede. In addition, a proof or argument must exclude later contacts, or the
        time since the last contact must exceed the time in which sound crosses the longer body and
        returns.
        """
        known = self.alone or self.argument is not None
        return self.parting and (known or self.since_contact > self.sound_returns)


def follow_frames(reading: CollisionFrames) -> Followed:
    """Read all frames of a collision; raise InputError for impossible data or without a contact."""
    known, masses, velocity = reading.known, reading.masses, reading.velocity
    detector = ContactDetector(velocity, masses, known.bond, reading.resolution, known.soft)
    records = [Record(each, known.bond) for each in masses]
    first = None if known.soft else reading.first_contact()
    state = parted = reading.first_state
    touched = None
    for state in reading.states():
        if first is not None and records[0].count == 0:
            detector.add_known(state.time, first[0])
            state = first[1]
        for record, each in zip(records, state.bodies, strict=True):
            _refuse_impossible_bonds(each, known.bond)
            record.feed(each)
        detector.feed(state)
        if detector.last_time != touched:
            touched, parted = detector.last_time, state
    for frame in (reading.first, reading.last):
        _refuse_sideways(frame, velocity)
    if touched is None:
        raise InputError(
            "the momentum of the chain never rises in the dump, so the dump shows no contact "
            f"with the {'target' if known.targets else 'wall'}. Dump the run from before the "
            "first contact to after the last"
        )
    return Followed(reading, parted, state, state.time - touched, detector.result(), records)


def restitution_precision(seen: Followed, e: float) -> float:
    """
    Return a bound on the error of eta due to the printed digits of a dump.

    The bound propagates an error of half a unit in the last printed digit. `e` is the ratio of
    speeds.
    """
    reading, state = seen.reading, seen.last
    masses, digits, known = reading.masses, reading.digits, reading.known
    epsilon = float(np.finfo(float).eps)

    def off(frame: DumpFrame, steps: int) -> float:
        """Return the largest error of the relative velocity in a frame."""
        half = reading.layout.by_body(frame.resolution("vx", digits))
        printed = sum(
            float(np.sum(m * h)) / float(np.sum(m)) for m, h in zip(masses, half, strict=True)
        )
        # LAMMPS computes eta at most one dump interval after this frame, and every step rounds all
        # velocities once more. LAMMPS also sums the n products of mass and velocity in another
        # order, with one rounding per addition.
        sizes = zip(masses, state.bodies, strict=True)
        return printed + sum(
            (m.size + steps) * epsilon * float(np.sum(m * np.abs(body.velocities))) / np.sum(m)
            for m, body in sizes
        )

    read = 0.0
    # If the chain hits a wall, a given impact speed has no rounding error.
    if known.targets:
        read = off(reading.first, 0)
    elif known.impact_velocity is None:
        read = float(np.max(reading.first.resolution("vx", digits)))
    error = 2.0 * abs(e) * (off(reading.last, reading.last_interval) + abs(e) * read)
    uncertain = mass_resolution(reading.first, reading.layout, masses[0])
    miss = np.abs(state.velocities / reading.velocity - e)
    total = float(np.sum(masses[0]))
    return error / reading.velocity + 2.0 * abs(e) * float(uncertain @ miss) / total


def _refuse_sideways(frame: DumpFrame, impact_velocity: float) -> None:
    """Refuse sideways motion, which a one-dimensional analysis would ignore."""
    for name in {"vy", "vz"}.intersection(frame.columns):
        largest = float(np.max(np.abs(frame.column(name))))
        if not largest <= _SIDEWAYS * impact_velocity:
            raise InputError(
                f"particles move sideways in the frame of step {frame.step}: {name} is up to "
                f"{largest:.3g}. Give a chain that moves only along x"
            )


def _refuse_impossible_bonds(state: ChainState, bond: Potential | None) -> None:
    if bond is None or state.displacements.size < 2:
        return
    strains = bond_strains(state.displacements)
    outside = np.flatnonzero((strains <= bond.strain_min) | (strains > bond.strain_max))
    if outside.size:
        raise InputError(
            f"bond {outside[0] + 1} is {1.0 + strains[outside[0]]:.6g} long in the frame of "
            f"step {state.step}, where the potential '{bond.name}' has no energy. Give the "
            "potential of the run, and check that no particles overlap"
        )
