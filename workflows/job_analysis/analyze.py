"""Analyse the dump of a LAMMPS job, for a wall or a free target."""

import os
from pathlib import Path

from numpy.typing import ArrayLike

from chaincor.analysis.results import CollisionAnalysis
from chaincor.analysis.step_error import analyze_folder
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import shown
from chaincor.workflows.engines.ending import argue_end


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
    Analyse the dump of a LAMMPS job, like ``chaincor analyze``.

    Parameters
    ----------
    folder : path
        Folder of a job that ``chaincor inputs`` or you wrote. If subfolders contain the same
        collision at several time steps, the run with the smallest step is analysed, and its error
        is found from the other runs.
    data, dump : path, optional
        Files to read; by default, files in the folder.
    scene : path, optional
        File with the scene of the job; by default ``scene.toml`` beside the dump.
    bond : Potential, optional
        Potential of the bonds, such as ``Scene(potential="toda").bond``; by default taken from
        ``scene.toml``.
    velocity : float, optional
        Impact speed v0; by default taken from ``scene.toml`` or the first frame.
    timestep : float, optional
        Simulated time per step, needed if the dump contains no times; by default taken from log or
        script.
    masses : array_like, optional
        Masses from the wall outwards, which are repeated along the chain; by default taken from the
        dump, the data file or the scene.
    target_particles : int, optional
        Number of particles in a free target, which are those with the lowest x; by default taken
        from ``scene.toml`` or the dump.

    Returns
    -------
    CollisionAnalysis
        Results of the analysis. The attribute `target` is None for a wall.

    Raises
    ------
    InputError
        If the files contradict each other or do not show a collision.

    Examples
    --------
    >>> from chaincor import Scene, analyze, collide
    >>> result = collide(Scene(potential="harmonic", particles=10, dump="motion.dump"))
    >>> analysis = analyze(".")
    >>> round(analysis.restitution, 4), analysis.contacts
    (0.9071, 9)
    """
    if not isinstance(folder, str | os.PathLike):
        raise InputError(f"{shown(folder)} is not a folder. Give the folder of a LAMMPS job")
    return analyze_folder(
        folder,
        data=data,
        dump=dump,
        scene=scene,
        bond=bond,
        impact_velocity=velocity,
        timestep=timestep,
        masses=masses,
        target_particles=target_particles,
        end_argument=argue_end,
    )
