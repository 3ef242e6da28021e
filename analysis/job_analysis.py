"""The dump of a job, analysed with what its other files know."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.data_file import DeclaredMasses
from chaincor.analysis.dumps.frame import DumpFrame, Frames
from chaincor.analysis.dumps.masses import find_masses
from chaincor.analysis.dumps.timestep import infer_timestep, read_timestep
from chaincor.analysis.dumps.view import DumpView
from chaincor.analysis.frame_analysis import analyze_frames
from chaincor.analysis.job_dump import bodies_of, open_dump, view_of
from chaincor.analysis.job_folder import Job, count_atoms, count_bonds
from chaincor.analysis.known import CHAIN_AND_WALL, EndArgument, Known
from chaincor.analysis.results import CollisionAnalysis
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import Harmonic
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.units.unit_system import UnitSystem


def analyze_job(
    job: Job,
    *,
    bond: Potential | None = None,
    impact_velocity: float | None = None,
    timestep: float | None = None,
    masses: ArrayLike | None = None,
    end_argument: EndArgument | None = None,
    progress: Callable[[int], None] | None = None,
    view: DumpView | None = None,
    target_particles: int | None = None,
) -> CollisionAnalysis:
    """
    Analyse the dump of a job, with what its other files know.

    Parameters
    ----------
    job : Job
        Files of the job.
    bond : Potential, optional
        The bonds' potential; that of ``scene.toml`` by default.
    impact_velocity : float, optional
        v0; that of ``scene.toml`` or of the first frame by default.
    timestep : float, optional
        Simulated time per step, for dumps that do not carry the time; from the log, the script or
        the flight of the last particle by default.
    masses : array_like, optional
        Particle masses from the wall outwards, repeated along the chain; by default those of the
        dump, else of the data file and the script by type, else 1.
    end_argument : callable, optional
        See :class:`~chaincor.analysis.known.Known`.
    progress : callable, optional
        Called with the number of bytes of the dump read so far.
    view : DumpView, optional
        Units of the dump, where its wall is and which way the chain moves; velocity, timestep and
        masses that are given are in these units too. By default those of ``units.toml`` beside the
        dump, else the chain's own, with the wall at 0 below the chain.
    target_particles : int, optional
        So many particles, those at the lowest x where the dump has no column ``mol``, are a free
        target; by default as :func:`~chaincor.analysis.job_dump.bodies_of` tells it.

    Returns
    -------
    CollisionAnalysis
        All results.

    Raises
    ------
    InputError
        If the files do not fit together or do not show a collision.

    Examples
    --------
    >>> from chaincor import Scene, analyze_job, collide, find_job
    >>> result = collide(Scene(potential="harmonic", particles=10, dump="motion.dump"))
    >>> analyze_job(find_job(".")).contacts
    9
    """
    view = view or view_of(job)
    units = view.units
    _refuse_other_units(job, units.style)
    dump = open_dump(job, view)
    first = dump.first()
    bodies = bodies_of(job, first, target_particles)
    layout = ChainLayout.from_frame(first, bodies.targets)
    told = Known(
        bond=bond,
        impact_velocity=None if impact_velocity is None else impact_velocity / units.speed,
        timestep=None if timestep is None else timestep / units.time,
        masses=None if masses is None else np.asarray(masses, dtype=float) / units.mass,
        bodies=bodies,
        end_argument=end_argument,
    )
    known, notes = _with_scene(told, job, layout)
    if job.scene is None and (view.wall != 0.0 or view.upwards):
        side = "+x" if view.upwards else "-x"
        notes.append(f"the wall is taken to be at x = {view.wall:g}, met by a chain along {side}")
    known = replace(known, declared=_declared_masses(job, units))
    if job.data is not None and bodies == CHAIN_AND_WALL:
        _refuse_other_chain(job.data, layout.particles, job.dump)
    notes += _unknown_masses(known, job, first, layout)
    if job.commands.stock_wall:
        notes.append(
            "the run used fix wall/reflect: each contact then costs an error of first order in "
            "the timestep, usually 1e-3 to 1e-2 of restitution in all, which energy and momentum "
            "hardly show"
        )
    if known.timestep is None and not layout.time_known:
        found, said = _timestep_of(job, dump, layout, units)
        known, notes = replace(known, timestep=found), notes + said
    return analyze_frames(dump.frames(progress), known, notes, lambda: dump.truncated)


def _with_scene(told: Known, job: Job, layout: ChainLayout) -> tuple[Known, list[str]]:
    """Complete what a user told by the scene of the job, or by the springs of its script."""
    scene = job.told_scene
    if scene is None or job.scene is None:
        if told.bond is not None or job.setup.spring is None:
            return told, []
        note = "script or log says bond_style harmonic: energies are those of such bonds"
        return replace(told, bond=Harmonic()), [note]
    notes = []
    if told.bond is not None and told.bond != scene.bond:
        notes.append(
            f"energies are those of {told.bond.name} bonds, as asked for, where {job.scene.name} "
            f"has {scene.label} ones"
        )
    _expect_count(scene.all_particles, job.scene, layout.by_ids.particles, job.dump)
    known = replace(
        told,
        bond=told.bond or scene.bond,
        impact_velocity=told.impact_velocity or scene.impact_velocity,
    )
    return known, notes


def _declared_masses(job: Job, units: UnitSystem) -> DeclaredMasses:
    """Return the masses that the files of a job declare, in the chain's units."""
    by_type = {kind: mass / units.mass for kind, mass in job.masses.by_type.items()}
    return replace(job.masses, by_type=by_type)


