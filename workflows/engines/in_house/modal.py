r"""
The exact propagator of harmonic chains: between contacts every mode is a sine.

With the orthonormal DCT-II of displacements and velocities, q_j and p_j, a free chain moves as

.. math:: q_j(t) = q_j \cos\omega_j t + p_j \frac{\sin\omega_j t}{\omega_j}, \qquad
          \omega_j = 2\sin\frac{\pi j}{2n},

and a contact of incoming speed v adds :math:`2 v c_j` to every p_j, where c_j is mode j at
particle 1. Only the times of the contacts are searched for; see ``mode_flight``.
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.ending import Ending, EndWatch, longest_collision
from chaincor.workflows.engines.in_house.finish import (
    PATIENCE,
    LastContact,
    displacements_from,
    finish,
    run_single_particle,
    unfinished_error,
)
from chaincor.workflows.engines.in_house.mode_flight import WINDOW, fly, rotate
from chaincor.workflows.engines.interrupts import steps_at_once
from chaincor.workflows.engines.outcome import Frames, Outcome

# Bonds are sampled so often that each (omega <= 2) is seen within 3 % of its extreme strain.
SAMPLE_INTERVAL = 0.25

_SAMPLES_AT_ONCE = 12

# The 26 terms of a series and the rotation of a mode, in bond forces.
_WINDOW_WORK = 60

Array = NDArray[np.float64]


def run(scene: Scene, frame_interval: float | None = None) -> Outcome:
    """
    Carry a harmonic chain through its collision, exactly.

    Parameters
    ----------
    scene : Scene
        With the harmonic potential.
    frame_interval : float, optional
        Time between snapshots.

    Returns
    -------
    Outcome
        Scheme ``modal``, no timestep; bond lengths are sampled densely up to the last contact.
        Chains that cross themselves are flagged.

    Raises
    ------
    SceneError
        If the bonds are not harmonic.
    UnfinishedCollisionError
        If the chain still approaches the wall after the longest time that is followed.
    """
    if not scene.bond.is_harmonic:
        raise SceneError(f"potential is '{scene.label}'; modal propagation expects 'harmonic'")
    if scene.particles == 1:
        return run_single_particle(scene, "modal", None, frame_interval)
    chain = ModalChain.at_first_contact(scene.particles, scene.impact_velocity)
    chain.copy().fly(0.0)  # loads or compiles the loops, which is not integration
    started = time.perf_counter()
    collision = _Collision(scene, chain, frame_interval)
    ending = collision.run()
    seconds = time.perf_counter() - started
    last = collision.departure
    return finish(
        scene,
        LastContact(
            last.strains(),
            last.velocities(),
            np.array(collision.contact_times),
            np.array(collision.contact_speeds),
        ),
        scheme="modal",
        timestep=None,
        ending=ending,
        duration=collision.time,
        bond_range=(1.0 + collision.strain_min, 1.0 + collision.strain_max),
        seconds=seconds,
        force_evaluations=0,
        frames=collision.frames(),
    )


def strains_of(strain_modes: Array) -> Array:
    """
    Return the bond strains of modes.

    Parameters
    ----------
    strain_modes : ndarray of shape (..., n)
        e_j = omega_j q_j.

    Returns
    -------
    ndarray of shape (..., n - 1)
        s_i, minus the orthonormal DST-I of e_j.
    """
    from scipy.fft import dst

    return -dst(strain_modes[..., 1:], type=1, norm="ortho")


@dataclass
class ModalChain:
    """
    A free harmonic chain in its modes.

    Attributes
    ----------
    strain_modes, velocity_modes : ndarray of shape (n,)
        e_j = omega_j q_j and p_j.
    omega, shape : ndarray of shape (n,)
        Frequencies, and the modes at particle 1.
    wall_distance : float
        x of particle 1.
    """

    strain_modes: Array
    velocity_modes: Array
    omega: Array
    shape: Array
    wall_distance: float = 0.0

    @classmethod
    def at_first_contact(cls, particles: int, speed: float) -> "ModalChain":
        """
        Return the chain right after its first contact.

        Parameters
        ----------
        particles : int
            Particles n.
        speed : float
            v0; all particles have -v0 but the first, which is reflected.

        Returns
        -------
        ModalChain
            With no strain.
        """
        angle = 0.5 * math.pi * np.arange(particles) / particles
        shape = math.sqrt(2.0 / particles) * np.cos(angle)
        shape[0] = math.sqrt(1.0 / particles)
        velocity_modes = 2.0 * speed * shape
        velocity_modes[0] -= speed * math.sqrt(particles)
        return cls(np.zeros(particles), velocity_modes, 2.0 * np.sin(angle), shape)

    @property
    def momentum(self) -> float:
        """Momentum of the chain."""
        return float(self.velocity_modes[0]) * math.sqrt(len(self.omega))

    def copy(self) -> "ModalChain":
        """
        Return a chain that moves independently.

        Returns
        -------
        ModalChain
            In the same state.
        """
        return ModalChain(
            self.strain_modes.copy(),
            self.velocity_modes.copy(),
            self.omega,
            self.shape,
            self.wall_distance,
        )

    def strains(self) -> Array:
        """
        Return the bond strains.

        Returns
        -------
        ndarray of shape (n - 1,)
            s_i, minus the orthonormal DST-I of e_j.
        """
        return strains_of(self.strain_modes)

    def velocities(self) -> Array:
        """
        Return the particle velocities.

        Returns
        -------
        ndarray of shape (n,)
            v_i, the inverse DCT-II of p_j.
        """
        from scipy.fft import idct

        return idct(self.velocity_modes, type=2, norm="ortho")

    def fly(self, longest: float) -> tuple[float, float | None]:
        """
        Fly freely to the next contact, or for a given time.

        Parameters
        ----------
        longest : float
            When to stop looking; up to one time unit more is flown.

        Returns
        -------
        flown : float
            Time flown.
        incoming : float or None
            Speed of particle 1 into the wall, not yet reflected; None where there is no contact.
        """
        flown, velocity = 0.0, 1.0
        # A window takes as long as so many bond forces for every mode.
        at_once = WINDOW * steps_at_once(_WINDOW_WORK * len(self.omega))
        while True:
            flown, self.wall_distance, velocity = fly(
                self.strain_modes,
                self.velocity_modes,
                self.omega,
                self.shape,
                self.wall_distance,
                flown,
                min(longest, flown + at_once),
            )
            if velocity <= 0.0:
                return flown, -velocity
            if flown >= longest:
                return flown, None

    def reflect(self, incoming: float) -> None:
        """
        Reverse the velocity of particle 1.

        Parameters
        ----------
        incoming : float
            Its speed into the wall.
        """
        self.velocity_modes += 2.0 * incoming * self.shape

    def drifted(self, duration: float) -> "ModalChain":
        """
        Return the chain after a free flight.

        Parameters
        ----------
        duration : float
            How long; the wall is not looked at.

        Returns
        -------
        ModalChain
            A copy.
        """
        later = self.copy()
        rotate(later.strain_modes, later.velocity_modes, self.omega, duration)
        # x moves by the integral of its velocity; 1 - cos is taken without cancellation.
        vibrating, omega = slice(1, None), self.omega[1:]
        swing = self.velocity_modes[vibrating] * np.sin(omega * duration)
        swing -= 2.0 * self.strain_modes[vibrating] * np.sin(0.5 * omega * duration) ** 2
        later.wall_distance += float(self.shape[0] * self.velocity_modes[0] * duration)
        later.wall_distance += float(self.shape[vibrating] @ (swing / omega))
        return later


class _Collision:
    """One collision in progress: contacts, samples of the bonds, snapshots."""

    def __init__(self, scene: Scene, chain: ModalChain, frame_interval: float | None) -> None:
        self._scene, self._chain = scene, chain
        self._interval = frame_interval
        self._snapshots: list[ModalChain] = []
        self.departure = chain.copy()
        self.contact_times = [0.0]
        self.contact_speeds = [scene.impact_velocity]
        self.time = 0.0
        self.strain_min = self.strain_max = 0.0
        # What the modes e + ip are multiplied by in 1, 2, ... sample intervals.
        moments = SAMPLE_INTERVAL * np.arange(1, _SAMPLES_AT_ONCE + 1)
        self._turns = np.exp(-1j * moments[:, None] * chain.omega)

    def run(self) -> Ending:
        """Fly until the end and return it."""
        scene, chain = self._scene, self._chain
        watch = EndWatch(scene.particles, scene.bond)
        patience = PATIENCE * math.pi / math.sqrt(2.0)
        while True:
            last = self.contact_times[-1]
            flown, incoming = chain.fly(max(patience - (self.time - last), 0.1))
            self.time += flown
            if incoming is not None:
                self._reflect(incoming)
                patience = PATIENCE * self.time / (len(self.contact_times) - 1)
                continue
            ending = watch.look(
                self.time, last, chain.wall_distance, chain.strains(), chain.velocities()
            )
            if ending is not None:
                self._take_snapshots()
                return ending
            if self.time > longest_collision(scene.particles, scene.bond.stiffness, last):
                raise unfinished_error(scene, self.time)
            patience = watch.next_look(self.time, last) - last

    def _reflect(self, incoming: float) -> None:
        self._take_snapshots()
        self._sample_flight()
        self._chain.reflect(incoming)
        self.departure = self._chain.copy()
        self.contact_times.append(self.time)
        self.contact_speeds.append(incoming)
        self._note(self.departure.strains())

    def _sample_flight(self) -> None:
        """Sample the bonds between the last contact and now."""
        modes = self.departure.strain_modes + 1j * self.departure.velocity_modes
        left = int((self.time - self.contact_times[-1]) / SAMPLE_INTERVAL)
        while left > 0:
            sampled = self._turns[:left] * modes
            self._note(strains_of(sampled.real))
            modes, left = sampled[-1], left - len(sampled)

    def _note(self, strains: Array) -> None:
        self.strain_min = min(self.strain_min, float(strains.min()))
        self.strain_max = max(self.strain_max, float(strains.max()))

    def _take_snapshots(self) -> None:
        """Take the snapshots due between the last contact and now."""
        if self._interval is None:
            return
        while (moment := len(self._snapshots) * self._interval) < self.time:
            self._snapshots.append(self.departure.drifted(moment - self.contact_times[-1]))

    def frames(self) -> Frames | None:
        """Return the snapshots, if any were asked for."""
        if self._interval is None:
            return None
        return Frames(
            np.array([k * self._interval for k in range(len(self._snapshots))]),
            np.array([displacements_from(s.wall_distance, s.strains()) for s in self._snapshots]),
            np.array([s.velocities() for s in self._snapshots]),
        )
