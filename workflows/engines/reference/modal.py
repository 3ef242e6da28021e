r"""
Compute exact collisions of harmonic bodies with any masses and hard contacts.

Between contacts the gap is a linear term and a sum of sines,

.. math:: g(t) = D + V t + \sum_j c_j \frac{e_j \cos\omega_j t + p_j \sin\omega_j t}{\omega_j},

over the modes of both bodies; a rigid wall has no modes. Here D is the difference between the mean
displacements, and V the relative velocity of the centres of mass. A contact with reduced mass
:math:`\mu` and closing speed w adds :math:`2 \mu w c_j` to the velocity of each mode.

The end of the collision is proved. If V > 0 after a contact, the gap stays above :math:`D + V t -
\sum_j |c_j| r_j/\omega_j`, where :math:`r_j^2 = e_j^2 + p_j^2`. No contact comes once this bound is
positive. If V < 0, another contact always comes.
"""

import math
import time
from dataclasses import dataclass, replace

import numpy as np

from chaincor.analysis.modes import are_equal
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.outcome import Frames, Outcome
from chaincor.workflows.engines.reference.finish import End, LastContact, finish
from chaincor.workflows.engines.reference.mode_flight import (
    MOST_UNEQUAL,
    ModalBodies,
    ModalGap,
)
from chaincor.workflows.engines.reference.mode_loops import MORE, RUN_STATE, TERMS, mode_loops
from chaincor.workflows.engines.time_limit import WORK_AT_ONCE, check_time
from chaincor.workflows.errors import UnfinishedCollisionError

SCHEME = "modal"
# Bond strains are sampled at the shorter of two intervals. The unit of _SAMPLING is 1/frequency,
# with the mean frequency of the modes, weighted by energy. The unit of SAMPLE_INTERVAL is sqrt(mean
# mass/U''(1)). In a chain of equal masses (omega <= 2), the largest sampled strain of a bond is
# then within 3 % of its largest strain. _SAMPLES_AT_ONCE samples are computed together; one flight
# has at most _MOST_SAMPLES.
_SAMPLING = 0.5
SAMPLE_INTERVAL = 0.25
_SAMPLES_AT_ONCE = 32
_MOST_SAMPLES = 40_000
# If particle 1 touches the target at zero relative velocity at the start, the search for contacts
# begins after this fraction of the Taylor window.
_FIRST_MOVE = 1e-3
# A sum counts as zero if it is below this fraction of the sum of the magnitudes of its terms.
_ROUNDINGS = 1e-14
# A flight without a contact stops after this much work (number of windows times number of modes),
# which takes minutes.
_MOST_WORK = 2e9
_WORK_AT_ONCE = WORK_AT_ONCE / 60  # one window of one mode takes as long as 60 bond forces
# To measure the effect of rounding errors on eta, a collision is repeated with all masses
# multiplied by each factor. A power of 4 would not change the rounding errors, because its square
# root is exact.
_FACTORS = (0.61, 1.7, 2.3)
# One call of the loop records at most this number of mode amplitudes.
_RECORDED = 200_000


def supports(problem: Problem) -> bool:
    """Return whether :func:`run` supports a scene."""
    line = problem.line
    if not problem.bond.is_harmonic:
        return False
    bodies = (line.chain_masses, line.target_masses)
    unequal = [len(masses) for masses in bodies if len(masses) > 1 and not are_equal(masses)]
    return not line.soft and max(unequal, default=0) <= MOST_UNEQUAL


def run(problem: Problem, frame_interval: float | None = None) -> Outcome:
    """
    Run the collision of two harmonic bodies exactly.

    The bodies need harmonic bonds and hard contacts. A body with unequal masses may have at most
    `MOST_UNEQUAL` particles. The origin of displacements is the position of the contact before the
    target moved. The origin of times is the first contact; snapshots are taken at multiples of
    `frame_interval`.

    Raises SceneError for other scenes, or if the particles at the contact touch at zero relative
    velocity and are pressed together. Raises UnfinishedCollisionError if the bodies neither touch
    nor part within the time that can be followed.
    """
    if not problem.bond.is_harmonic:
        raise SceneError(
            f"potential is '{problem.label}', but modal propagation needs harmonic bonds"
        )
    if not supports(problem):
        raise SceneError(
            f"modal propagation needs hard contacts, and at most {MOST_UNEQUAL} particles in a "
            "body of unequal masses"
        )
    mode_loops()  # compile before the integration is timed
    line = problem.line
    started = time.perf_counter()
    collision = _Collision(problem, line, frame_interval)
    ending = collision.run()
    seconds = time.perf_counter() - started
    low, high = collision.strain_min, collision.strain_max
    if low > high:  # bodies of one particle have no bonds
        low = high = 0.0
    last = collision.state(collision.departure, collision.contact_times[-1])
    begin = line.first if line.at_wall else 0  # a hard wall does not count as a particle
    speeds = np.array(collision.contact_speeds)
    return finish(
        problem,
        LastContact(
            strains=last.strains[begin:],
            velocities=last.velocities[begin:],
            contact_times=np.array(collision.contact_times),
            contact_speeds=speeds,
            impulses=2.0 * line.contact_mass * speeds,
            position=float(last.displacements[begin]),
            bond_range=(1.0 + low, 1.0 + high),
        ),
        End(ending, collision.time, 0),
        scheme=SCHEME,
        timestep=None,
        seconds=seconds,
        frames=collision.frames(),
    )


