"""Solve cold chains with many speeds in one batch; the results equal those of single runs."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.modes import mode_energies
from chaincor.analysis.restitution import centre_of_mass_velocity
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.bounded_run import BoundedRun, bounded_run
from chaincor.workflows.accuracy.fixed_steps import LONGEST_TRUSTED
from chaincor.workflows.accuracy.plan import Plan, plan
from chaincor.workflows.accuracy.plans import plans, shares_work
from chaincor.workflows.accuracy.step_proof import COARSER, difference, proved_error
from chaincor.workflows.engines.ending import sound_round_trip
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.batch.chains import ManyRuns, StartStates
from chaincor.workflows.engines.reference.batch.runner import Batch
from chaincor.workflows.engines.reference.finish import End, LastContact, finish, kinetic_energy
from chaincor.workflows.engines.rounding import rounding_error, rounding_matters

# Longer chains are solved alone, because they need more than three runs, and their loops gain
# nothing from a batch.
LONGEST_TOGETHER = LONGEST_TRUSTED
# A batch with fewer collisions leaves lanes empty, and saves less time than loading its loop takes.
LEAST_TOGETHER = 16
# A collision in a batch takes about this fraction of the time of a single run; measured: 0.1 (short
# chains) to 0.5.
TOGETHER_SHARE = 0.3
# A batch has at most this many collisions and seconds of work. Progress is then shown often, and an
# interruption loses little work.
_MOST_TOGETHER, _SECONDS_TOGETHER = 256, 0.5


# Collisions can be solved in one batch if these three values are equal: the id of the bond object,
# the number of particles, and the scheme. All scenes that name the same bond with the same
# parameters use one bond object.
BatchKind = tuple[int, int, StepSchemeName]


class SceneBatch(NamedTuple):
    """Collisions of a task that are solved together in one batch, or a single collision."""

    places: list[int]  #: Indices of the scenes in the task.
    plans: list[Plan]  #: Plans of the scenes.


def batch_kind(scene: Scene, planned: Plan | None = None) -> BatchKind | None:
    """
    Return the kind of batch that fits a collision; None if the collision is solved alone.

    `planned` is the plan of the scene, made here by default.

    Batches support cold chains of unit masses at a hard wall, in the reference engine with fixed
    steps, if the tolerance is far above the rounding error.
    """
    if not shares_work(scene):
        return None
    if not 2 <= scene.particles <= LONGEST_TOGETHER or scene.bond.force_kernel is None:
        return None
    planned = planned or plan(scene)
    if not planned.regular:
        return None
    assert planned.numerics is not None
    assert planned.target_error is not None
    if rounding_matters("reference", planned.problem, planned.target_error):
        return None
    if planned.usually_shatters:
        # such a chain needs runs at several time steps, and the search for its end takes most of
        # the time
        return None
    return id(scene.bond), scene.particles, planned.numerics.scheme


def batches(scenes: Sequence[Scene]) -> list[SceneBatch]:
    """
    Divide the collisions of a task into batches and single collisions.

    The result of a collision does not depend on this division.
    """
    planned = plans(scenes)
    kinds: dict[BatchKind | int, list[int]] = {}
    for place, scene in enumerate(scenes):
        kind = batch_kind(scene, planned[place]) if len(scenes) >= LEAST_TOGETHER else None
        kinds.setdefault(kind or place, []).append(place)
    found = []
    for places in kinds.values():
        size = 1
        if len(places) >= LEAST_TOGETHER:
            each = TOGETHER_SHARE * planned[places[0]].seconds
            size = max(min(int(_SECONDS_TOGETHER / each), _MOST_TOGETHER), LEAST_TOGETHER)
        parts = [places[k : k + size] for k in range(0, len(places), size)]
        found += [SceneBatch(part, [planned[place] for place in part]) for part in parts]
    return found


def solve_batch(planned: Sequence[Plan]) -> list[tuple[BoundedRun, Array] | None]:
    """
    Solve planned scenes with the same :func:`batch_kind` to their tolerances.

    Each scene is run at the step of its plan, at twice this step and at 1.3 times it. The result is
    None if the target error is missed or the three runs have different numbers of contacts; the
    scene must then be solved alone. Otherwise the result consists of the same run as from
    ``solve_to_tolerance``, to the last bit, and the energies of the modes after the collision. No
    result depends on the other scenes.
    """
    problems, problem = [each.problem for each in planned], planned[0].problem
    floor = rounding_error("reference", problem)
    numerics = [each.numerics for each in planned if each.numerics is not None]
    particles, scheme = problem.particles, numerics[0].scheme
    batch = Batch(problem.line, problem.bond, scheme)
    steps = np.array([each.timestep for each in numerics])
    found: list[tuple[BoundedRun, Array] | None] = [None] * len(planned)
    fine = batch.follow_cold(problems, steps)
    places = np.flatnonzero(fine.settled)
    if len(places) == 0:
        return found
    fine, steps = fine.chosen(places), steps[places]
    followed = [problems[place] for place in places.tolist()]
    both = np.concatenate([times * steps for times in COARSER])
    lasts = np.tile(fine.last_contact_times, len(COARSER))
    speeds = np.array([each.impact_velocity for each in followed])
    approaches = np.tile(speeds, len(COARSER))
    compared = batch.compare(StartStates.cold(approaches, particles), both, lasts, approaches)
    coarse = [compared.chosen(part) for part in np.split(np.arange(len(both)), len(COARSER))]
    runs = [fine, *coarse]
    _, errors, agree = compare_many(scheme, steps, runs, speeds, problem.line, floor)
    agree &= fine.longest_silences <= sound_round_trip(particles, problem.slow_stiffness)
    energies, apart = _compared(problem, fine, coarse[0])
    for k, (place, each) in enumerate(zip(places.tolist(), followed, strict=True)):
        target_error, error = planned[place].target_error, float(errors[k])
        assert target_error is not None
        if not (agree[k] and error + floor <= target_error):
            continue
        outcome = _outcome(each, fine, k, scheme, float(steps[k]))
        differences = {name: float(gap[k]) for name, gap in apart.items()}
        tries = [{"timestep": float(steps[k]), "step_error": error}]
        met = bounded_run(outcome, error, differences, tries)
        if met.error <= target_error:
            found[place] = met, energies[k]
    return found


def compare_many(
    scheme: StepSchemeName,
    steps: Array,
    runs: Sequence[ManyRuns],
    speeds: Array,
    line: Line,
    floor: Any,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """
    Compare many runs with runs at `COARSER` times their steps.

    `runs` contains the fine runs, followed by the coarse runs for each factor in `COARSER`. Return
    three arrays of shape (runs,): eta of the fine runs, the errors of eta, and whether all runs are
    settled and have the same number of contacts. `line` is the same for all runs, `floor` is the
    rounding error.
    """
    fine, *coarse = runs
    # `e` and `others` are the centre-of-mass velocities after the collision, divided by the impact
    # velocities. As in `Outcome`, eta is the square of this ratio.
    e, *others = (
        centre_of_mass_velocity(run.velocities, line.chain_masses) / speeds for run in runs
    )
    settled = np.array([run.settled for run in coarse])
    found = []
    for run, other in zip(coarse, others, strict=True):
        room = min(fine.contacts.shape[2], run.contacts.shape[2])
        listed = (fine.listed & (run.counts == fine.counts)[:, None])[:, :room]
        one, two = (np.where(listed, each.contacts[:, 1, :room], 0.0) for each in (fine, run))
        found.append(difference(line, e, other, one, two, speeds))
    far, near = np.where(settled, found, np.inf)
    alike = np.all([run.counts == fine.counts for run in coarse], axis=0)
    errors, _ = proved_error(scheme, fine.lasted / steps, far, near, floor, alike)
    return np.square(e), errors, alike & np.all(settled, axis=0)


def _compared(problem: Problem, fine: ManyRuns, coarse: ManyRuns) -> tuple[Array, dict[str, Array]]:
    """Return the mode energies of fine runs, and the `differences` between fine and coarse runs."""
    alike = fine.counts == coarse.counts
    contacts = np.where(fine.listed[:, None, :], np.abs(fine.contacts - coarse.contacts), 0.0)
    times, speeds = np.where(alike, np.max(contacts, axis=2).T, np.inf)
    energies, others = (
        mode_energies(run.displacements, run.velocities, problem.bond.stiffness)
        for run in (fine, coarse)
    )
    return energies, {
        "contact_times": times,
        "contact_speeds": speeds,
        "velocities": np.max(np.abs(fine.velocities - coarse.velocities), axis=1),
        "target_velocities": np.zeros(len(times)),
        "mode_energies": np.max(np.abs(energies - others), axis=1),
    }


def _outcome(problem: Problem, runs: ManyRuns, k: int, scheme: str, step: float) -> Outcome:
    velocities, count = runs.velocities[k], runs.counts[k]
    return finish(
        problem,
        LastContact(
            strains=runs.strains[k],
            velocities=velocities,
            contact_times=runs.contacts[k, 0, :count].copy(),
            contact_speeds=runs.contacts[k, 1, :count].copy(),
            bond_range=(float(runs.bond_min[k]), float(runs.bond_max[k])),
            energy=kinetic_energy(velocities) + float(runs.energies[k]),
        ),
        End(runs.endings[k], float(runs.durations[k]), int(runs.evaluations[k])),
        scheme=scheme,
        timestep=step,
        seconds=float(runs.seconds[k]),
    )
