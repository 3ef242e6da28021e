"""Samples for the constants of error bars. Each function draws scenes and returns samples.

A sample is the constant that this scene would have needed.
"""

import sys
from dataclasses import replace

import numpy as np

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import COMPOSITIONS, StepSchemeName
from chaincor.workflows.accuracy.bounded_run import PROOF_STEPS, differences, table_error
from chaincor.workflows.accuracy.by_reference import (
    converge,
)
from chaincor.workflows.accuracy.pilot_run import pilot_from_run
from chaincor.workflows.accuracy.reference_runs import (
    ConvergedRun,
    find_rounding_sensitivity,
    run_reference,
)
from chaincor.workflows.accuracy.step_guess import frequency_ratio, guess_step, largest_step
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.reference import adaptive, hard_sphere, modal
from chaincor.workflows.engines.rounding import SHORT_DRIFT, rounding_error, rounding_of
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import RunError

Samples = dict[str, list[float]]
Random = np.random.Generator

# Smallest divisor. Two runs may agree to the last digit.
_TINY = 1e-300


def draw_scene(random: Random, most: int = 150, potentials: tuple[str, ...] = ()) -> Scene:
    """Draw a chain of at least 3 particles at a moderate speed."""
    potential = str(random.choice(potentials or ("harmonic", "lj", "toda", "log", "power")))
    particles = round(10 ** random.uniform(np.log10(3), np.log10(most)))
    fields: dict = {"potential": potential, "particles": particles}
    if potential == "harmonic":
        return Scene(**fields, velocity=float(10 ** random.uniform(-3, -0.3)))
    # At higher speeds, lj chains break, and late contacts cause errors of another kind. Log bonds
    # become stiff at lower speeds than others, and particles of quartic chains pass each other.
    fastest = {"log": 0.4, "power": 0.6}.get(potential, 0.9)
    if potential == "power":
        fields |= {"power_order": 4, "power_c": 1.0}
    return Scene(**fields, speed=float(fastest * 10 ** random.uniform(-2, 0)))


def find_reference(scene: Scene) -> ConvergedRun:
    """Solve a scene as accurately as rounding allows."""
    return converge(scene.problem, 3.0 * rounding_error("reference", scene.problem))


def draw_numerics(random: Random, scene: Scene, wall: str) -> Numerics:
    """Draw a scheme and a time step that a user might choose."""
    if wall == "reflect":
        step = float(10 ** random.uniform(np.log10(0.002), -1))
        return Numerics(wall="reflect", scheme="verlet", timestep=step)
    if random.random() < 0.5:
        step = float(10 ** random.uniform(np.log10(0.0025), np.log10(0.05)))
        return Numerics(scheme="verlet", timestep=step)
    scheme = str(random.choice([name for name in COMPOSITIONS if name != "verlet"]))
    largest = min(largest_step(scheme, 1.0), 0.5) / frequency_ratio(scene.problem)
    return Numerics(scheme=scheme, timestep=largest * float(10 ** random.uniform(-1, 0)))


def proof_share(random: Random, count: int) -> Samples:
    """Error of explicit numerics in LAMMPS, divided by the largest difference from comparison runs.

    Half of the scenes with the event wall are harmonic chains, whose contacts graze the wall.
    """
    found: Samples = {"event": [], "reflect": []}
    materials = {
        "event": ("harmonic", "harmonic", "lj", "toda"),
        "reflect": ("harmonic", "lj", "toda", "log"),
    }
    for wall, samples in found.items():
        while len(samples) < count:
            scene = draw_scene(random, potentials=materials[wall])
            numerics = draw_numerics(random, scene, wall)
            try:
                reference_value = find_reference(scene)
                bonds = pilot_from_run(reference_value).table_range()
                steps = [share * numerics.timestep for share in (1.0, *PROOF_STEPS)]
                runs = lammps.run_at_steps(
                    scene.problem, replace(numerics, bond_range=bonds), steps
                )
            except RunError:
                continue
            etas = np.array([run.eta for run in runs])
            known = reference_value.error + table_error(runs[0]) + rounding_of(runs[0])
            error = max(abs(etas[0] - reference_value.restitution) - known, 0.0)
            samples.append(error / max(float(np.max(np.abs(etas[1:] - etas[0]))), _TINY))
    return found


