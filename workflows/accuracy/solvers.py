"""Define the solvers of a collision, their order of preference and their limits."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import ClassVar

import numpy as np

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.scene_parts.bead_rules import granular_refusal
from chaincor.workflows.accuracy.cost_model import cost_model
from chaincor.workflows.accuracy.step_guess import (
    contact_is_stiffest,
    frequency_ratio,
    pair_energy,
)
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import adaptive, hard_sphere, modal, stepping
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import RunError

# Processor seconds that a collision takes in addition to its runs, with LAMMPS and with the
# reference engine, measured for 130 collisions of 10 to 500 particles at 0.01 to 4 v* and
# tolerances of 1e-4 to 1e-9.
_LAMMPS_SECONDS = 0.025
_REFERENCE_SECONDS = 0.002
# Seconds for one stage in the reference engine, and for each bond in this stage.
_REFERENCE_STAGE = 1e-7
_REFERENCE_BOND = 1e-9
# Seconds for each mode in each window of time, measured for 1000 to 4000 particles. The numbers of
# modes and of windows equal the number of particles.
_MODAL_PAIR = 7e-8
# Seconds of adaptive steps, divided by the square of the number of particles and by the decimal
# logarithm of the frequency ratio.
_ADAPTIVE_PAIR = 5e-5
# Seconds of adaptive steps, divided by the square of the number of beads.
_BEAD_PAIR = 3e-5
# Adaptive steps are taken if (n ln(ratio))^3 is at most this value, with n particles and the
# frequency ratio. The limit corresponds to about a minute. A run with log bonds takes up to 8e-10 s
# times (n ln(ratio))^3; other bonds take less time in long chains.
_MOST_STEPPED = 7.5e10


class Solver(ABC):
    """Method that computes a collision."""

    name: ClassVar[str]  #: Name shown in plans.
    engine: ClassVar[str]  #: Engine of the scenes that the solver computes.
    #: Scheme of the outcomes; None if the numerics name the scheme.
    scheme: ClassVar[str | None] = None
    #: Largest frequency ratio that the steps can resolve. The ratio compares the most compressed
    #: bond, or a soft contact, with a bond of natural length.
    sharpest: ClassVar[float] = math.inf

    @abstractmethod
    def refusal(self, problem: Problem) -> str | None:
        """Return the reason, in one line, why a scene is not supported; None if it is supported."""

    def supports(self, problem: Problem) -> bool:
        """Return whether a scene is supported."""
        return self.refusal(problem) is None

    def resolves(self, problem: Problem) -> bool:
        """Return whether the steps can resolve the fastest bond or contact."""
        return frequency_ratio(problem) <= self.sharpest

    @abstractmethod
    def forecast(self, problem: Problem, numerics: Numerics | None) -> float:
        """Return the expected seconds of one run on one core."""

    @abstractmethod
    def run(
        self,
        problem: Problem,
        numerics: Numerics | None,
        accuracy: float = 1e-6,
        frame_interval: float | None = None,
    ) -> Outcome:
        """
        Run a collision, and record snapshots at multiples of `frame_interval` if it is given.

        Fixed steps and LAMMPS use `numerics`, adaptive steps use `accuracy`.
        """


class ExactModes(Solver):
    """Propagation of harmonic chains by their modes."""

    name, engine, scheme = "exact modes", "reference", modal.SCHEME

    def refusal(self, problem: Problem) -> str | None:
        """Return the reason why a scene cannot be propagated by modes."""
        if modal.supports(problem):
            return None
        if not problem.bond.is_harmonic:
            return "the bonds are not harmonic"
        if problem.line.soft:
            return "the contact is soft"
        return f"a body of unequal masses has more than {modal.MOST_UNEQUAL} particles"

    def forecast(self, problem: Problem, numerics: Numerics | None = None) -> float:
        """Return the expected seconds."""
        return _REFERENCE_SECONDS + _MODAL_PAIR * problem.longest_body**2

    def run(
        self,
        problem: Problem,
        numerics: Numerics | None = None,
        accuracy: float = 0.0,
        frame_interval: float | None = None,
    ) -> Outcome:
        """Propagate the modes."""
        return modal.run(problem, frame_interval)


class FixedSteps(Solver):
    """Reference engine with steps of one length."""

    name, engine = "fixed steps", "reference"
    sharpest = 60.0  # beyond this ratio, adaptive steps take less processor time

    def refusal(self, problem: Problem) -> str | None:
        """Return the reason why adaptive steps are cheaper."""
        if problem.bond.only_pushes:
            return f"{problem.label} beads need steps that adapt to their overlaps"
        if not problem.line.is_standard or self.resolves(problem):
            return None
        return (
            f"the shortest bonds vibrate {frequency_ratio(problem):.2g} times faster than bonds "
            f"at rest, more than {self.sharpest:g}"
        )

    def forecast(self, problem: Problem, numerics: Numerics | None) -> float:
        """Return the expected seconds."""
        assert numerics is not None
        evaluations = STEP_SCHEMES[numerics.scheme].evaluations
        stages = evaluations * duration_of(problem) / numerics.timestep
        return stages * (_REFERENCE_STAGE + _REFERENCE_BOND * problem.all_particles)

    def run(
        self,
        problem: Problem,
        numerics: Numerics | None,
        accuracy: float = 0.0,
        frame_interval: float | None = None,
    ) -> Outcome:
        """Take the steps."""
        assert numerics is not None
        return stepping.run(problem, numerics, frame_interval)


class AdaptiveSteps(Solver):
    """Reference engine with adaptive steps."""

    name, engine, scheme = "adaptive steps", "reference", adaptive.SCHEME

    def refusal(self, problem: Problem) -> str | None:
        """Return the reason why adaptive steps are impossible or too slow."""
        if problem.bond.only_pushes:
            return None
        if not problem.line.is_standard:
            return "the bodies are more than a cold chain of equal masses and a hard wall"
        if (problem.particles * math.log(frequency_ratio(problem))) ** 3 > _MOST_STEPPED:
            return (
                f"{problem.particles} particles with bonds {frequency_ratio(problem):.2g} times "
                "faster than at rest would take hours or more to step"
            )
        return None

    def forecast(self, problem: Problem, numerics: Numerics | None = None) -> float:
        """Return the expected seconds."""
        if problem.bond.only_pushes:
            return _REFERENCE_SECONDS + _BEAD_PAIR * problem.all_particles**2
        return _ADAPTIVE_PAIR * problem.particles**2 * math.log10(frequency_ratio(problem))

    def run(
        self,
        problem: Problem,
        numerics: Numerics | None,
        accuracy: float = 1e-6,
        frame_interval: float | None = None,
    ) -> Outcome:
        """Take the steps."""
        return adaptive.run(problem, accuracy, frame_interval)


class HardSpheres(Solver):
    """Limit of high speed, in which bonds act like hard spheres."""

    name, engine, scheme = "hard spheres", "reference", hard_sphere.SCHEME

    def refusal(self, problem: Problem) -> str | None:
        """Return the reason why bonds do not act like hard spheres."""
        if problem.bond.only_pushes:
            return "beads with a power law do not become hard spheres at any speed"
        if FIXED_STEPS.supports(problem):
            return "bonds are too soft to be hard spheres"
        return None

    def forecast(self, problem: Problem, numerics: Numerics | None = None) -> float:
        """Return the expected seconds, mostly for a run of three particles."""
        return _REFERENCE_SECONDS

    def run(
        self,
        problem: Problem,
        numerics: Numerics | None = None,
        accuracy: float = 0.0,
        frame_interval: float | None = None,
    ) -> Outcome:
        """Return the limit; raises RunError if snapshots are requested."""
        if frame_interval is not None:
            raise RunError(
                "the result is the limit of hard spheres, in which bonds have no motion to "
                "show. Lower the speed, or give another tolerance"
            )
        return hard_sphere.run(problem)


class Lammps(Solver):
    """LAMMPS, with fixed steps."""

    name, engine = "LAMMPS", "lammps"
    sharpest = 300.0  # beyond this ratio, millions of steps would be needed

    def refusal(self, problem: Problem) -> str | None:
        """Return the reason why LAMMPS cannot run a scene."""
        if problem.line.contact.damped:
            return f"LAMMPS has no contact {problem.line.contact.name!r}. Use engine 'reference'"
        if problem.bond.only_pushes:
            return granular_refusal(problem)
        if EXACT_MODES.supports(problem) or self.resolves(problem):
            return None
        sharp = frequency_ratio(problem)
        resolved = f"LAMMPS's fixed steps resolve up to {self.sharpest:g} times"
        if contact_is_stiffest(problem):
            law = problem.line.contact
            return (
                f"with {law.strength_key} {law.strength:g} the contact would vibrate {sharp:.2g} "
                f"times faster than bonds at rest; {resolved}. Give a smaller one, or use engine "
                "'reference', or contact 'hard'"
            )
        line = problem.line
        at_first = float(np.min(np.delete(line.strains, line.gap), initial=0.0))
        shortest = 1.0 + min(at_first, problem.bond.compressed_strain(pair_energy(line)))
        return (
            f"bonds would be compressed to about {shortest:.2g} of their length, where they "
            f"vibrate {sharp:.2g} times faster than at rest; {resolved}. Lower the speed, or use "
            "engine 'reference'"
        )

    def forecast(self, problem: Problem, numerics: Numerics | None) -> float:
        """Return the expected seconds, according to the measured cost model."""
        assert numerics is not None
        return cost_model().integration(problem, numerics, duration_of(problem))

    def run(
        self,
        problem: Problem,
        numerics: Numerics | None,
        accuracy: float = 0.0,
        frame_interval: float | None = None,
    ) -> Outcome:
        """Run LAMMPS."""
        assert numerics is not None
        return lammps.run(problem, numerics, frame_interval)


EXACT_MODES, FIXED_STEPS, LAMMPS = ExactModes(), FixedSteps(), Lammps()
ADAPTIVE_STEPS, HARD_SPHERES = AdaptiveSteps(), HardSpheres()
# The solvers in order of preference.
SOLVERS: tuple[Solver, ...] = (
    EXACT_MODES,
    FIXED_STEPS,
    ADAPTIVE_STEPS,
    HARD_SPHERES,
    LAMMPS,
)
REFERENCE_SOLVERS = tuple(solver for solver in SOLVERS if solver.engine == "reference")
_BY_SCHEME = {(solver.engine, solver.scheme): solver for solver in SOLVERS}
# Overhead of any collision in addition to its runs, in seconds.
OVERHEAD = {"lammps": _LAMMPS_SECONDS, "reference": _REFERENCE_SECONDS}


def solver_of(problem: Problem, among: Iterable[Solver]) -> Solver:
    """
    Return the first solver that supports a problem.

    If no solver supports the problem, raises RunError with the reason of the last solver.
    """
    reason = ""
    for solver in among:
        refused = solver.refusal(problem)
        if refused is None:
            return solver
        reason = refused
    raise RunError(reason)


def solver_of_outcome(engine: str, scheme: str) -> Solver:
    """Return the solver that produced an outcome, from its engine and scheme."""
    return _BY_SCHEME.get((engine, scheme)) or _BY_SCHEME[engine, None]


def duration_of(problem: Problem) -> float:
    """
    Return the expected time from the start to the last contact.

    It is the sum of three times: a sound round trip, which takes longest at low speeds; the time to
    the first contact; the duration of a soft contact.
    """
    duration = 2.2 * problem.longest_body / math.sqrt(problem.slow_stiffness)
    duration += float(problem.line.strains[problem.line.gap]) / problem.impact_velocity
    return duration + problem.contact_duration
