"""Replay of a run with its own numerics, to record its motion."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.outcome import Frames
from chaincor.workflows.errors import RunError


@dataclass(frozen=True)
class Replay:
    """Settings needed to repeat a run."""

    scene: Scene  #: Collision with its engine; the replay does not write its output files.
    scheme: str  #: Scheme of the run, as in ``Outcome``.
    numerics: Numerics | None  #: Numerics of a run with fixed steps; None otherwise.
    accuracy: float | None  #: Target accuracy of a run with adaptive steps; None otherwise.

    @property
    def masses(self) -> NDArray[np.float64]:
        """Masses of the chain, then of a free target."""
        line = self.scene.line
        return np.concatenate((line.chain_masses, line.target_masses))

    def record(self, interval: float) -> Frames:
        """
        Repeat the collision and return frames from the first contact to the end of the run.

        LAMMPS takes frames at the ends of steps. Raises RunError if the run was the limit of hard
        spheres, in which bonds have no motion, and the errors of the engine.
        """
        from chaincor.workflows.engines.reference import adaptive, hard_sphere, modal, stepping

        problem = self.scene.problem
        if self.scheme == hard_sphere.SCHEME:
            raise RunError(
                "the result is the limit of hard spheres, in which bonds have no motion to "
                "show. Lower the speed, or give another tolerance"
            )
        if self.numerics is not None and self.scene.engine == "lammps":
            from chaincor.workflows.engines.lammps import engine as lammps

            outcome = lammps.run(problem, self.numerics, interval)
        elif self.numerics is not None:
            outcome = stepping.run(problem, self.numerics, interval)
        elif self.accuracy is not None:
            outcome = adaptive.run(problem, self.accuracy, interval)
        else:
            outcome = modal.run(problem, interval)
        assert outcome.frames is not None
        return outcome.frames
