"""The dump of a LAMMPS job, whichever bodies it shows, to the physics of the collision."""

import os
from pathlib import Path

from numpy.typing import ArrayLike

from chaincor.analysis.results import CollisionAnalysis
from chaincor.analysis.step_error import analyze_folder
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError
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
        From the wall outwards, repeated along the chain; by default those of dump, data file or
        scene.
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
