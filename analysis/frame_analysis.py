"""From the frames of a dump to the physics of the collision, in one pass and constant memory."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chaincor.analysis.caveats import (
    Ending,
    collect_caveats,
    find_contradictions,
    mode_caveats,
)
from chaincor.analysis.contacts import contact_statistics
from chaincor.analysis.dumps.chain_frames import ChainState
from chaincor.analysis.dumps.collision_frames import CollisionFrames
from chaincor.analysis.dumps.contact_detection import ContactDetector, DetectedContacts
from chaincor.analysis.dumps.data_file import DeclaredMasses
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.masses import mass_resolution, masses_of_bodies
from chaincor.analysis.history import Record
from chaincor.analysis.modes import anharmonic_remainder, mode_energies, mode_frequencies
from chaincor.analysis.restitution import (
    EnergySplit,
    bond_strains,
    centre_of_mass_velocity,
    energy_split,
    momentum_residual,
)
from chaincor.analysis.results import BodyAnalysis, CollisionAnalysis
from chaincor.analysis.start import Start
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError

# Sideways motion of this many v0 holds 1e-12 of the energy.
_SIDEWAYS = 1e-6
# An energy so little above that of the translation is that.
_ROUNDINGS = 1e-12
# Digits of the shortest formats of dumps.
_SAME_SPEED = 1e-4

EndArgument = Callable[
    [float, NDArray[np.float64], NDArray[np.float64], float, Potential], str | None
]


@dataclass(frozen=True)
class Bodies:
    """
    What meets: a chain and a hard wall, unless it is said otherwise.

    Attributes
    ----------
    targets : int
        Particles of a free target; 0 for a wall.
    soft : bool
        Whether the bodies overlap when they meet.
    """

    targets: int = 0
    soft: bool = False


CHAIN_AND_WALL = Bodies()


def analyze_frames(
    frames: Iterable[DumpFrame],
    *,
    bond: Potential | None = None,
    impact_velocity: float | None = None,
    timestep: float | None = None,
    masses: ArrayLike | None = None,
    declared: DeclaredMasses | None = None,
    end_argument: EndArgument | None = None,
    notes: Iterable[str] = (),
    is_truncated: Callable[[], bool] = lambda: False,
    bodies: Bodies = CHAIN_AND_WALL,
) -> CollisionAnalysis:
    """
    Analyse a collision frame by frame.

    Parameters
    ----------
    frames : iterable of DumpFrame
        Such as a :class:`~chaincor.analysis.dumps.dump.Dump`.
    bond : Potential, optional
        The bonds' potential: gives energies, and contacts whatever the spacing of the frames.
    impact_velocity : float, optional
        v0; read off the first frame by default.
    timestep : float, optional
        Simulated time per step, for dumps that do not carry the time.
    masses : array_like, optional
        Particle masses from the wall outwards, repeated along the chain; see
        :func:`~chaincor.analysis.dumps.masses.find_masses`. Those of the dump, else 1, by default.
    declared : DeclaredMasses, optional
        Masses by type, from the files of the job.
    end_argument : callable, optional
        ``f(u_1, strains, velocities, time_since_contact, bond)`` returning why no contact can
        follow, or None; asked where all masses are alike. Without it only the time since the last
        contact speaks.
    notes : iterable of str
        Caveats known beforehand.
    is_truncated : callable
        Says, after the last frame, whether the dump was cut short.
    bodies : Bodies
        What meets.

    Returns
    -------
    CollisionAnalysis
        All results.

    Raises
    ------
    InputError
        If the frames do not show a collision of a chain, a number given is not positive or
        contradicts the dump, or masses differ and are not known.
    """
    for name, given in (("velocity", impact_velocity), ("timestep", timestep)):
        if given is not None and not 0.0 < given < np.inf:
            raise InputError(f"the {name} is {given}; expected a positive finite number")
    reading = CollisionFrames(iter(frames), timestep, bodies.targets)
    both = masses_of_bodies(reading.first, reading.layout, given=masses, declared=declared)
    if bodies.targets:
        velocity = _approach(reading, both, impact_velocity)
    else:
        velocity = reading.impact_velocity(impact_velocity)
    reading.tell_moving_start(both[0], velocity)
    seen = _follow(reading, both, bond, velocity, bodies)
    opening, state, detection = reading.opening, seen.last, seen.detection
    origin = opening.time if bodies.soft else float(detection.times[0])
    energies = [_energies(each, both, bond) for each in (opening, seen.parted, state)]
    argument = drifts = remainder = None
    if bond is not None:
        totals = [sum(float(part.total) for part in each if part is not None) for each in energies]
        drifts = (totals[1] - totals[0]) / totals[0], (totals[2] - totals[0]) / totals[0]
        remainder = float(anharmonic_remainder(state.displacements, bond))
        if end_argument is not None and bodies == CHAIN_AND_WALL:
            argument = _argue(end_argument, state, both[0], seen.since_contact, bond)
    ending = Ending(state, both, bond, seen.since_contact, argument)
    chain, *others = (
        {
            "masses": m,
            "history": record.history(origin),
            "energy_start": before,
            "energy_end": after,
            **_modes(m, first, last, 1.0 if bond is None else bond.stiffness),
        }
        for m, record, before, after, first, last in zip(
            both, seen.records, energies[0], energies[2], opening.bodies, state.bodies, strict=True
        )
    )
    statistics = contact_statistics(
        detection.times - origin, detection.speeds, both[0].size, velocity
    )
    e = state.separation(both) / velocity
    given_exactly = impact_velocity is not None and not bodies.targets
    error = _restitution_precision(reading, state, both, e, velocity, given_exactly)
    moving = reading.start.kind in ("moving", "turned")
    bound = _largest_restitution(energies[0], opening, both, velocity, moving)
    contradictions = find_contradictions(e**2, error, detection, bound)
    caveats = collect_caveats(
        reading, velocity, detection, ending, drifts=drifts, truncated=is_truncated()
    )
    for body in (chain, *others):
        caveats += mode_caveats(body["mode_frequencies"])
    uncounted = detection.unresolved or reading.start.kind == "late" or bodies.soft
    means = [
        float(centre_of_mass_velocity(body.velocities, m))
        for body, m in zip(state.bodies, both, strict=True)
    ]
    return CollisionAnalysis(
        **chain,
        particles=both[0].size,
        bond=bond,
        velocity=velocity,
        restitution=e**2,
        restitution_bound=bound,
        kinematic_restitution=e,
        restitution_error=None,
        data_error=error,
        contact_times=detection.times - origin,
        contact_speeds=detection.speeds,
        contact_statistics=statistics,
        contacts=None if uncounted else statistics.count,
        detection=detection,
        anharmonic_remainder=remainder,
        energy_drift=None if drifts is None else drifts[1],
        momentum_residual=_momentum_residual(state, opening, both, velocity, detection),
        bond_min=min(record.bond_min for record in seen.records),
        bond_max=max(record.bond_max for record in seen.records),
        frames=seen.records[0].count,
        timestep=None if reading.layout.time_known else timestep,
        time_start=float(opening.time - origin),
        time_end=float(state.time - origin),
        ending=argument,
        finished=ending.finished,
        contradictions=contradictions,
        caveats=(*contradictions, *notes, *caveats),
        velocity_after=means[0],
        soft=bodies.soft,
        target=BodyAnalysis(**others[0], velocity_after=-means[1]) if others else None,
    )


@dataclass(frozen=True)
class _Followed:
    """What frames showed: contacts, all states in short, that after the last contact, the last."""

    detection: DetectedContacts
    records: list[Record]
    parted: ChainState
    last: ChainState
    since_contact: float


def _follow(
    reading: CollisionFrames,
    masses: Sequence[NDArray[np.float64]],
    bond: Potential | None,
    velocity: float,
    bodies: Bodies,
) -> _Followed:
    """Read all frames; InputError where they hold no contact, or what cannot be."""
    detector = ContactDetector(
        velocity,
        bond,
        reading.resolution,
        masses[0],
        target_masses=masses[1] if bodies.targets else np.empty(0),
        soft=bodies.soft,
    )
    records = [Record(each, bond) for each in masses]
    state = parted = reading.opening
    touched = None
    for state in reading.states():
        if records[0].count == 0 and reading.begins_at_contact and not bodies.soft:
            moving = reading.start.kind in ("moving", "turned")
            speed = abs(state.opening) if moving or bodies.targets else velocity
            detector.add_known(state.time, speed)
            if bodies.targets:
                state = _exchanged(state, masses) if state.opening < 0.0 else state
            else:
                state = _turned_round(state, speed)
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
    return _Followed(detector.result(), records, parted, state, state.time - touched)


def _argue(
    argument: EndArgument,
    state: ChainState,
    masses: NDArray[np.float64],
    since: float,
    bond: Potential,
) -> str | None:
    """Return why no contact with the wall follows, where masses are alike."""
    if not np.all(masses == masses[0]):
        return None
    # A mass of 1 is taken there: in units of sqrt(m/k) the motion is the same.
    root = float(np.sqrt(masses[0]))
    strains = bond_strains(state.displacements)
    return argument(state.gap, strains, root * state.velocities, since / root, bond)


def _modes(
    masses: NDArray[np.float64], first: ChainState, last: ChainState, stiffness: float
) -> dict[str, NDArray[np.float64]]:
    """Return frequencies and energies of the modes of a body."""
    return {
        "mode_frequencies": mode_frequencies(masses.size, stiffness, masses),
        "mode_energies": mode_energies(last.displacements, last.velocities, stiffness, masses),
        "mode_energies_start": mode_energies(
            first.displacements, first.velocities, stiffness, masses
        ),
    }


def _approach(
    reading: CollisionFrames, masses: Sequence[NDArray[np.float64]], given: float | None
) -> float:
    """Return how fast a chain and a free target come together in the first frame."""
    opening = reading.opening
    v0 = -opening.separation(masses)
    if opening.gap == 0.0 and opening.opening > 0.0:
        # The frame may be that right after the first contact, before which they came faster.
        share = sum(1.0 / float(np.sum(m)) for m in masses) / sum(1.0 / m[0] for m in masses)
        before = v0 + 2.0 * float(opening.opening * share)
        known = (
            _is_cold(_exchanged(opening, masses), reading.resolution)
            if given is None
            else (abs(before / given - 1.0) <= _SAME_SPEED)
        )
        if known:
            reading.start = Start("turned", None)
            return before
    if not v0 > 0.0:
        raise InputError(
            f"the bodies move apart with {-v0:.6g} in the first frame; expected a dump that begins "
            "before they meet, with the chain at larger x than the target"
        )
    if given is not None and abs(v0 / given - 1.0) > _SAME_SPEED:
        raise InputError(
            f"the bodies come together with {v0:.9g} in the first frame, in the scene with "
            f"{given:.9g}; expected a dump of that job from before their contact"
        )
    return v0


def _exchanged(state: ChainState, masses: Sequence[NDArray[np.float64]]) -> ChainState:
    """Return the state on the other side of a contact of a chain and a target."""
    velocities, target = state.velocities.copy(), state.target_velocities.copy()
    push = 2.0 * state.opening / (1.0 / masses[0][0] + 1.0 / masses[1][0])
    velocities[0] -= push / masses[0][0]
    target[0] += push / masses[1][0]
    return replace(state, velocities=velocities, target_velocities=target)


def _is_cold(state: ChainState, resolution: float) -> bool:
    """Return whether all particles of each body fly alike."""
    slack = 8.0 * resolution + 1e-9 * float(np.max(np.abs(state.all_velocities)))
    return all(np.ptp(body.velocities) <= slack for body in state.bodies)


def _energies(
    state: ChainState, masses: Sequence[NDArray[np.float64]], bond: Potential | None
) -> list[EnergySplit | None]:
    """Return the energy of each body; None where the bond is not known."""
    return [
        None if bond is None else energy_split(body.displacements, body.velocities, bond, m)
        for body, m in zip(state.bodies, masses, strict=True)
    ]


def _momentum_residual(
    state: ChainState,
    opening: ChainState,
    masses: Sequence[NDArray[np.float64]],
    velocity: float,
    detection: DetectedContacts,
) -> float:
    """Return what a wall's contacts do not explain, of two bodies by how much both have changed."""
    if len(masses) == 1:
        if detection.method == "none":
            return 0.0  # a soft wall takes any momentum
        return momentum_residual(state.velocities, velocity, detection.speeds, masses[0])
    # Mirrored, the target's counts the other way.
    both = [
        sum(
            sign * float(m @ body.velocities)
            for sign, m, body in zip((1.0, -1.0), masses, each.bodies, strict=True)
        )
        for each in (opening, state)
    ]
    return abs(both[1] - both[0]) / (float(np.sum(masses[0])) * velocity)


