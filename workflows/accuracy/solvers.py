"""Solvers of a collision in order of preference, each with its reason to refuse a scene."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import ClassVar

import numpy as np

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
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

# Processor time of a collision besides its runs, with LAMMPS and with the reference engine.
# Measured for 130 collisions, 10 to 500 particles at 0.01 to 4 v* and tolerances of 1e-4 to 1e-9.
_LAMMPS_SECONDS = 0.025
_IN_HOUSE_SECONDS = 0.002
# Time of one stage of the reference engine, and of one bond in it.
_IN_HOUSE_STAGE = 1e-7
_IN_HOUSE_BOND = 1e-9
# Time of modes for each pair of a mode and a window of time; there are as many of either as
# particles. Measured for 1000 to 4000.
_MODAL_PAIR = 7e-8
# Time of adaptive steps for each pair of particles and decimal digit of the frequency ratio.
_ADAPTIVE_PAIR = 5e-5
# Time of adaptive steps for each pair of beads.
_BEAD_PAIR = 3e-5
# Limit of (n ln(ratio))^3 for adaptive steps: about a minute. A run takes up to 8e-10 s times this
# number (log bonds; other bonds take less in long chains).
_MOST_STEPPED = 7.5e10


class Solver(ABC):
    """Method that computes a collision."""

    name: ClassVar[str]  #: Name in plans.
    engine: ClassVar[str]  #: Engine of the scenes that it solves.
    #: Largest frequency ratio that its steps can follow: the most compressed bond, or a soft
    #: contact, against a bond at rest.
    sharpest: ClassVar[float] = math.inf

    @abstractmethod
    def refusal(self, scene: Scene) -> str | None:
        """Return the reason, in one line, why a scene is not supported; None if it is."""

    def supports(self, scene: Scene) -> bool:
        """Return whether a scene is supported."""
        return self.refusal(scene) is None

    def resolves(self, scene: Scene) -> bool:
        """Return whether its steps can follow the fastest bond or contact."""
        return frequency_ratio(scene) <= self.sharpest

    @abstractmethod
    def forecast(self, scene: Scene, numerics: Numerics | None) -> float:
        """Return the expected seconds of one run on one core."""

    @abstractmethod
    def run(self, scene: Scene, numerics: Numerics | None, accuracy: float = 1e-6) -> Outcome:
        """
        Run a collision.

        Fixed steps and LAMMPS use `numerics`, adaptive steps use `accuracy`.
        """


class ExactModes(Solver):
    """Propagation of harmonic chains by their modes."""

    name, engine = "exact modes", "reference"

    def refusal(self, scene: Scene) -> str | None:
        """Return the reason why a scene cannot be propagated by modes."""
        if modal.supports(scene):
            return None
        if not scene.bond.is_harmonic:
            return "the bonds are not harmonic"
        if scene.line.soft:
            return "the contact is soft"
        return f"a body of unequal masses has more than {modal.MOST_UNEQUAL} particles"

    def forecast(self, scene: Scene, numerics: Numerics | None = None) -> float:
        """Return the expected seconds."""
        return _IN_HOUSE_SECONDS + _MODAL_PAIR * scene.longest_body**2

    def run(self, scene: Scene, numerics: Numerics | None = None, accuracy: float = 0.0) -> Outcome:
        """Propagate the modes."""
        return modal.run(scene)


class FixedSteps(Solver):
    """Reference engine with steps of one length."""

    name, engine = "fixed steps", "reference"
    sharpest = 60.0  # beyond this ratio, adaptive steps of a plain chain take less processor time

    def refusal(self, scene: Scene) -> str | None:
        """Return the reason why adaptive steps are cheaper."""
        if scene.bond.only_pushes:
            return f"{scene.label} beads only push: their steps adapt to their overlaps"
        if not scene.line.is_standard or self.resolves(scene):
            return None
        return (
            f"bonds swing {frequency_ratio(scene):.2g} times faster than at rest where they are "
            f"shortest, more than {self.sharpest:g}"
        )

    def forecast(self, scene: Scene, numerics: Numerics | None) -> float:
        """Return the expected seconds."""
        assert numerics is not None
        evaluations = STEP_SCHEMES[numerics.scheme].evaluations
        stages = evaluations * duration_of(scene) / numerics.timestep
        return stages * (_IN_HOUSE_STAGE + _IN_HOUSE_BOND * scene.all_particles)

    def run(self, scene: Scene, numerics: Numerics | None, accuracy: float = 0.0) -> Outcome:
        """Take the steps."""
        assert numerics is not None
        return stepping.run(scene, numerics)


class AdaptiveSteps(Solver):
    """Reference engine with steps as short as the stiffest bond needs."""

    name, engine = "adaptive steps", "reference"

    def refusal(self, scene: Scene) -> str | None:
        """Return the reason why adaptive steps are not taken."""
        if scene.bond.only_pushes:
            return None
        if not scene.line.is_standard:
            return "the bodies are more than a cold chain of equal masses and a hard wall"
        if (scene.particles * math.log(frequency_ratio(scene))) ** 3 > _MOST_STEPPED:
            return (
                f"{scene.particles} particles with bonds {frequency_ratio(scene):.2g} times faster "
                "than at rest would take hours or more to step"
            )
        return None

    def forecast(self, scene: Scene, numerics: Numerics | None = None) -> float:
        """Return the expected seconds."""
        if scene.bond.only_pushes:
            return _IN_HOUSE_SECONDS + _BEAD_PAIR * scene.all_particles**2
        return _ADAPTIVE_PAIR * scene.particles**2 * math.log10(frequency_ratio(scene))

    def run(self, scene: Scene, numerics: Numerics | None, accuracy: float = 1e-6) -> Outcome:
        """Take the steps."""
        return adaptive.run(scene, accuracy)


class HardSpheres(Solver):
    """Limit of high speed."""

    name, engine = "hard spheres", "reference"

    def refusal(self, scene: Scene) -> str | None:
        """Return the reason why the limit is not reached."""
        if scene.bond.only_pushes:
            return "beads of a power law become no hard spheres at any speed"
        if FIXED_STEPS.supports(scene):
            return "bonds are too soft to be hard spheres"
        return None

    def forecast(self, scene: Scene, numerics: Numerics | None = None) -> float:
        """Return the expected seconds, which a run of three particles takes."""
        return _IN_HOUSE_SECONDS

    def run(self, scene: Scene, numerics: Numerics | None = None, accuracy: float = 0.0) -> Outcome:
        """Return the limit."""
        return hard_sphere.run(scene)


class Lammps(Solver):
    """LAMMPS, with fixed steps."""

    name, engine = "LAMMPS", "lammps"
    sharpest = 300.0  # beyond this ratio, millions of steps would be needed

    def refusal(self, scene: Scene) -> str | None:
        """Return the contact or the bonds as the reason why LAMMPS's fixed steps fail."""
        if scene.bond.only_pushes:
            return granular_refusal(scene)
        if EXACT_MODES.supports(scene) or self.resolves(scene):
            return None
        sharp = frequency_ratio(scene)
        expected = f"expected less than {self.sharpest:g} times for LAMMPS's fixed steps"
        if contact_is_stiffest(scene):
            law = scene.line.contact
            return (
                f"with {law.strength_key} {law.strength:g} the contact would swing {sharp:.2g} "
                f"times faster than bonds at rest; {expected}: give a smaller one, or use engine "
                "'reference', or contact 'hard'"
            )
        line = scene.line
        at_first = float(np.min(np.delete(line.strains, line.gap), initial=0.0))
        shortest = 1.0 + min(at_first, scene.bond.compressed_strain(pair_energy(line)))
        return (
            f"bonds would be compressed to about {shortest:.2g} of their length, where they swing "
            f"{sharp:.2g} times faster than at rest; {expected}: lower the speed, or use engine "
            "'reference'"
        )

    def forecast(self, scene: Scene, numerics: Numerics | None) -> float:
        """Return the expected seconds, from the measured cost model."""
        assert numerics is not None
        return cost_model().integration(scene, numerics, duration_of(scene))

    def run(self, scene: Scene, numerics: Numerics | None, accuracy: float = 0.0) -> Outcome:
        """Run LAMMPS."""
        assert numerics is not None
        return lammps.run(scene, numerics)


