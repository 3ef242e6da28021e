"""Repeat a run with its own numerics, to record its motion."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.outcome import Frames, Outcome


class RunsProblems(Protocol):
    """Solver that is registered in ``accuracy.solvers``."""

    def run(
        self,
        problem: Problem,
        numerics: Numerics | None,
        accuracy: float,
        frame_interval: float | None,
    ) -> Outcome:
        """Run a collision, and record snapshots at multiples of `frame_interval` if it is given."""


@dataclass(frozen=True)
class Replay:
    """Settings needed to repeat a run."""

    #: Collision and its engine; the replay does not write the output files of the collision.
    scene: Scene
    solver: RunsProblems  #: Solver of the run.
    numerics: Numerics | None  #: Numerics of a run with fixed steps; None otherwise.
    accuracy: float = 0.0  #: Target accuracy of a run with adaptive steps; 0 otherwise.

    @property
    def masses(self) -> NDArray[np.float64]:
        """Masses of the chain, then of a free target."""
        line = self.scene.line
        return np.concatenate((line.chain_masses, line.target_masses))

    def record(self, interval: float) -> Frames:
        """
        Repeat the collision and return frames from the first contact to the end of the run.

        LAMMPS records frames at the ends of steps. Raises the errors of the engine, and RunError if
        the run was the limit of hard spheres, in which bonds have no motion.
        """
        outcome = self.solver.run(self.scene.problem, self.numerics, self.accuracy, interval)
        assert outcome.frames is not None
        return outcome.frames
