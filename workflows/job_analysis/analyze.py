"""The dump of a LAMMPS job, whichever bodies it shows, to the physics of the collision."""

import os
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from chaincor.analysis.dumps.view import DumpView
from chaincor.analysis.job_analysis import analyze_job
from chaincor.analysis.job_folder import Job
from chaincor.analysis.results import CollisionAnalysis
from chaincor.analysis.step_error import analyze_folder
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.ending import argue_end

Progress = Callable[[int], None] | None


def analyze(
    folder: Path | str,
    *,
    data: Path | str | None = None,
    dump: Path | str | None = None,
    scene: Path | str | None = None,
    bond: Potential | None = None,
    velocity: float | None = None,
    timestep: float | None = None,
    masses: ArrayLike | None = None,
    target_particles: int | None = None,
) -> CollisionAnalysis:
    """
    Turn the dump of a LAMMPS job into the physics of the collision, as ``chaincor analyze`` does.

    Parameters
    ----------
    folder : path
        Of a job made by ``chaincor inputs``, or of your own. Where folders in it hold the same
        collision at other steps, these tell the error of the finest.
    data, dump : path, optional
        Files to take, instead of those found.
    scene : path, optional
        Scene of the job, in place of a ``scene.toml`` beside the dump.
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
    CollisionAnalysis
        Its `target` is that of a free target, None of a wall.

    Raises
    ------
    InputError
        If the files do not fit together or do not show a collision.

    Examples
    --------
    >>> from chaincor import Scene, analyze, collide
    >>> result = collide(Scene(potential="harmonic", particles=10, dump="motion.dump"))
    >>> analysis = analyze(".")
    >>> round(analysis.restitution, 4), analysis.contacts
    (0.9071, 9)
    """
    if not isinstance(folder, str | os.PathLike):
        raise InputError(f"{folder!r} was given; expected the folder of a LAMMPS job")
    return analyze_found(
        folder,
        data=data,
        dump=dump,
        scene=scene,
        bond=bond,
        impact_velocity=velocity,
        timestep=timestep,
        masses=masses,
        target_particles=target_particles,
    )[1]


def analyze_found(
    folder: Path | str,
    *,
    data: Path | str | None = None,
    dump: Path | str | None = None,
    scene: Path | str | None = None,
    watch: Callable[[Path], AbstractContextManager[Progress]] | None = None,
    see: Callable[[Job], DumpView] | None = None,
    **known: Any,
) -> tuple[Job, CollisionAnalysis]:
    """
    Return the job that was found, too.

    `scene` takes the place of a ``scene.toml`` beside the dump, `known` are what else
    :func:`~chaincor.analysis.job_analysis.analyze_job` is told; `watch` is entered while a
    dump is read, and gives what to tell how far; `see` tells units and wall of a dump.
    """

    def analyze_one(job: Job) -> CollisionAnalysis:
        view = None if see is None else see(job)
        with nullcontext() if watch is None else watch(job.dump) as progress:
            return analyze_job(job, end_argument=argue_end, progress=progress, view=view, **known)

    run = analyze_folder(folder, data=data, dump=dump, scene=scene, analyze=analyze_one)
    return run.job, run.analysis
