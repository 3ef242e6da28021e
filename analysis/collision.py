"""From the frames of a dump to the physics of the collision, in one pass and constant memory."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from analysis.caveats import collect_caveats
from analysis.chain_frames import ChainLayout, ChainState
from analysis.contact_detection import ContactDetector
from analysis.contacts import contact_statistics
from analysis.dump_frame import DumpFrame
from analysis.history import Thinned
from analysis.modes import anharmonic_remainder, mode_energies, mode_frequencies
from analysis.restitution import (
    bond_strains,
    energy_split,
    kinematic_restitution,
    momentum_residual,
    restitution,
)
from analysis.results import CollisionAnalysis, History
from analysis.start import Start, find_start
from lammps_inputs.errors import InputError
from lammps_inputs.potential import Potential

# Whole states are kept for pictures only: as many as fit, and not more than a picture can show.
_PICTURE_FRAMES = 600
_PICTURE_BYTES = 64 * 2**20
_SERIES_ROWS = 20_000

EndArgument = Callable[
    [float, NDArray[np.float64], NDArray[np.float64], float, Potential], str | None
]


def analyze_frames(
    frames: Iterable[DumpFrame],
    *,
    bond: Potential | None = None,
    impact_velocity: float | None = None,
    timestep: float | None = None,
    end_argument: EndArgument | None = None,
    notes: Iterable[str] = (),
    is_truncated: Callable[[], bool] = lambda: False,
) -> CollisionAnalysis:
    """
    Analyse a collision frame by frame.

    Parameters
    ----------
    frames : iterable of DumpFrame
        A :class:`~analysis.dumps.Dump`, or the frames of an MDAnalysis Universe.
    bond : Potential, optional
        The bonds' potential: gives energies, and contacts whatever the spacing of the frames.
    impact_velocity : float, optional
        v0; read off the first frame by default.
    timestep : float, optional
        Simulated time per step, for dumps that do not carry the time.
    end_argument : callable, optional
        ``f(u_1, strains, velocities, time_since_contact, bond)`` returning why no contact can
        follow, or None. Without it only the time since the last contact speaks.
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
        If the frames do not show a collision of a chain, or a number given is not positive.
    """
    for name, given in (("velocity", impact_velocity), ("timestep", timestep)):
        if given is not None and not 0.0 < given < np.inf:
            raise InputError(f"the {name} is {given}; expected a positive finite number")
    reading = _Reading(iter(frames), timestep)
    velocity = _choose_velocity(reading.start, impact_velocity, reading.resolution)
    detector = ContactDetector(velocity, bond, reading.resolution)
    tally = _Tally(reading.layout.particles, bond)
    opening = state = reading.opening
    for state in reading.states():
        if tally.count == 0 and reading.begins_at_contact:
            detector.add_known(state.time, velocity)
            state = _turned_round(state, velocity)
        _refuse_impossible_bonds(state, bond)
        detector.feed(state)
        tally.feed(state)
    detection = detector.result()
    if detection.times.size == 0:
        raise InputError(
            "the momentum of the chain never changes in the dump: no contact with the wall is in "
            "it; dump the run from before the first contact to after the last"
        )
    n, u, v = reading.layout.particles, state.displacements, state.velocities
    origin = detection.times[0]
    since = state.time - float(detection.times[-1])
    ending = energy_start = energy_end = remainder = drift = None
    if bond is not None:
        energy_start = energy_split(opening.displacements, opening.velocities, bond)
        energy_end = energy_split(u, v, bond)
        drift = float((energy_end.total - energy_start.total) / energy_start.total)
        remainder = float(anharmonic_remainder(u, bond))
        if end_argument is not None:
            ending = end_argument(float(u[0]), bond_strains(u), v, since, bond)
    times = detection.times - origin
    statistics = contact_statistics(times, detection.speeds, n, velocity)
    stiffness = 1.0 if bond is None else bond.stiffness
    digits = reading.digits
    last_resolution = reading.last.resolution("vx", digits)
    caveats = collect_caveats(
        layout=reading.layout,
        first=reading.first,
        digits=digits,
        start=reading.start,
        bond=bond,
        state=state,
        detection=detection,
        since_contact=since,
        ending=ending,
        drift=drift,
        truncated=is_truncated(),
        resolution=float(np.max(last_resolution)) / velocity,
    )
    # A given impact speed is exact; one that was read has the resolution of the dump.
    v0_resolution = 0.0
    if impact_velocity is None:
        v0_resolution = float(np.max(reading.first.resolution("vx", digits)))
    error = _restitution_precision(v, velocity, last_resolution, v0_resolution)
    error += abs(drift or 0.0)
    # Momentum that the exact motion between frames would not have given.
    error += 2.0 * abs(float(kinematic_restitution(v, velocity))) * detection.total_miss / n
    return CollisionAnalysis(
        particles=n,
        bond=bond,
        velocity=velocity,
        restitution=float(restitution(v, velocity)),
        kinematic_restitution=float(kinematic_restitution(v, velocity)),
        restitution_error=error,
        contact_times=times,
        contact_speeds=detection.speeds,
        contact_statistics=statistics,
        contacts=(
            None if detection.unresolved or reading.start.kind == "late" else statistics.count
        ),
        detection=detection,
        mode_frequencies=mode_frequencies(n, stiffness),
        mode_energies=mode_energies(u, v, stiffness),
        anharmonic_remainder=remainder,
        energy_start=energy_start,
        energy_end=energy_end,
        energy_drift=drift,
        momentum_residual=momentum_residual(v, velocity, detection.speeds),
        bond_min=tally.bond_min,
        bond_max=tally.bond_max,
        frames=tally.count,
        timestep=None if reading.layout.time_known else timestep,
        time_start=float(opening.time - origin),
        time_end=float(state.time - origin),
        ending=ending,
        history=tally.history(origin),
        caveats=(*notes, *caveats),
    )


class _Reading:
    """The frames, and what the first of them says."""

    def __init__(self, frames: Iterator[DumpFrame], timestep: float | None):
        self._frames = frames
        self._timestep = timestep
        self.first = self.last = next(frames)
        self.layout = ChainLayout.from_frame(self.first)
        if not self.layout.time_known and timestep is None:
            raise InputError(
                "the dump counts steps and does not carry the time; give the timestep of the run "
                "(--timestep), or dump the time as a column v_time"
            )
        self.opening = self.layout.state(self.first, timestep)
        resolution = self.first.resolution("vx", self.first.significant_digits())
        self.resolution = float(np.max(resolution))
        self.start = find_start(self.opening.velocities, resolution)

    @property
    def digits(self) -> int:
        """Significant digits of the dump; the first frame alone may hold round numbers only."""
        return max(self.first.significant_digits(), self.last.significant_digits())

    @property
    def begins_at_contact(self) -> bool:
        """Whether the first frame is that of the first contact, before or after the turn."""
        at_wall = self.opening.displacements[0] == 0.0
        return self.start.kind == "reflected" or (self.start.kind == "incoming" and at_wall)

    def states(self) -> Iterator[ChainState]:
        """Yield all states, the first included, in order of time."""
        yield self.opening
        time = self.opening.time
        for frame in self._frames:
            self.last = frame
            state = self.layout.state(frame, self._timestep)
            if state.time < time:
                raise InputError(
                    f"the frame of step {state.step} is earlier than the one before it; expected "
                    "the frames of one run in order of time"
                )
            time = state.time
            yield state


def _turned_round(state: ChainState, impact_velocity: float) -> ChainState:
    """Return the state right after the first contact."""
    velocities = state.velocities.copy()
    velocities[0] = impact_velocity
    return ChainState(state.step, state.time, state.displacements, velocities)


def _choose_velocity(start: Start, given: float | None, resolution: float) -> float:
    """Prefer the given impact speed, which has all its digits, if the first frame agrees."""
    seen = start.impact_velocity
    if given is None:
        if seen is None:
            raise InputError(
                "the first frame is not the start of a collision (all particles at -v0, or the "
                "first just turned round), so the impact speed is not known; give it (--velocity)"
            )
        return seen
    if seen is not None and abs(seen - given) > 4.0 * resolution + 1e-9 * given:
        raise InputError(
            f"the dump starts with the impact speed {seen:.9g}, the scene says {given:.9g}; "
            "expected the dump of that scene"
        )
    return given


def _restitution_precision(
    velocities: NDArray[np.float64],
    impact_velocity: float,
    resolution: NDArray[np.float64],
    impact_resolution: float,
) -> float:
    """Propagate the half-units of printed velocities into eta; a bound, not a deviation."""
    e = abs(float(kinematic_restitution(velocities, impact_velocity)))
    relative = (float(np.mean(resolution)) + e * impact_resolution) / impact_velocity
    return 2.0 * e * relative


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


class _Tally:
    """What is gathered from every frame."""

    def __init__(self, particles: int, bond: Potential | None):
        self._bond = bond
        limit = min(_PICTURE_FRAMES, _PICTURE_BYTES // (16 * particles))
        self._states: Thinned[ChainState] = Thinned(limit)
        self._rows: Thinned[tuple[float, ...]] = Thinned(_SERIES_ROWS)
        self.bond_min = np.inf
        self.bond_max = -np.inf
        self.count = 0

    def feed(self, state: ChainState) -> None:
        self.count += 1
        self._states.feed(state)
        v = state.velocities
        momentum = float(v.sum())
        translation = 0.5 * momentum**2 / v.size
        relative = v - momentum / v.size
        vibration = 0.5 * float(relative @ relative)
        low = high = np.nan
        if v.size > 1:
            strains = bond_strains(state.displacements)
            low, high = 1.0 + float(strains.min()), 1.0 + float(strains.max())
            if self._bond is not None:
                vibration += float(np.sum(self._bond.energy(strains)))
            self.bond_min = min(self.bond_min, low)
            self.bond_max = max(self.bond_max, high)
        self._rows.feed((state.time, momentum, translation, vibration, low, high))

    def history(self, origin: float) -> History:
        states = self._states.items()
        rows = np.array(self._rows.items()).T
        return History(
            np.array([state.time for state in states]) - origin,
            np.array([state.displacements for state in states]),
            np.array([state.velocities for state in states]),
            rows[0] - origin,
            *rows[1:],
        )
