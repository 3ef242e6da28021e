"""What a sweep will take: time from the measured cost model, and room on the disk."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from lammps_inputs.numerics import Numerics
from lammps_inputs.potentials import Harmonic
from lammps_inputs.scene import Scene
from workflows.cost_model import cost_model
from workflows.engines.compositions import COMPOSITIONS
from workflows.stored_collision import asked_tolerance

# Measured over 1000 collisions, 10 to 200 particles at 0.01 to 5 v* and a tolerance of 1e-6
# (tests/benchmarks/sweep_overhead.py): the step that order 8 needs shrinks like this.
_ORDER8_STEP = 0.3
_HARDER_WITH_SPEED = 2.0
# Fine and coarse run, and the search for the step that goes before them.
_RUNS = 2.5
# One bond in one stage, and one call, of the in-house integrator; its runs until three agree.
_IN_HOUSE_BOND = 2e-9
_IN_HOUSE_STAGE = 1e-7
_IN_HOUSE_RUNS = 4.0
# A row with its key in the index, and what an array in NumPy's format adds to its numbers.
_ROW_BYTES = 2500
_ARRAY_BYTES = 5 * 230


@dataclass(frozen=True)
class SweepCost:
    """
    What a sweep is expected to take.

    Attributes
    ----------
    points : int
        Collisions to compute.
    seconds : float
        Sum of their times on one core.
    longest : float
        Time of the longest.
    disk_bytes : int
        Growth of the store.
    """

    points: int
    seconds: float
    longest: float
    disk_bytes: int

    def wall_seconds(self, workers: int) -> float:
        """
        Return the time it takes with several workers.

        Parameters
        ----------
        workers : int
            How many.

        Returns
        -------
        float
            Never less than the longest collision.
        """
        return max(self.seconds / workers, self.longest)


def sweep_cost(scenes: Sequence[Scene], *, arrays: bool = False) -> SweepCost:
    """
    Estimate what collisions will take.

    Parameters
    ----------
    scenes : sequence of Scene
        Those that are to be computed.
    arrays : bool
        Whether their arrays are kept.

    Returns
    -------
    SweepCost
        Right within a factor of about three for one collision, better for many.
    """
    seconds = [expected_seconds(scene) for scene in scenes]
    room = _ROW_BYTES * len(scenes)
    if arrays:
        # Contacts hardly exceed particles; two arrays of contacts, three of particles.
        room += sum(_ARRAY_BYTES + 5 * 8 * scene.particles for scene in scenes)
    return SweepCost(len(scenes), sum(seconds), max(seconds, default=0.0), room)


def expected_seconds(scene: Scene) -> float:
    """
    Estimate the time of one collision from the measured cost model.

    Parameters
    ----------
    scene : Scene
        The collision.

    Returns
    -------
    float
        Seconds on one core, everything included.
    """
    numerics = _likely_numerics(scene)
    # Sound crosses the chain and comes back, at the low speeds at which that takes longest.
    duration = 2.2 * scene.particles / math.sqrt(scene.bond.stiffness)
    model = cost_model()
    if scene.engine == "reference":
        stages = COMPOSITIONS[numerics.scheme].stages * duration / numerics.timestep
        return _IN_HOUSE_RUNS * stages * (_IN_HOUSE_STAGE + _IN_HOUSE_BOND * scene.particles)
    runs = _RUNS if not scene.explicit else 3.0 if scene.error else 1.0
    return model.setup * runs + runs * model.integration(scene, numerics, duration)


def _likely_numerics(scene: Scene) -> Numerics:
    if scene.explicit:
        return Numerics.from_scene(scene)
    tolerance = asked_tolerance(scene)
    assert tolerance is not None
    speed = 0.0
    if not isinstance(scene.bond, Harmonic) and scene.bond.natural_speed:
        speed = scene.impact_velocity / scene.bond.natural_speed
    step = _ORDER8_STEP * (tolerance / 1e-6) ** 0.125 / (1.0 + _HARDER_WITH_SPEED * speed)
    return Numerics(scheme="order8", timestep=step / math.sqrt(scene.bond.stiffness))
