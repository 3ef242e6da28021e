"""The dump of a job, and what the files beside it say of it: units, wall, and what meets."""

import numpy as np

from chaincor.analysis.dumps.chain_frames import BODY_COLUMN
from chaincor.analysis.dumps.frame import DumpFrame, Frames
from chaincor.analysis.dumps.other_trajectories import open_trajectory
from chaincor.analysis.dumps.view import DumpView, ViewedDump
from chaincor.analysis.job_folder import Job
from chaincor.analysis.known import Bodies
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.units.unit_system import UNITS_FILE, UnitSystem


def bodies_of(job: Job, first: DumpFrame, given: int | None = None) -> Bodies:
    """
    Return what meets in a job.

    How many particles are a free target's is told by `given`, by ``scene.toml``, or by the first
    frame of the dump, whose column ``mol`` is 1 in the chain and 2 in the target; that bodies are
    soft is told by ``scene.toml``. Raises InputError where these differ.
    """
    scene = job.told_scene
    told: dict[str, int] = {}
    if given is not None:
        told["--target-particles"] = given
    if scene is not None and scene.target_particles is not None:
        told[str(job.scene)] = scene.target_particles
    if BODY_COLUMN in first.columns:
        numbers = first.column(BODY_COLUMN)
        if set(numbers.tolist()) == {1.0, 2.0}:
            told[f"column {BODY_COLUMN} of the dump"] = int(np.sum(numbers == 2.0))
    if len(set(told.values())) > 1:
        shown = ", ".join(f"{source} {count}" for source, count in told.items())
        raise InputError(f"the free target has {shown} particles; expected one number: drop one")
    return Bodies(next(iter(told.values()), 0), scene is not None and scene.contact_duration > 0.0)


def view_of(job: Job) -> DumpView:
    """
    Return how to see the dump of a job, by what lies beside it.

    Units are those of ``units.toml``; without one, and without a scene, those in which its springs
    and masses are 1. The wall is that of ``fix wall/reflect``; of two, the chain flies to one.
    """
    path, setup = job.dump.parent / UNITS_FILE, job.setup
    units = UnitSystem()
    if path.exists():
        units = UnitSystem.from_file(path)
    elif job.scene is None:
        units = setup.units(next(iter(job.masses.by_type.values()), None))
    faces = [*setup.walls]
    if not faces:
        return DumpView(units)
    first = open_trajectory(job.dump).first()
    upwards = faces == ["xhi"]
    if len(faces) > 1 and "vx" in first.columns:
        upwards = bool(np.mean(first.column("vx")) > 0.0)
    place = setup.walls["xhi" if upwards else "xlo"]
    try:
        wall = float(first.bounds[0, int(upwards)] if place == "EDGE" else place)
    except ValueError:
        return DumpView(units)
    return DumpView(units, wall, upwards)


def open_dump(job: Job, view: DumpView) -> Frames:
    """Return the dump of a job in the chain's units; exactly as it is where it is in them."""
    source = open_trajectory(job.dump)
    return source if view == DumpView() else ViewedDump(source, view)
