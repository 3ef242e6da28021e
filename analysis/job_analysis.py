"""Analysis of the dump of a job, with data from its other files."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.collision_frames import EndArgument, Known
from chaincor.analysis.dumps.chain_frames import BODY_COLUMN, ChainLayout
from chaincor.analysis.dumps.frame import DumpFrame, DumpFrames
from chaincor.analysis.dumps.masses import masses_of_bodies
from chaincor.analysis.dumps.run_commands import is_computed
from chaincor.analysis.dumps.view import DumpView
from chaincor.analysis.frame_analysis import analyze_frames
from chaincor.analysis.job_folder import Job, count_atoms_and_bonds
from chaincor.analysis.results import CollisionAnalysis
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import Harmonic
from chaincor.lammps_inputs.errors import InputError

# Equal velocities may differ by this fraction if they are printed with the default six digits.
_SAME_SPEED = 1e-5


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
    Analyse the dump of a job, with data from its other files.

    Parameters
    ----------
    job : Job
        Files of the job.
    bond : Potential, optional
        Potential of the bonds; by default from ``scene.toml``.
    impact_velocity : float, optional
        v0; by default from ``scene.toml`` or the first frame.
    timestep : float, optional
        Simulated time per step, for dumps that do not carry the time. By default it comes from the
        log, the script or the flight of the last particle.
    masses : array_like, optional
        Particle masses from the wall outwards, repeated along the chain. By default they come from
        the dump, from the types in the data file and the script, or from ``scene.toml``. Without
        these sources, masses are 1.
    end_argument : callable, optional
        See :class:`~chaincor.analysis.collision_frames.Known`.
    progress : callable, optional
        Called with the number of bytes of the dump read so far.
    view : DumpView, optional
        Units of the dump, position of its wall, and direction of the chain. The arguments
        `impact_velocity`, `timestep` and `masses` are in the same units. By default the view comes
        from ``units.toml`` beside the dump. Without this file, the dump must be in the chain's
        units, with the wall at x = 0 below the chain.
    target_particles : int, optional
        Number of particles of a free target; by default from ``scene.toml`` or the dump. Without a
        column ``mol``, the target consists of the particles at the lowest x.

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
    if view is not None:
        job = replace(job, seen=view)
    view, scene = job.view, job.loaded_scene
    units = view.units
    _refuse_other_units(job, units.style)
    dump = job.frames()
    first = dump.first()
    layout = ChainLayout.from_frame(first, target_particles_of(job, first, target_particles))
    known = Known(
        bond=bond,
        impact_velocity=None if impact_velocity is None else impact_velocity / units.speed,
        timestep=None if timestep is None else timestep / units.time,
        targets=layout.targets,
        soft=scene is not None and scene.problem.contact_duration > 0.0,
        end_argument=end_argument,
    )
    known, notes = _with_scene(known, job, layout)
    if scene is None and (view.wall != 0.0 or view.upwards):
        side = "+x" if view.upwards else "-x"
        notes.append(
            f"the wall is assumed to be at x = {view.wall:g}, with a chain that moves along {side}"
        )
    if job.data is not None and not known.targets and not known.soft:
        _refuse_other_chain(job.data, layout.particles, job.dump)
    by_type = {kind: mass / units.mass for kind, mass in job.masses.by_type.items()}
    bodies, declared = masses_of_bodies(
        first,
        layout,
        given=None if masses is None else np.asarray(masses, dtype=float) / units.mass,
        declared=replace(job.masses, by_type=by_type),
        scene=scene,
    )
    known = replace(known, masses=bodies)
    if not declared:
        notes.append(
            "the masses are unknown, so all particles are given mass 1; use --masses to change this"
        )
    if job.commands.stock_wall:
        notes.append(
            "the run used fix wall/reflect: each contact causes an error of first order in the "
            "timestep; the total error of restitution is usually 1e-3 to 1e-2, and energy and "
            "momentum hardly show it"
        )
    if known.timestep is None and not layout.time_known:
        step = job.commands.timestep
        if step is not None:
            step /= units.time
        else:
            step = infer_timestep(dump, layout)
            if step is not None:
                notes.append(
                    f"the dump contains no times, so the time step {step:.6g} was estimated from "
                    "the flight of the last particle; --timestep sets it exactly"
                )
        known = replace(known, timestep=step)
    return replace(analyze_frames(dump, known, notes, progress), job=job)


def target_particles_of(job: Job, first: DumpFrame, given: int | None = None) -> int:
    """
    Return the number of particles of a free target; 0 for a wall.

    The number comes from `given`, from ``scene.toml``, or from the column ``mol`` in the first
    frame of the dump, which is 1 in the chain and 2 in the target. Raises InputError if these
    sources differ.
    """
    scene = job.loaded_scene
    counts: dict[str, int] = {}
    if given is not None:
        counts["--target-particles"] = given
    if scene is not None:
        counts[str(job.scene)] = scene.target_particles or 0
    if BODY_COLUMN in first.columns:
        numbers = first.column(BODY_COLUMN)
        if set(numbers.tolist()) == {1.0, 2.0}:
            counts[f"column {BODY_COLUMN} of the dump"] = int(np.sum(numbers == 2.0))
    if len(set(counts.values())) > 1:
        shown = ", ".join(f"{source} {count}" for source, count in counts.items())
        raise InputError(
            f"the numbers of particles of the free target differ: {shown}. Give one number"
        )
    return next(iter(counts.values()), 0)


def _with_scene(known: Known, job: Job, layout: ChainLayout) -> tuple[Known, list[str]]:
    """Complete the user's data from the scene of the job, or from the springs in its script."""
    scene = job.loaded_scene
    if scene is None or job.scene is None:
        if known.bond is not None or job.commands.setup.spring is None:
            return known, []
        note = "the script or log has bond_style harmonic, so energies are those of harmonic bonds"
        return replace(known, bond=Harmonic()), [note]
    notes = []
    if known.bond is not None and known.bond != scene.bond:
        notes.append(
            f"energies are computed for {known.bond.name} bonds, as requested, although "
            f"{job.scene.name} has {scene.label} bonds"
        )
    _expect_count(scene.problem.all_particles, job.scene, layout.all_particles, job.dump)
    known = replace(
        known,
        bond=known.bond or scene.bond,
        impact_velocity=known.impact_velocity or scene.impact_velocity,
    )
    return known, notes


