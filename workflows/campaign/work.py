"""What a worker does: one collision from a scene to its result, or several of a kind at once."""

import math
import threading
import time
from collections.abc import Sequence
from dataclasses import replace

from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.thermal_state import GENERATOR
from chaincor.workflows.accuracy import meet
from chaincor.workflows.accuracy.answer import Answer, spread_of
from chaincor.workflows.accuracy.at_once.together import batches, meet_together
from chaincor.workflows.accuracy.error_bars import PROOF_SHARE, PROOF_STEPS, error_bar, proof_error
from chaincor.workflows.accuracy.expected_cost import expected_of_task, refuse_endless
from chaincor.workflows.accuracy.in_house_runs import eta_of
from chaincor.workflows.accuracy.scouting import scout, scouting_details
from chaincor.workflows.accuracy.table_rows import with_rows
from chaincor.workflows.campaign.carry_out import MACHINE_FAILURES, Task
from chaincor.workflows.engines.in_house import stepping
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.time_limit import limited_to
from chaincor.workflows.errors import MissingLibraryError
from chaincor.workflows.outputs import refuse_unusable_outputs
from chaincor.workflows.result import Collision
from chaincor.workflows.result_of import result_of
from chaincor.workflows.store.row import Row

# What is predicted to take longer than a day is refused, unless it is asked for.
MOST_SECONDS = 86400.0
# A Dask worker may have several threads; LAMMPS is not made for several at once in one process.
_one_at_a_time = threading.Lock()


def collide_one(scene: Scene, most_seconds: float) -> Collision:
    """Carry out one collision, see :func:`chaincor.workflows.collision.collide`."""
    started = time.perf_counter()
    refuse_unusable_outputs(scene)
    refuse_endless(scene, most_seconds)
    asked = scene.asked_tolerance
    with limited_to(most_seconds):
        answer = _run_as_given(scene) if asked is None else meet.meet(scene, asked)
        answer = with_rows(scene, answer, asked)
    if scene.temperature is not None:
        gap = float(scene.line.strains[scene.line.gap])
        drawn = {"draw": {"generator": GENERATOR, "gap": gap}}
        answer = replace(answer, details=answer.details | drawn)
    result = result_of(scene, answer, started)
    if scene.arrays is not None:
        result.save_arrays(scene.arrays)
    return result


def collide_together(scenes: Sequence[Scene]) -> list[Collision | None]:
    """
    Carry out collisions of one kind at once, see ``accuracy.at_once.together``.

    Each result is what :func:`collide_one` gives, but for the seconds it took; None where it has to
    be asked.
    """
    started = time.perf_counter()
    answers = meet_together(scenes)
    whole = time.perf_counter() - started
    found: list[Collision | None] = []
    for scene, answered in zip(scenes, answers, strict=True):
        if answered is None:
            found.append(None)
            continue
        answer, energies = answered
        begun = time.perf_counter() - whole / len(scenes)
        found.append(result_of(scene, answer, begun, energies))
    return found


def _run_as_given(scene: Scene) -> Answer:
    numerics = Numerics.from_scene(scene)
    scouted = scout(scene)
    if scouted is not None:
        numerics = replace(numerics, bond_range=scouted.table_range(scene))
    timesteps = [numerics.timestep]
    if scene.error:
        timesteps += [share * numerics.timestep for share in PROOF_STEPS]
    if scene.engine == "lammps":
        outcome, *others = lammps.run_at_steps(scene, numerics, timesteps)
    else:
        outcome, *others = (stepping.run(scene, replace(numerics, timestep=h)) for h in timesteps)
    found = scouting_details(scouted)
    step = None
    if others:
        eta = eta_of(scene, outcome)
        step = proof_error(numerics.wall, [eta_of(scene, run) - eta for run in others])
        # Arrays err by as much more than they differ as eta does.
        share = PROOF_SHARE[numerics.wall]
        spreads = [spread_of(scene, outcome, run) for run in others]
        found["spread"] = {name: share * max(s[name] for s in spreads) for name in spreads[0]}
    return Answer(outcome, error_bar(outcome, scene, step), details=found)


def collide_scenes(scenes: Sequence[Scene]) -> list[Collision | Exception | None]:
    """
    Carry out one collision, or several of a kind at once; this runs wherever a worker is.

    Named failures are returned, and those of the machine: no memory, no room for files. Where
    several fail, each has to be carried out alone, and gets its own error. Any other error is one
    of the program or of the user's own bond, and stops whatever asked.

    Raises MissingLibraryError if no collision at all can be run here.
    """
    try:
        with _one_at_a_time:
            if len(scenes) > 1:
                return [*collide_together(scenes)]
            # What many collisions take is forecast for all; none is refused on the way.
            return [collide_one(scenes[0], math.inf)]
    except MissingLibraryError:
        raise
    except (ChaincorError, *MACHINE_FAILURES) as error:
        return [error] if len(scenes) == 1 else [None] * len(scenes)


def collide_to_rows(scenes: Sequence[Scene]) -> list[Row | None]:
    """Do the same for a store: what takes long is not left to where all rows come together."""
    return [None if each is None else Row.of(each) for each in collide_scenes(scenes)]


def tasks_of(
    scenes: Sequence[Scene], parts: int, places: Sequence[int] | None = None
) -> list[Task]:
    """
    Share collisions out: those to be carried out together, and each of the others by itself.

    Those of a kind are divided into `parts` at least, if they are enough. What comes of a
    collision does not depend on it.
    """
    numbers = range(len(scenes)) if places is None else places
    whole = Task(numbers, scenes, [0.0] * len(scenes))
    shared = [whole.part(batch) for batch in batches(scenes, parts)]
    return [task._replace(costs=expected_of_task(task.scenes)) for task in shared]