EXACT_MODES, FIXED_STEPS, LAMMPS = ExactModes(), FixedSteps(), Lammps()
ADAPTIVE_STEPS, HARD_SPHERES = AdaptiveSteps(), HardSpheres()
# In order of preference.
SOLVERS: tuple[Solver, ...] = (
    EXACT_MODES,
    FIXED_STEPS,
    ADAPTIVE_STEPS,
    HARD_SPHERES,
    LAMMPS,
)
IN_HOUSE = tuple(solver for solver in SOLVERS if solver.engine == "reference")
# Overhead in seconds of any collision besides its runs.
OVERHEAD = {"lammps": _LAMMPS_SECONDS, "reference": _IN_HOUSE_SECONDS}


def solver_of(scene: Scene, among: Iterable[Solver] | None = None) -> Solver:
    """
    Return the first solver that supports a scene, by default among the solvers of its engine.

    Raises RunError with the reason of the last solver if none supports the scene.
    """
    reason = ""
    own = (solver for solver in SOLVERS if solver.engine == scene.engine)
    for solver in own if among is None else among:
        refused = solver.refusal(scene)
        if refused is None:
            return solver
        reason = refused
    raise RunError(reason)


def duration_of(scene: Scene) -> float:
    """
    Return the expected time from the start to the last contact.

    It is a sound round trip at the low speeds at which this takes longest, plus the time to the
    first contact and the duration of a soft contact.
    """
    duration = 2.2 * scene.longest_body / math.sqrt(scene.slow_stiffness)
    duration += float(scene.line.strains[scene.line.gap]) / scene.impact_velocity
    return duration + scene.contact_duration