def adaptive_share(random: Random, count: int) -> Samples:
    """Error of adaptive steps, divided by the difference from less accurate runs.

    The difference is the larger of two: from a run 10 times less accurate, and 0.4 times that from
    a run 100 times less accurate.
    """
    samples: list[float] = []
    while len(samples) < count:
        scene = draw_scene(random, most=30, potentials=("lj", "toda", "log"))
        scene = scene.replace(speed=4.0 * scene.speed)
        accuracy = float(10 ** random.uniform(-11, -5))
        try:
            reference_value = adaptive.run(
                scene.problem, 1e-4 * accuracy if accuracy > 1e-9 else 1e-13
            ).eta
            fine, coarse, coarser = (
                adaptive.run(scene.problem, k * accuracy).eta for k in (1.0, 10.0, 100.0)
            )
        except RunError:
            continue
        error = abs(fine - reference_value) - rounding_error("reference", scene.problem)
        difference = max(abs(coarse - fine), 0.4 * abs(coarser - fine))
        samples.append(max(error, 0.0) / max(difference, _TINY))
    return {"": samples}


def table_sensitivity(random: Random, count: int) -> Samples:
    """Change of eta by a table with few rows, times v0, divided by the certified force error."""
    found: Samples = {"spline": [], "linear": []}
    for style, samples in found.items():
        while len(samples) < count:
            scene = draw_scene(random, most=100, potentials=("lj", "toda", "log", "power"))
            rows = round(10 ** random.uniform(1.7, 3.3))
            numerics = Numerics(
                scheme="order8",
                timestep=guess_step(scene.problem, "order8", 1e-10),
                table=style,
            )
            try:
                reference_value = find_reference(scene)
                bonds = pilot_from_run(reference_value).table_range()
                numerics = replace(numerics, bond_range=bonds)
                rough = lammps.run(scene.problem, replace(numerics, table_points=rows))
            except RunError:
                continue
            error = abs(rough.eta - reference_value.restitution) - 1e-10
            error -= rounding_of(rough)
            size = rough.details["table"]["force_error"] / scene.impact_velocity
            # Smaller effects of the table are hidden by the errors due to time step and rounding.
            if size > 1e-8:
                samples.append(max(error, 0.0) / size)
    return found


def _slow_scene(random: Random) -> tuple[Scene, float]:
    """Return a slow harmonic chain, and the rounding error of coordinates divided by the motion."""
    while True:
        particles = round(10 ** random.uniform(1, 2.5))
        velocity = float(10 ** random.uniform(-11, -4))
        unit = particles * sys.float_info.epsilon / velocity
        # Outside these limits, all digits of eta are lost, or none.
        if 1e-9 < unit < 1e-2:
            return Scene(potential="harmonic", particles=particles, velocity=velocity), unit


def _slow_samples(random: Random, count: int, *, short: bool) -> list[float]:
    grain = sys.float_info.epsilon
    samples: list[float] = []
    while len(samples) < count:
        scene, unit = _slow_scene(random)
        scheme = str(random.choice(["order6", "order8"]))
        # For a tolerance, steps are not reduced below the limit of rounding. With explicit steps,
        # comparison runs also differ by rounding.
        target_error = max(0.1 * unit, 1e-10)
        numerics = Numerics(scheme=scheme, timestep=guess_step(scene.problem, scheme, target_error))
        stage = numerics.timestep * min(abs(w) for w in COMPOSITIONS[scheme].weights)
        drift = scene.impact_velocity * stage
        if (drift < SHORT_DRIFT * scene.particles * grain) is not short:
            continue
        error = abs(lammps.run(scene.problem, numerics).eta - find_reference(scene).restitution)
        samples.append(max(error - target_error, 0.0) / unit)
    return samples


def coordinate_rounding(random: Random, count: int) -> Samples:
    """Error of slow harmonic chains in LAMMPS with long drifts, divided by n eps/v0."""
    return {"": _slow_samples(random, count, short=False)}


def short_drift_rounding(random: Random, count: int) -> Samples:
    """Error of slow harmonic chains in LAMMPS with a short drift, divided by n eps/v0."""
    return {"": _slow_samples(random, count, short=True)}


def extrapolated_rounding(random: Random, count: int) -> Samples:
    """Error of slow extrapolated harmonic chains in LAMMPS, over n eps/v0 times summed weights."""
    samples: list[float] = []
    for _ in range(count):
        scene, unit = _slow_scene(random)
        name: StepSchemeName = "extrapolated12"
        target_error = max(0.1 * unit, 1e-10)
        # Steps may also be finer than the target error requires.
        step = guess_step(scene.problem, name, target_error) * float(
            10 ** random.uniform(-0.7, 0.0)
        )
        run = lammps.run(scene.problem, Numerics(scheme=name, timestep=step))
        error = abs(run.eta - find_reference(scene).restitution)
        samples.append(max(error - target_error, 0.0) / (unit * STEP_SCHEMES[name].amplification))
    return {"": samples}