def _unknown_masses(known: Known, job: Job, first: DumpFrame, layout: ChainLayout) -> list[str]:
    """Say where masses are taken to be 1; InputError where they differ and are not known."""
    given = None if known.bodies.targets else known.masses  # which are refused then
    found = find_masses(first, layout.by_ids, given=given, declared=known.declared)
    if job.scene is not None or found is not None:
        return []
    return [
        "nothing tells the masses: particles are taken to be alike, of mass 1; --masses gives them"
    ]


def _timestep_of(
    job: Job, dump: Frames, layout: ChainLayout, units: UnitSystem
) -> tuple[float | None, list[str]]:
    """Return the timestep that log, script or the flight of the last particle tells."""
    timestep = read_timestep(job.commands)
    if timestep is not None:
        return timestep / units.time, []
    timestep = infer_timestep(dump, layout)
    if timestep is None:
        return None, []
    return timestep, [
        f"the dump does not carry the time; a step was found to be {timestep:.6g} long from the "
        "flight of the last particle; --timestep gives it exactly"
    ]


def _refuse_other_units(job: Job, style: str) -> None:
    for path, commands in job.commands.files.items():
        said = [c.words[1] for c in commands if c.words[0] == "units" and len(c.words) > 1]
        other = next((found for found in said if found != style), None)
        if other is not None and "$" not in other:
            raise InputError(
                f"{path} sets units {other}; expected units {style}: --units, --length, --mass and "
                "--stiffness say what the chain's own are in those of the dump"
            )


def _expect_count(expected: int, source: Path, found: int, dump: Path) -> None:
    if expected != found:
        raise InputError(
            f"{dump} holds {found} particles, {source} {expected}; expected the dump of that job"
        )


def _refuse_other_chain(data: Path, particles: int, dump: Path) -> None:
    """Refuse a data file of other particles than the dump's, or of more than one open chain."""
    _expect_count(count_atoms(data), data, particles, dump)
    bonds = count_bonds(data)
    if bonds not in (0, particles - 1):  # none: other forces hold the chain together
        raise InputError(
            f"{data} has {bonds} bonds between {particles} particles; expected one open chain with "
            f"{particles - 1}: all particles of the dump are taken to be that chain"
        )