def _turned_round(state: ChainState, speed: float) -> ChainState:
    """Return the state right after the first contact with a wall."""
    velocities = state.velocities.copy()
    velocities[0] = speed
    return replace(state, velocities=velocities)


def _largest_restitution(
    energies: Sequence[EnergySplit | None],
    opening: ChainState,
    masses: Sequence[NDArray[np.float64]],
    impact_velocity: float,
    moving: bool,
) -> float | None:
    """Return eta if all energy of the first frame became relative motion; None if not known."""
    known = [float(energy.total) for energy in energies if energy is not None]
    if not known:
        return None if moving else 1.0
    reduced = 1.0 / sum(1.0 / float(np.sum(m)) for m in masses)
    energy = sum(known)
    if len(masses) > 1:
        # What both do as one body stays.
        momentum = sum(
            sign * float(m @ body.velocities)
            for sign, m, body in zip((1.0, -1.0), masses, opening.bodies, strict=True)
        )
        energy -= 0.5 * momentum**2 / sum(float(np.sum(m)) for m in masses)
    bound = energy / (0.5 * reduced * impact_velocity**2)
    return bound if bound > 1.0 + _ROUNDINGS else 1.0


def _restitution_precision(
    reading: CollisionFrames,
    state: ChainState,
    masses: Sequence[NDArray[np.float64]],
    e: float,
    impact_velocity: float,
    given: bool,
) -> float:
    """Propagate the half-units of printed velocities into eta; a bound, not a deviation."""
    epsilon = float(np.finfo(float).eps)

    def off(frame: DumpFrame, steps: int) -> float:
        """Return how far the relative velocity in a frame may be off."""
        half = reading.layout.by_body(frame.resolution("vx", reading.digits))
        printed = sum(
            float(np.sum(m * h)) / float(np.sum(m)) for m, h in zip(masses, half, strict=True)
        )
        # The run itself goes on to at most one frame more, each step rounding every velocity, and
        # LAMMPS adds up n products in an order of its own, each addition rounding.
        sizes = zip(masses, state.bodies, strict=True)
        return printed + sum(
            (m.size + steps) * epsilon * float(np.sum(m * np.abs(body.velocities))) / np.sum(m)
            for m, body in sizes
        )

    # A given impact speed is exact; one that was read has the resolution of the dump.
    read = 0.0
    if not given:
        largest = float(np.max(reading.first.resolution("vx", reading.digits)))
        read = largest if len(masses) == 1 else off(reading.first, 0)
    error = 2.0 * abs(e) * (off(reading.last, reading.last_interval) + abs(e) * read)
    uncertain = mass_resolution(reading.first, reading.layout, masses[0])
    miss = np.abs(state.velocities / impact_velocity - e)
    total = float(np.sum(masses[0]))
    return error / impact_velocity + 2.0 * abs(e) * float(uncertain @ miss) / total


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