def nudge_reserve(random: Random, count: int) -> Samples:
    """Change of eta by a tiny change of speed, divided by the larger of two such changes."""
    samples: list[float] = []
    while len(samples) < count:
        # Only chains that break amplify rounding errors.
        potential = str(random.choice(["lj", "log"]))
        speed = float(random.uniform(0.7, 1.1))
        scene = Scene(potential=potential, particles=int(random.integers(80, 300)), speed=speed)
        ulps = float(random.integers(7, 40))
        nudge = 1.0 + ulps * sys.float_info.epsilon
        try:
            usual = find_rounding_sensitivity(scene.problem)
            step = guess_step(scene.problem, "order8", 1e-9)
            one, other = (
                run_reference(each.problem, "order8", step).eta
                for each in (
                    scene,
                    scene.replace(speed=None, velocity=nudge * scene.impact_velocity),
                )
            )
        except RunError:
            continue
        change = abs(one - other)
        # Without amplification, the error bar contains ordinary rounding.
        if max(usual, change) > rounding_error("reference", scene.problem):
            samples.append(change / max(usual, rounding_error("reference", scene.problem)))
    return {"": samples}


def arithmetic_floor(random: Random, count: int) -> Samples:
    """Difference per particle between modes and steps whose only error is rounding."""
    samples: list[float] = []
    while len(samples) < count:
        scene = draw_scene(random, most=500, potentials=("harmonic",))
        exact = modal.run(scene.problem)
        stepped = run_reference(scene.problem, "extrapolated14", 0.4)
        samples.append(abs(stepped.eta - exact.eta) / scene.particles)
    return {"": samples}


def array_sensitivity(random: Random, count: int) -> Samples:
    """Error of velocities, times and energies, divided by eta's error due to table and rounding."""
    samples: list[float] = []
    while len(samples) < count:
        scene = draw_scene(random, most=100, potentials=("lj", "toda", "harmonic"))
        try:
            reference_value = find_reference(scene)
            bonds = pilot_from_run(reference_value).table_range()
            step = guess_step(scene.problem, "order8", 1e-12)
            run = lammps.run(
                scene.problem, Numerics(scheme="order8", timestep=step, bond_range=bonds)
            )
        except RunError:
            continue
        floor = table_error(run) + rounding_of(run)
        apart = differences(reference_value.outcome, run)
        v0 = scene.impact_velocity
        scales = {
            "contact_times": run.duration,
            "contact_speeds": v0,
            "velocities": v0,
            "mode_energies": 0.5 * scene.particles * v0**2,
        }
        needed = max((apart[name] - 1e-12 * scale) / scale for name, scale in scales.items())
        samples.append(max(needed, 0.0) / floor)
    return {"": samples}


def unseen_stretch(random: Random, count: int) -> Samples:
    """Fraction of the longest bond's strain that LAMMPS misses, because it checks only at times."""
    samples: list[float] = []
    while len(samples) < count:
        scene = draw_scene(random, potentials=("lj", "toda", "log"))
        try:
            reference_value = find_reference(scene)
            low, high = pilot_from_run(reference_value).table_range()
            numerics = Numerics(timestep=guess_step(scene.problem, "order6", 1e-6))
            run = lammps.run(
                scene.problem, replace(numerics, bond_range=(low, 1.0 + 1.5 * (high - 1.0)))
            )
        except RunError:
            continue
        stretch = reference_value.outcome.bond_max - 1.0
        samples.append(max(stretch - (run.bond_max - 1.0), 0.0) / stretch)
    return {"": samples}


def sphere_power(random: Random, count: int) -> Samples:
    """Power of the speed with which three particles approach the limit of hard spheres."""
    samples: list[float] = []
    while len(samples) < count:
        potential = str(random.choice(["lj", "toda", "log"]))
        speed = float(10 ** random.uniform(np.log10(4.0), 1.5))
        slow, fast = (
            hard_sphere.vibration_share(
                Scene(potential=potential, particles=3, speed=k * speed).problem
            )
            for k in (1.0, 2.0)
        )
        # A vibration below 1e-20 is rounding.
        if slow is not None and fast is not None and fast > 1e-20:
            samples.append(float(np.log2(slow / fast)))
    return {"": samples}
