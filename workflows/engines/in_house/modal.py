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

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import EndWatch, longest_collision
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.in_house.finish import (
    PATIENCE,
    LastContact,
    displacements_from,
    finish,
    run_single_particle,
    unfinished_error,
)
from chaincor.workflows.engines.in_house.lines import modal as line_modal
from chaincor.workflows.engines.in_house.lines.body_modes import MOST_UNEQUAL, are_equal
from chaincor.workflows.engines.in_house.mode_flight import ModalChain, strains_of
from chaincor.workflows.engines.outcome import Frames, Outcome

# Bonds are sampled so often that each (omega <= 2) is seen within 3 % of its extreme strain.
SAMPLE_INTERVAL = 0.25

_SAMPLES_AT_ONCE = 12

Array = NDArray[np.float64]


def serves(scene: Scene) -> bool:
    """
    Return whether a scene is propagated by its modes.

    Parameters
    ----------
    scene : Scene
        What collides.

    Returns
    -------
    bool
        Harmonic bonds and hard contacts; bodies of unequal masses no longer than `MOST_UNEQUAL`.
    """
    line = scene.line
    if line.plain or not scene.bond.is_harmonic:
        return scene.bond.is_harmonic
    bodies = (line.chain_masses, line.target_masses)
    unequal = [len(masses) for masses in bodies if len(masses) > 1 and not are_equal(masses)]
    return not line.soft and max(unequal, default=0) <= MOST_UNEQUAL


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
        raise SceneError(f"potential is '{scene.label}'; modal propagation expects springs")
    if not scene.line.plain:
        if not serves(scene):
            raise SceneError(
                "modal propagation expects hard contacts, and at most "
                f"{MOST_UNEQUAL} particles in a body of unequal masses"
            )
        return line_modal.run(scene, scene.line, frame_interval)
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
