"""Guessing, without a run, the in-house step that meets an error."""

import math
from functools import lru_cache

from chaincor.lammps_inputs.bonds.potential import Potential, compressed_strain
from chaincor.lammps_inputs.numerics import StepSchemeName
from chaincor.lammps_inputs.scene import DEFAULT_TIMESTEPS, Scene
from chaincor.workflows.engines.compositions import COMPOSITIONS
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.measured import measured

# A stage of weight w is stable while 2 |w| H < 2 for the fastest mode; stay a tenth below.
_STABILITY_SHARE = 0.9
# A bond that is compressed to a curvature k needs steps shorter by sqrt(k). The steps of
# DEFAULT_TIMESTEPS, and one that only the in-house engine can take, with the errors of eta that
# chains of about 100 have with them; only the first guess depends on these.
USUAL_STEPS: dict[str, float] = {**DEFAULT_TIMESTEPS, "extrapolated14": 0.8}
_USUAL_ERROR: dict[str, float] = measured("usual_error")
# Up to where extrapolated steps are stable.
_LARGEST_EXTRAPOLATED = 1.2


def sharpness(scene: Scene) -> float:
    """
    Return how much faster than a harmonic bond the most compressed bond swings.

    That is sqrt(U''(shortest)/U''(1)), 1 or more, by a guess at the shortest bond.
    """
    if scene.particles == 1:
        return 1.0
    # A user's own object need not be hashable.
    find = _sharpness if isinstance(scene.potential, str) else _sharpness.__wrapped__
    return find(scene.bond, scene.impact_velocity)


# A sweep asks for the same speeds with many lengths.
@lru_cache(maxsize=10_000)
def _sharpness(bond: Potential, impact_velocity: float) -> float:
    # Two particles that meet at 2 v0 have the energy v0^2 for their bond.
    strain = compressed_strain(bond, impact_velocity**2)
    curvature = float(bond.curvature(strain))
    return math.sqrt(max(1.0, curvature / bond.stiffness))


def largest_step(scheme: StepSchemeName, stiffness: float) -> float:
    """
    Return the largest step that is stable with the chain's fastest mode.

    `stiffness` is U''(1).
    """
    if scheme not in COMPOSITIONS:
        return _LARGEST_EXTRAPOLATED / stiffness**0.5
    heaviest = max(abs(w) for w in COMPOSITIONS[scheme].weights)
    return _STABILITY_SHARE / (heaviest * stiffness**0.5)


def guess_step(scene: Scene, scheme: StepSchemeName, goal: float) -> float:
    """Guess the step that meets an error."""
    order = STEP_SCHEMES[scheme].order
    usual = USUAL_STEPS[scheme] * (goal / _USUAL_ERROR[scheme]) ** (1.0 / order)
    stable = largest_step(scheme, scene.bond.stiffness)
    return min(stable, usual / scene.bond.stiffness**0.5) / sharpness(scene)