def infer_timestep(dump: DumpFrames, layout: ChainLayout) -> float | None:
    """
    Return the simulated time per step, from the free flight of the last particle.

    Until sound has crossed the chain, the particle farthest from the wall flies freely. Its path,
    its speed and the number of steps between frames then give the time per step. Only frames during
    this flight are read. The result is None if fewer than two frames show the flight.
    """
    first = timestep = None
    for frame in dump:
        state = layout.state(frame, 0.0)
        x, velocity = state.displacements[-1], state.velocities[-1]
        if first is None:
            first = frame.step, x, velocity
        if velocity == 0.0 or not np.isclose(velocity, first[2], rtol=_SAME_SPEED, atol=0.0):
            break
        if frame.step > first[0]:
            timestep = float((x - first[1]) / (first[2] * (frame.step - first[0])))
    return timestep if timestep is not None and timestep > 0.0 else None


def _refuse_other_units(job: Job, style: str) -> None:
    for path, commands in job.commands.files.items():
        units = (c for c in commands if c[0] == "units" and not is_computed(c))
        other = next((word for c in units for word in c[1:2] if word != style), None)
        if other is not None:
            raise InputError(
                f"{path} sets units {other}, but units {style} are given. Give --units as in "
                "the script; --length, --mass and --stiffness are the chain's units in the "
                "units of the dump"
            )


def _expect_count(expected: int, source: Path, found: int, dump: Path) -> None:
    if expected != found:
        raise InputError(
            f"{dump} has {found} particles, but {source} has {expected}. Give the dump of this job"
        )


def _refuse_other_chain(data: Path, particles: int, dump: Path) -> None:
    """Refuse a data file that does not match the dump, or that has more than one open chain."""
    atoms, bonds = count_atoms_and_bonds(data)
    _expect_count(atoms, data, particles, dump)
    if bonds not in (
        0,
        particles - 1,
    ):  # without bonds in the data file, other forces bind the chain
        raise InputError(
            f"{data} has {bonds} bonds between {particles} particles. Give one open chain "
            f"with {particles - 1} bonds; all particles of the dump count as this chain"
        )