def rounding_sensitivity(problem: Problem) -> float:
    """
    Return the largest change of eta in :func:`run` when all rounding errors change.

    To change the rounding errors, all masses are multiplied by a common factor. Without rounding,
    eta would not change, because the factor only changes the unit of time.
    """
    line, etas = problem.line, []
    for factor in (1.0, *_FACTORS):
        scaled = replace(
            line, masses=factor * line.masses, velocities=line.velocities / factor**0.5
        )
        collision = _Collision(problem, scaled, None)
        arriving = collision.departure.mean_velocity
        collision.run()
        etas.append((collision.departure.mean_velocity / arriving) ** 2)
    return max(abs(eta - etas[0]) for eta in etas)


@dataclass(frozen=True)
class _State:
    """State of both bodies along x at one time; one of the strains is the gap."""

    strains: Array
    velocities: Array
    displacements: Array


class _Collision:
    """Collision in progress, with its contacts, extreme strains and snapshots."""

    def __init__(self, problem: Problem, line: Line, frame_interval: float | None) -> None:
        self._problem, self._line = problem, line
        self._interval = frame_interval
        self._bodies = ModalBodies(line, problem.bond.stiffness)
        self._gap = gap = self._bodies.at_start()
        self._approach, self._first_distance = gap.mean_velocity, gap.mean_distance
        self._fastest = float(np.max(gap.omega))
        self._flown_before = 0.0
        self._snapshots: list[_State] = []
        self.departure = gap.copy()
        self.contact_times: list[float] = []
        self.contact_speeds: list[float] = []
        self.time = 0.0
        # Range of the strains between the first and the last contact.
        self.strain_min, self.strain_max = math.inf, -math.inf

    def run(self) -> Ending:
        """Integrate until the collision ends and return its end."""
        self._start()
        gap, run_state = self._gap, np.zeros(1, RUN_STATE)[0]
        run_state.gap, run_state.flown = gap.distance, self.time
        # `exchange` is twice the reduced mass of the contact. It is computed from the rounded
        # shapes; each contact then conserves the energy to rounding, and no error accumulates over
        # many contacts.
        exchange = 2.0 / math.fsum(gap.shape**2)
        modes, worked, bounce = len(gap.omega), 0.0, mode_loops().bounce
        most = max(_RECORDED // modes, 1)
        record = (*np.empty((2, most)), *np.empty((2, most, modes)))
        scratch = np.empty(TERMS), np.empty((2, modes))
        while True:
            check_time()
            ended = bounce(run_state, gap.modes, exchange, _WORK_AT_ONCE, record, scratch)
            count, gap.distance = int(run_state.contacts), float(run_state.gap)
            if count > 0:
                self._note_contacts(*(each[:count] for each in record))
            before = self.contact_times[-1] if self.contact_times else 0.0
            self.time = float(run_state.flown) + before
            worked = 0.0 if count > 0 else worked + _WORK_AT_ONCE
            if ended == MORE and worked < _MOST_WORK:
                continue
            self._take_snapshots(self.time)
            if ended != MORE:
                return Ending("proved")
            if not gap.mean_velocity > 0.0:
                raise UnfinishedCollisionError(
                    f"the bodies still approach each other at a time of {self.time:.6g} after the "
                    "first contact. Change the speed or a mass"
                )
            return Ending("open", self._missed())

    def _note_contacts(
        self, speeds: Array, flights: Array, strains: Array, velocities: Array
    ) -> None:
        """Record the contacts that the loop found."""
        for k in range(len(speeds)):
            if self.contact_times:
                self._sample_flight(float(flights[k]))
                now = self.contact_times[-1] + float(flights[k])
                self._take_snapshots(now)
            else:  # time counts from the first contact
                now, self._flown_before = 0.0, float(flights[k])
            self.contact_times.append(now)
            self.contact_speeds.append(float(speeds[k]))
            self.departure = replace(
                self._gap, strain_modes=strains[k], velocity_modes=velocities[k], distance=0.0
            )
        self.departure = self.departure.copy()
        self._note(strains)

    def _start(self) -> None:
        """Decide whether bodies that touch at the start collide or part."""
        line, gap = self._line, self._gap
        closing = float(line.velocities[line.gap] - line.velocities[line.first])
        if gap.distance > 0.0 or closing != 0.0:
            return
        if self._is_pressed():
            raise SceneError(
                "initial has particle 1 at rest on the target while the rest of the chain "
                "presses it there, which is no collision of hard particles. Let particle 1 "
                "approach, or leave a gap"
            )
        # Move the bodies for a short time; otherwise rounding would decide whether they part.
        self.time = _FIRST_MOVE * mode_loops().taylor_window(gap.modes, 0.0)
        self._gap = gap.drifted(self.time)

    def _is_pressed(self) -> bool:
        """Return whether the lowest nonzero derivative of the gap is negative."""
        gap = self._gap
        sign = -1.0
        for order in range(1, len(gap.omega) + 1):
            moving = gap.strain_modes if order % 2 else gap.velocity_modes
            terms = gap.shape * gap.omega**order * moving
            change = sign * float(np.sum(terms))
            if abs(change) > _ROUNDINGS * float(np.sum(np.abs(terms))):
                return change < 0.0
            sign = sign if order % 2 else -sign
        return False

    def _missed(self) -> float:
        """Return the largest impulse that later contacts could give."""
        mass, mean_velocity = self._line.reduced_mass, self._gap.mean_velocity
        vibrating = self._gap.strain_modes[1:] ** 2 + self._gap.velocity_modes[1:] ** 2
        return mass * mean_velocity + math.sqrt(
            mass * float(np.sum(vibrating)) + (mass * mean_velocity) ** 2
        )

    def _sample_flight(self, duration: float) -> None:
        """Sample the bond strains in the flight after the last contact."""
        omega = self.departure.omega
        if duration * self._fastest <= _SAMPLING:
            return
        modes = self.departure.strain_modes - 1j * self.departure.velocity_modes
        energies = np.abs(modes[1:]) ** 2
        if not np.any(energies):
            return
        mean = math.sqrt(float(omega[1:] ** 2 @ energies) / float(np.sum(energies)))
        rate = max(mean / _SAMPLING, self._problem.slow_stiffness**0.5 / SAMPLE_INTERVAL)
        count = min(math.ceil(duration * rate), _MOST_SAMPLES)
        for first in range(1, count, _SAMPLES_AT_ONCE):
            moments = np.arange(first, min(first + _SAMPLES_AT_ONCE, count)) * (duration / count)
            self._note((np.exp(1j * moments[:, None] * omega) * modes).real)

    def _note(self, strain_modes: Array) -> None:
        for each in self._bodies.strains(strain_modes):
            if each.size > 0:
                self.strain_min = min(self.strain_min, float(np.min(each)))
                self.strain_max = max(self.strain_max, float(np.max(each)))

    def state(self, gap: ModalGap, moment: float) -> _State:
        """Return the state of both bodies; `moment` is the time since the first contact."""
        bodies, line = self._bodies, self._line
        chain_strains, target_strains = bodies.strains(gap.strain_modes)
        moving, resting = bodies.velocities(gap.velocity_modes)
        drift = place = 0.0
        if bodies.target is not None:
            masses = line.target_masses
            whole = float(np.sum(masses))
            # The velocity and the displacement of the target's centre of mass follow from the
            # conservation of the total momentum.
            share = line.reduced_mass / whole
            drift = -share * (gap.mean_velocity - self._approach)
            drifted = self._approach * (moment + self._flown_before)
            mean = -share * (gap.mean_distance - self._first_distance - drifted)
            outward = np.cumsum(np.concatenate(([0.0], target_strains)))
            # The origin of displacements is the initial position of the contact, not the centre of
            # mass.
            at_first = np.cumsum(np.concatenate(([0.0], line.strains[: line.gap][::-1])))
            mean -= float(masses @ at_first) / whole
            place = mean + float(masses @ outward) / whole - float(outward[-1])
        strains = np.concatenate((target_strains[::-1], [gap.distance], chain_strains))
        return _State(
            strains,
            np.concatenate(((drift - resting)[::-1], drift + gap.mean_velocity + moving)),
            np.cumsum(np.concatenate(([place], strains))),
        )

    def _take_snapshots(self, until: float) -> None:
        """Take the snapshots between the last contact and the time `until`."""
        if self._interval is None:
            return
        while (moment := len(self._snapshots) * self._interval) < until or moment == 0.0:
            flown = moment - self.contact_times[-1]
            self._snapshots.append(self.state(self.departure.drifted(flown), moment))

    def frames(self) -> Frames | None:
        """Return the snapshots; None without a `frame_interval`."""
        if self._interval is None:
            return None
        times = [k * self._interval for k in range(len(self._snapshots))]
        displacements = [shot.displacements for shot in self._snapshots]
        return Frames.of(
            self._line, times, displacements, [shot.velocities for shot in self._snapshots]
        )
