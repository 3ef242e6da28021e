"""What one collision will take: time from the measured cost model."""

import math
from collections.abc import Sequence

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.bounded_run import PROOF_STEPS
from chaincor.workflows.accuracy.by_lammps import (
    COARSER,
    LAMMPS_RUNS,
    SHARPEST_LAMMPS,
    TRUTH_SHARE,
    coarser_target_error,
    usual_schemes,
)
from chaincor.workflows.accuracy.by_reference import SHARPEST_FIXED
from chaincor.workflows.accuracy.cost_model import cost_model
from chaincor.workflows.accuracy.fixed_steps import first_step, usual_scheme
from chaincor.workflows.accuracy.step_guess import (
    contact_is_stiffest,
    frequency_ratio,
    guess_step,
)
from chaincor.workflows.durations import format_duration
from chaincor.workflows.engines.fragment_bounds import breaking_energy
from chaincor.workflows.engines.reference.modal import supports
from chaincor.workflows.engines.rounding import rounding_error
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import CostError

# Processor times measured for 130 collisions, 10 to 500 particles at 0.01 to 4 v* and tolerances of
# 1e-4 to 1e-9. What any collision with LAMMPS takes, and any in-house:
_LAMMPS_SECONDS = 0.025
_IN_HOUSE_SECONDS = 0.002
# One stage, and one bond in it, of the in-house integrator; its runs until they agree, or until
# LAMMPS's step is chosen.
_IN_HOUSE_STAGE = 1e-7
_IN_HOUSE_BOND = 1e-9
_IN_HOUSE_RUNS = 2.1
# Of many at once, what each takes of the time that it takes alone: 0.1 of short chains to 0.5.
_TOGETHER_SHARE = 0.3
# How many broken bonds the energy suffices for where motions are usually so different that one step
# seldom meets a goal.
_SHATTERED = 33.0
# A harmonic chain in its modes: by pairs of modes and windows of time, of which both are as many
# as particles. Measured for 1000 to 4000.
_MODAL_PAIR = 7e-8
# Longer chains, which no cache holds, were not measured.
_MOST_MEASURED = 500
# Its adaptive steps: by pairs of particles and digits of the sharpness.
_ADAPTIVE_PAIR = 5e-5


def expected_seconds(scene: Scene) -> float:
    """
    Estimate the time of one collision on one core, everything included.

    From the measured cost model, for up to 500 particles; chains of thousands, which no cache
    holds and whose steps have to be finer, may take 15 times longer, and chains that break 100.
    """
    # Sound crosses the chain and comes back, at the low speeds at which that takes longest.
    duration = 2.2 * scene.longest_body / math.sqrt(scene.slow_stiffness)
    duration += float(scene.line.strains[scene.line.gap]) / scene.impact_velocity
    duration += scene.contact_duration
    if scene.explicit:
        return _given_seconds(scene, duration)
    asked = scene.asked_tolerance
    assert asked is not None
    # A wish below rounding is not worked for.
    target_error = max(asked, rounding_error(scene.engine, scene))
    sharp = frequency_ratio(scene)
    modal = _MODAL_PAIR * scene.longest_body**2 if supports(scene) else 0.0
    if scene.engine == "reference":
        if modal:
            return _IN_HOUSE_SECONDS + modal
        if sharp > SHARPEST_FIXED and scene.line.is_standard:
            return _ADAPTIVE_PAIR * scene.particles**2 * math.log10(sharp)
        return _IN_HOUSE_SECONDS + _reference_seconds(scene, duration, target_error)
    if sharp > SHARPEST_LAMMPS:
        return _LAMMPS_SECONDS  # refused at once
    scheme = usual_schemes(scene, target_error)[0]
    if scheme == "verlet":  # which is taken where it is cheaper than this
        scheme = "order8"
    step = guess_step(scene, scheme, coarser_target_error(scene, scheme, target_error)) / COARSER
    numerics = Numerics(scheme=scheme, timestep=step)
    run = cost_model().integration(scene, numerics, duration)
    choice = _reference_seconds(scene, duration, TRUTH_SHARE * target_error)
    return _LAMMPS_SECONDS + LAMMPS_RUNS * run + choice + modal


def may_take_longer(scene: Scene) -> bool:
    """Return whether several times what is expected is usual: for chains longer than measured."""
    return scene.longest_body > _MOST_MEASURED and not supports(scene)


def usually_shatters(scene: Scene) -> bool:
    """Return whether vibrations usually take what it takes to break several bonds."""
    energy = 0.5 * scene.particles * scene.impact_velocity**2
    return energy > _SHATTERED * breaking_energy(scene.bond)


def expected_of_task(scenes: Sequence[Scene]) -> list[float]:
    """Estimate the same of each scene that a worker is handed at once: one, or those of a kind."""
    share = 1.0 if len(scenes) == 1 else _TOGETHER_SHARE
    return [share * expected_seconds(scene) for scene in scenes]


def refuse_endless(scene: Scene, most_seconds: float) -> None:
    """Raise CostError if a collision is expected to take longer than it may."""
    if math.isnan(most_seconds):
        raise InputError("the time it may take is nan; expected a number of seconds or hours")
    expected = expected_seconds(scene)
    if expected <= most_seconds:
        return
    cheaper = (
        f", or a smaller {scene.line.contact.strength_key}" if contact_is_stiffest(scene) else ""
    )
    if scene.engine != "reference" and not scene.explicit:
        in_house = expected_seconds(scene.replace(engine="reference"))
        cheaper += f", or use engine 'reference' (about {format_duration(in_house)})"
    raise CostError(
        f"{scene.particles} particles would take about {format_duration(expected)} on one core; "
        f"expected at most {format_duration(most_seconds)}: take fewer particles or a larger "
        f"tolerance or timestep{cheaper}, or allow more (--most-hours, or most_seconds in Python)"
    )


def _given_seconds(scene: Scene, duration: float) -> float:
    numerics = Numerics.from_scene(scene)
    works = 1.0 + (sum(1.0 / k for k in PROOF_STEPS) if scene.error else 0.0)
    if scene.engine == "lammps":
        return _LAMMPS_SECONDS + works * cost_model().integration(scene, numerics, duration)
    stages = STEP_SCHEMES[numerics.scheme].evaluations * duration / numerics.timestep
    return _IN_HOUSE_SECONDS + works * stages * _reference_stage(scene)


def _reference_seconds(scene: Scene, duration: float, target_error: float) -> float:
    scheme = usual_scheme(target_error)
    stages = duration / first_step(scene, scheme, target_error) * STEP_SCHEMES[scheme].evaluations
    return _IN_HOUSE_RUNS * stages * _reference_stage(scene)


def _reference_stage(scene: Scene) -> float:
    return _IN_HOUSE_STAGE + _IN_HOUSE_BOND * scene.all_particles
