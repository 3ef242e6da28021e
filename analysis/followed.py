"""What the frames of a collision show, in one pass and constant memory."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.collision_frames import CollisionFrames
from chaincor.analysis.dumps.contact_detection import ContactDetector, DetectedContacts
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.history import Record
from chaincor.analysis.known import Known
from chaincor.analysis.restitution import bond_strains
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError

# Sideways motion of this many v0 holds 1e-12 of the energy.
_SIDEWAYS = 1e-6


@dataclass(frozen=True, eq=False)
class Followed:
    """What the frames of a collision show, from the first to the last."""

    masses: Sequence[Array]  #: Of the chain, and of a free target, from the contact outward.
    velocity: float  #: Impact speed v0.
    #: In the first frame, in the first after the last contact, in the last.
    opening: ChainState
    parted: ChainState  #: See ``opening``.
    last: ChainState  #: See ``opening``.
    since_contact: float  #: Time from the last contact to the last frame.
    detection: DetectedContacts  #: The contacts.
    records: list[Record]  #: All states in short, of each body.


def follow(
    reading: CollisionFrames, masses: Sequence[Array], velocity: float, known: Known
) -> Followed:
    """
    Read all frames of a collision.

    Parameters
    ----------
    reading : CollisionFrames
        The frames, of which the first has been read.
    masses : sequence of ndarray
        Of the chain, and of a free target.
    velocity : float
        Impact speed v0.
    known : Known
        The bond, and what meets.

    Returns
    -------
    Followed
        What they show.

    Raises
    ------
    InputError
        If they hold no contact, or what cannot be.
    """
    bond, bodies = known.bond, known.bodies
    detector = ContactDetector(velocity, masses, bond, reading.resolution, bodies.soft)
    records = [Record(each, bond) for each in masses]
    first = None if bodies.soft else reading.first_contact(masses, velocity)
    state = parted = reading.opening
    touched = None
    for state in reading.states():
        if first is not None and records[0].count == 0:
            detector.add_known(state.time, first[0])
            state = first[1]
        for record, each in zip(records, state.bodies, strict=True):
            _refuse_impossible_bonds(each, bond)
            record.feed(each)
        detector.feed(state)
        if detector.last_time != touched:
            touched, parted = detector.last_time, state
    for frame in (reading.first, reading.last):
        _refuse_sideways(frame, velocity)
    if touched is None:
        raise InputError(
            "the momentum of the chain never rises in the dump: no contact with the "
            f"{'target' if bodies.targets else 'wall'} is in it; dump the run from before the "
            "first contact to after the last"
        )
    since = state.time - touched
    return Followed(
        masses, velocity, reading.opening, parted, state, since, detector.result(), records
    )


def _refuse_sideways(frame: DumpFrame, impact_velocity: float) -> None:
    """Refuse motion that a one-dimensional analysis would leave out."""
    for name in {"vy", "vz"}.intersection(frame.columns):
        largest = float(np.max(np.abs(frame.column(name))))
        if not largest <= _SIDEWAYS * impact_velocity:
            raise InputError(
                f"particles move sideways in the frame of step {frame.step}: {name} is up to "
                f"{largest:.3g}; expected a chain that moves along x alone"
            )


def _refuse_impossible_bonds(state: ChainState, bond: Potential | None) -> None:
    if bond is None or state.displacements.size < 2:
        return
    strains = bond_strains(state.displacements)
    outside = np.flatnonzero((strains <= bond.strain_min) | (strains > bond.strain_max))
    if outside.size:
        raise InputError(
            f"bond {outside[0] + 1} is {1.0 + strains[outside[0]]:.6g} long in the frame of step "
            f"{state.step}, where the potential '{bond.name}' has no energy; expected the "
            "potential of the run, and particles that stay apart"
        )
