"""Find the scheme that is usually the cheapest for a tolerance, in random scenes.

All schemes run to the same error in the same scene, in both engines. Only ratios of processor times
within a scene are used.
"""

import time
from collections.abc import Callable

import numpy as np

from benchmarks.bars.samples import Random, draw_scene
from chaincor.workflows.accuracy.by_lammps import (
    LAMMPS_SCHEMES,
    choose_numerics,
    is_supported_by_lammps,
)
from chaincor.workflows.accuracy.by_reference import converge
from chaincor.workflows.accuracy.cost_model import shipped_cost_model
from chaincor.workflows.accuracy.pilot_run import pilot_from_run
from chaincor.workflows.accuracy.reference_runs import find_step, run_reference
from chaincor.workflows.accuracy.step_guess import guess_step
from chaincor.workflows.accuracy.step_proof import COARSER, usual_share
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.errors import RunError

TARGET_ERRORS = tuple(10.0**-k for k in range(2, 12))
# Lower orders would save a tenth of the time at 1e-2, and nothing from 1e-4 on.
IN_HOUSE_SCHEMES = ("order8", "srkn14", "extrapolated12", "extrapolated14")
# Cost, relative to the cheapest scheme, that is assumed for a scheme which cannot reach an error.
# Schemes with a larger expected cost are not run.
HOPELESS = 5.0
_REPEATS = 2


def lammps_costs(random: Random, target_error: float) -> dict[str, float]:
    """Return the time of each scheme in LAMMPS for a target error, in a random scene."""
    scene = draw_scene(random, most=300)
    reference_value = converge(scene.problem, 0.03 * target_error)
    scouting = pilot_from_run(reference_value)
    model = shipped_cost_model()
    numerics = {}
    for scheme in LAMMPS_SCHEMES:
        if not is_supported_by_lammps(scene.problem, scheme, target_error):
            continue
        try:
            numerics[scheme] = choose_numerics(
                scene.problem, target_error, scouting, schemes=(scheme,)
            )
        except RunError:
            continue
    foreseen = {
        scheme: model.integration(scene.problem, chosen, scouting.end.last_contact_time)
        for scheme, chosen in numerics.items()
    }
    costs = {}
    for scheme, chosen in numerics.items():
        if foreseen[scheme] <= HOPELESS * min(foreseen.values()):
            steps = (chosen.timestep, 2.0 * chosen.timestep)
            costs[scheme] = _least(lambda: lammps.run_at_steps(scene.problem, chosen, steps))  # noqa: B023
    return costs


def reference_costs(random: Random, target_error: float) -> dict[str, float]:
    """Return the time of each scheme in the reference engine for a target error."""
    scene = draw_scene(random, most=300, potentials=("lj", "toda", "log", "power"))
    reference_value = converge(scene.problem, max(0.03 * target_error, 3e-14 * scene.particles))
    costs = {}
    for scheme in IN_HOUSE_SCHEMES:
        wanted = 0.5 * target_error / usual_share(scheme)
        coarse = find_step(
            scene.problem,
            scheme,
            wanted,
            reference_value,
            guess_step(scene.problem, scheme, wanted),
        )
        if coarse is not None:
            step = coarse / COARSER[0]
            costs[scheme] = _least(lambda: run_reference(scene.problem, scheme, step))  # noqa: B023
    return costs


def _least(run: Callable[[], object]) -> float:
    least = np.inf
    for _ in range(_REPEATS):
        started = time.thread_time()
        run()
        least = min(least, time.thread_time() - started)
    return float(least)


def measure_losses(
    draw: Callable[[Random, float], dict[str, float]],
    schemes: tuple[str, ...],
    random: Random,
    scenes: int,
) -> dict[float, dict[str, float]]:
    """Return the mean logarithm of each scheme's relative cost, by target error."""
    losses = {}
    for target_error in TARGET_ERRORS:
        found: list[list[float]] = []
        while len(found) < scenes:
            try:
                costs = draw(random, target_error)
            except RunError:
                continue
            if costs:
                best = min(costs.values())
                worst = HOPELESS * best
                found.append([np.log(min(costs.get(s, worst), worst) / best) for s in schemes])
        losses[target_error] = dict(zip(schemes, np.mean(found, axis=0).tolist(), strict=True))
    return losses


def best_table(losses: dict[float, dict[str, float]]) -> tuple[dict[str, float], float]:
    """
    Return the smallest target error at which each scheme is used, and the mean loss.

    From loose to tight target errors, a scheme is only replaced by a later one. The cheapest of all
    such sequences is returned. The last scheme is used for all smaller target errors. The loss is
    the geometric mean of the cost divided by that of the cheapest scheme.
    """
    target_errors = sorted(losses, reverse=True)
    schemes = list(next(iter(losses.values())))
    # Cheapest sequence that ends with each scheme. A scheme is only replaced by a later one.
    ways: list[tuple[float, list[str]]] = [(0.0, []) for _ in schemes]
    for target_error in target_errors:
        reached = [min(ways[: k + 1], key=lambda way: way[0]) for k in range(len(schemes))]
        ways = [
            (total + losses[target_error][scheme], [*path, scheme])
            for (total, path), scheme in zip(reached, schemes, strict=True)
        ]
    total, path = min(ways, key=lambda way: way[0])
    table = {}
    for scheme in dict.fromkeys(path):
        last = max(k for k, each in enumerate(path) if each == scheme)
        # Half-way to the next target error on a logarithmic scale; target errors are powers of ten.
        table[scheme] = (
            0.0 if last == len(target_errors) - 1 else float(f"{target_errors[last] / 10**0.5:.1g}")
        )
    return table, float(np.exp(total / len(target_errors)))
