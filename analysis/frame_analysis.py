"""From the frames of a dump to the physics of the collision, in one pass and constant memory."""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chaincor.analysis.caveats import (
    collect_caveats,
    find_contradictions,
    is_over,
    mode_caveats,
)
from chaincor.analysis.contacts import contact_statistics
from chaincor.analysis.dumps.chain_frames import ChainState
from chaincor.analysis.dumps.collision_frames import CollisionFrames
from chaincor.analysis.dumps.contact_detection import ContactDetector
from chaincor.analysis.dumps.data_file import DeclaredMasses
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.masses import find_masses, mass_resolution
from chaincor.analysis.history import Record
from chaincor.analysis.modes import anharmonic_remainder, mode_energies, mode_frequencies
from chaincor.analysis.restitution import (
    EnergySplit,
    bond_strains,
    energy_split,
    kinematic_restitution,
    momentum_residual,
    restitution,
)
from chaincor.analysis.results import CollisionAnalysis
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError

# Sideways motion of this many v0 holds 1e-12 of the energy.
_SIDEWAYS = 1e-6
# An energy so little above that of the translation is that.
_ROUNDINGS = 1e-12

EndArgument = Callable[
    [float, NDArray[np.float64], NDArray[np.float64], float, Potential], str | None
]


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
) -> CollisionAnalysis:
    """
    Analyse a collision frame by frame.

    Parameters
    ----------
    frames : iterable of DumpFrame
        A :class:`~chaincor.analysis.dumps.dump.Dump`, or the frames of an MDAnalysis Universe.
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
    reading = CollisionFrames(iter(frames), timestep)
    velocity = reading.impact_velocity(impact_velocity)
    found = find_masses(reading.first, reading.layout, given=masses, declared=declared)
    m = np.ones(reading.layout.particles) if found is None else found
    total_mass = float(np.sum(m))
    reading.tell_moving_start(m, velocity)
    detector = ContactDetector(velocity, bond, reading.resolution, m)
    record = Record(m, bond)
    opening = state = parted = reading.opening
    touched = None
    for state in reading.states():
        if record.count == 0 and reading.begins_at_contact:
            if reading.start.kind in ("moving", "turned"):
                speed = abs(float(state.velocities[0]))
            else:
                speed = velocity
            detector.add_known(state.time, speed)
            state = _turned_round(state, speed)
        _refuse_impossible_bonds(state, bond)
        detector.feed(state)
        record.feed(state)
        if detector.last_time != touched:
            touched, parted = detector.last_time, state
    for frame in (reading.first, reading.last):
        _refuse_sideways(frame, velocity)
    detection = detector.result()
    if detection.times.size == 0:
        raise InputError(
            "the momentum of the chain never rises in the dump: no contact with the wall is in "
            "it; dump the run from before the first contact to after the last"
        )
    n, u, v = reading.layout.particles, state.displacements, state.velocities
    origin = detection.times[0]
    since = state.time - float(detection.times[-1])
    ending = energy_start = energy_end = remainder = drift = drift_before = None
    if bond is not None:
        energy_start = energy_split(opening.displacements, opening.velocities, bond, m)
        energy_end = energy_split(u, v, bond, m)
        energy_parted = energy_split(parted.displacements, parted.velocities, bond, m)
        drift_before, drift = (
            float((later.total - energy_start.total) / energy_start.total)
            for later in (energy_parted, energy_end)
        )
        remainder = float(anharmonic_remainder(u, bond))
        if end_argument is not None and np.all(m == m[0]):
            # A mass of 1 is taken there: in units of sqrt(m/k) the motion is the same.
            root = float(np.sqrt(m[0]))
            ending = end_argument(float(u[0]), bond_strains(u), root * v, since / root, bond)
    times = detection.times - origin
    statistics = contact_statistics(times, detection.speeds, n, velocity)
    stiffness = 1.0 if bond is None else bond.stiffness
    frequencies = mode_frequencies(n, stiffness, m)
    digits = reading.digits
    last_resolution = reading.last.resolution("vx", digits)
    caveats = collect_caveats(
        layout=reading.layout,
        first=reading.first,
        digits=digits,
        start=reading.start,
        bond=bond,
        state=state,
        masses=m,
        detection=detection,
        since_contact=since,
        ending=ending,
        drift=drift,
        drift_before=drift_before,
        truncated=is_truncated(),
        resolution=float(np.max(last_resolution)) / velocity,
    )
    # A given impact speed is exact; one that was read has the resolution of the dump.
    v0_resolution = 0.0
    if impact_velocity is None:
        v0_resolution = float(np.max(reading.first.resolution("vx", digits)))
    error = _restitution_precision(
        v, velocity, m, last_resolution, v0_resolution, reading.last_interval
    )
    e = float(kinematic_restitution(v, velocity, m))
    uncertain = mass_resolution(reading.first, reading.layout, m)
    error += 2.0 * abs(e) * float(uncertain @ np.abs(v / velocity - e)) / total_mass
    eta = float(restitution(v, velocity, m))
    moving = reading.start.kind in ("moving", "turned")
    bound = _largest_restitution(energy_start, total_mass, velocity, moving)
    contradictions = find_contradictions(eta, error, detection, bound)
    return CollisionAnalysis(
        particles=n,
        masses=m,
        bond=bond,
        velocity=velocity,
        restitution=eta,
        restitution_bound=bound,
        kinematic_restitution=e,
        restitution_error=None,
        data_error=error,
        contact_times=times,
        contact_speeds=detection.speeds,
        contact_statistics=statistics,
        contacts=(
            None if detection.unresolved or reading.start.kind == "late" else statistics.count
        ),
        detection=detection,
        mode_frequencies=frequencies,
        mode_energies=mode_energies(u, v, stiffness, m),
        mode_energies_start=mode_energies(opening.displacements, opening.velocities, stiffness, m),
        anharmonic_remainder=remainder,
        energy_start=energy_start,
        energy_end=energy_end,
        energy_drift=drift,
        momentum_residual=momentum_residual(v, velocity, detection.speeds, m),
        bond_min=record.bond_min,
        bond_max=record.bond_max,
        frames=record.count,
        timestep=None if reading.layout.time_known else timestep,
        time_start=float(opening.time - origin),
        time_end=float(state.time - origin),
        ending=ending,
        finished=is_over(state, m, bond, since, ending),
        history=record.history(origin),
        contradictions=contradictions,
        caveats=(*contradictions, *notes, *caveats, *mode_caveats(frequencies)),
    )


def _turned_round(state: ChainState, speed: float) -> ChainState:
    """Return the state right after the first contact."""
    velocities = state.velocities.copy()
    velocities[0] = speed
    return ChainState(state.step, state.time, state.displacements, velocities)


def _largest_restitution(
    energy_start: EnergySplit | None, total_mass: float, impact_velocity: float, moving: bool
) -> float | None:
    """Return eta if all energy of the first frame became translation; None where not known."""
    if energy_start is None:
        return None if moving else 1.0
    bound = float(energy_start.total) / (0.5 * total_mass * impact_velocity**2)
    return bound if bound > 1.0 + _ROUNDINGS else 1.0


def _restitution_precision(
    velocities: NDArray[np.float64],
    impact_velocity: float,
    masses: NDArray[np.float64],
    resolution: NDArray[np.float64],
    impact_resolution: float,
    steps_after: int,
) -> float:
    """Propagate the half-units of printed velocities into eta; a bound, not a deviation."""
    e = abs(float(kinematic_restitution(velocities, impact_velocity, masses)))
    total = float(np.sum(masses))
    printed = float(np.sum(masses * resolution)) / total
    # The run itself goes on to at most one frame more, each step rounding every velocity, and
    # LAMMPS adds up n products in an order of its own, each addition rounding.
    size = float(np.sum(masses * np.abs(velocities))) / total
    rounded = (masses.size + steps_after) * float(np.finfo(float).eps) * size
    return 2.0 * e * (printed + rounded + e * impact_resolution) / impact_velocity


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
