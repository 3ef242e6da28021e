"""The dump of a LAMMPS job, whichever bodies it shows, to the physics of the collision."""

import os
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from numpy.typing import ArrayLike

from chaincor.analysis.dumps.view import DumpView
from chaincor.analysis.job_folder import Job, analyze_job, view_of
from chaincor.analysis.results import CollisionAnalysis
from chaincor.analysis.step_error import analyze_folder
from chaincor.analysis.two_bodies.job import analyze_two_bodies, find_two_bodies
from chaincor.analysis.two_bodies.results import TwoBodyAnalysis
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.ending import argue_end

Progress = Callable[[int], None] | None
Analysis = CollisionAnalysis | TwoBodyAnalysis


def _unwatched(_dump: Path) -> AbstractContextManager[Progress]:
    return nullcontext(None)


def analyze(
    folder: Path | str,
    *,
    data: Path | str | None = None,
    dump: Path | str | None = None,
    bond: Potential | None = None,
    velocity: float | None = None,
    timestep: float | None = None,
    masses: ArrayLike | None = None,
    target_particles: int | None = None,
) -> Analysis:
    """
    Turn the dump of a LAMMPS job into the physics of the collision, as ``chaincor analyze`` does.

    Parameters
    ----------
    folder : path
        Of a job made by ``chaincor inputs``, or of your own. Where folders in it hold the same
        collision at other steps, these tell the error of the finest.
    data, dump : path, optional
        Files to take, instead of those found.
    bond : Potential, optional
        The bonds' potential, such as ``Scene(potential="toda").bond``; by default that of
        ``scene.toml``.
    velocity : float, optional
        Impact speed v0; by default that of ``scene.toml`` or of the first frame.
    timestep : float, optional
        Simulated time per step, for dumps without the time; by default that of log or script.
    masses : array_like, optional
        From the wall outwards, repeated along the chain; by default those of dump or data file.
    target_particles : int, optional
        How many particles, those at the lowest x, are a free target's; by default as
        ``scene.toml`` or the dump says.

    Returns
    -------
    CollisionAnalysis or TwoBodyAnalysis
        The second of a free target or a soft wall.

    Raises
    ------
    InputError
        If the files do not fit together or do not show a collision.
    """
    if not isinstance(folder, str | os.PathLike):
        raise InputError(f"{folder!r} was given; expected the folder of a LAMMPS job")
    return analyze_found(
        folder,
        data=data,
        dump=dump,
        bond=bond,
        velocity=velocity,
        timestep=timestep,
        masses=masses,
        target_particles=target_particles,
    )[1]


def analyze_found(
    folder: Path | str,
    *,
    data: Path | str | None,
    dump: Path | str | None,
    bond: Potential | None,
    velocity: float | None,
    timestep: float | None,
    masses: ArrayLike | None,
    target_particles: int | None,
    for_walls: Iterable[str] = (),
    watch: Callable[[Path], AbstractContextManager[Progress]] = _unwatched,
    see: Callable[[Job], DumpView] = view_of,
) -> tuple[Job, Analysis]:
    """
    Return the job that was found, too.

    `for_walls` names what else is asked for that goes with hard walls only; `watch` is entered
    while a dump is read, and gives what to tell how far; `see` tells units and wall of a dump.
    """
    data = None if data is None else Path(data)
    dump = None if dump is None else Path(dump)
    found = find_two_bodies(folder, data, dump, target_particles)
    if found is not None:
        unused = {"masses": masses, "velocity": velocity}
        given = [name for name, value in unused.items() if value is not None]
        if given := [*given, *for_walls]:
            raise InputError(
                f"{', '.join(given)}: of a free target or a soft wall masses and velocities are "
                "read from dump and data file, and figures are not drawn; expected none of them"
            )
        job, targets = found
        with watch(job.dump) as progress:
            return job, analyze_two_bodies(
                job, targets, bond=bond, timestep=timestep, progress=progress, view=see(job)
            )

    def analyze_one(job: Job) -> CollisionAnalysis:
        with watch(job.dump) as progress:
            return analyze_job(
                job,
                bond=bond,
                impact_velocity=velocity,
                timestep=timestep,
                masses=masses,
                end_argument=argue_end,
                progress=progress,
                view=see(job),
            )

    run = analyze_folder(folder, data=data, dump=dump, analyze=analyze_one)
    return run.job, run.analysis
