"""From the frames of a dump to the physics of the collision, in one pass and constant memory."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chaincor.analysis.caveats import collect_caveats, find_contradictions, is_over
from chaincor.analysis.contact_detection import ContactDetector
from chaincor.analysis.contacts import contact_statistics
from chaincor.analysis.dumps.chain_frames import ChainLayout, ChainState
from chaincor.analysis.dumps.data_file import DeclaredMasses
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.masses import find_masses, mass_resolution
from chaincor.analysis.history import Thinned
from chaincor.analysis.modes import anharmonic_remainder, mode_energies, mode_frequencies
from chaincor.analysis.restitution import (
    bond_strains,
    energy_split,
    kinematic_restitution,
    momentum_residual,
    restitution,
)
from chaincor.analysis.results import CollisionAnalysis, History
from chaincor.analysis.start import Start, find_start
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError

# Whole states are kept for pictures only: as many as fit, and not more than a picture can show.
_PICTURE_FRAMES = 600
_PICTURE_BYTES = 64 * 2**20
_SERIES_ROWS = 20_000
# Sideways motion of this many v0 holds 1e-12 of the energy.
_SIDEWAYS = 1e-6

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
    reading = _Reading(iter(frames), timestep)
    velocity = _choose_velocity(reading.start, impact_velocity, reading.resolution)
    found = find_masses(reading.first, reading.layout, given=masses, declared=declared)
    m = np.ones(reading.layout.particles) if found is None else found
    total_mass = float(np.sum(m))
    detector = ContactDetector(velocity, bond, reading.resolution, m)
    tally = _Tally(m, bond)
    opening = state = reading.opening
    for state in reading.states():
        if tally.count == 0 and reading.begins_at_contact:
            detector.add_known(state.time, velocity)
            state = _turned_round(state, velocity)
        _refuse_impossible_bonds(state, bond)
        detector.feed(state)
        tally.feed(state)
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
    ending = energy_start = energy_end = remainder = drift = None
    if bond is not None:
        energy_start = energy_split(opening.displacements, opening.velocities, bond, m)
        energy_end = energy_split(u, v, bond, m)
        drift = float((energy_end.total - energy_start.total) / energy_start.total)
        remainder = float(anharmonic_remainder(u, bond))
        if end_argument is not None and np.all(m == m[0]):
            # A mass of 1 is taken there: in units of sqrt(m/k) the motion is the same.
            root = float(np.sqrt(m[0]))
            ending = end_argument(float(u[0]), bond_strains(u), root * v, since / root, bond)
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
        masses=m,
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
    error = _restitution_precision(
        v, velocity, m, last_resolution, v0_resolution, reading.last_interval
    )
    e = float(kinematic_restitution(v, velocity, m))
    uncertain = mass_resolution(reading.first, reading.layout, m)
    error += 2.0 * abs(e) * float(uncertain @ np.abs(v / velocity - e)) / total_mass
    eta = float(restitution(v, velocity, m))
    contradictions = find_contradictions(eta, error, detection)
    return CollisionAnalysis(
        particles=n,
        masses=m,
        bond=bond,
        velocity=velocity,
        restitution=eta,
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
        mode_frequencies=mode_frequencies(n, stiffness, m),
        mode_energies=mode_energies(u, v, stiffness, m),
        anharmonic_remainder=remainder,
        energy_start=energy_start,
        energy_end=energy_end,
        energy_drift=drift,
        momentum_residual=momentum_residual(v, velocity, detection.speeds, m),
        bond_min=tally.bond_min,
        bond_max=tally.bond_max,
        frames=tally.count,
        timestep=None if reading.layout.time_known else timestep,
        time_start=float(opening.time - origin),
        time_end=float(state.time - origin),
        ending=ending,
        finished=is_over(state, m, bond, since, ending),
        history=tally.history(origin),
        contradictions=contradictions,
        caveats=(*contradictions, *notes, *caveats),
    )


class _Reading:
    """The frames, and what the first of them says."""

    def __init__(self, frames: Iterator[DumpFrame], timestep: float | None):
        self._frames = frames
        self._timestep = timestep
        self.first = self.last = next(frames)
        self.last_interval = 0  # steps between the last two frames
        self.layout = ChainLayout.from_frame(self.first)
        if self.layout.time_known and timestep is not None:
            raise InputError(
                f"the dump carries the time, and a timestep of {timestep:g} is given; expected "
                "one of them: drop the timestep (--timestep)"
            )
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
            self.last_interval = max(0, frame.step - self.last.step)
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


class _Tally:
    """What is gathered from every frame."""

    def __init__(self, masses: NDArray[np.float64], bond: Potential | None):
        self._masses = masses
        self._total_mass = float(np.sum(masses))
        self._bond = bond
        limit = min(_PICTURE_FRAMES, _PICTURE_BYTES // (16 * masses.size))
        self._states: Thinned[ChainState] = Thinned(limit)
        self._rows: Thinned[tuple[float, ...]] = Thinned(_SERIES_ROWS)
        self.bond_min = np.inf
        self.bond_max = -np.inf
        self.count = 0

    def feed(self, state: ChainState) -> None:
        self.count += 1
        self._states.feed(state)
        v, m = state.velocities, self._masses
        momentum = float((m * v).sum())
        translation = 0.5 * momentum**2 / self._total_mass
        relative = v - momentum / self._total_mass
        vibration = 0.5 * float((m * relative) @ relative)
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
