"""
A dump of two bodies: a chain and the free target that it hits, or a soft wall.

What both do as wholes, and where their energy is, is read off the first and the last frame.
Contacts are not counted: bodies that overlap have none at a time of its own, and between frames
only the momentum tells of them.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from chaincor.analysis.dumps.other_trajectories import open_trajectory
from chaincor.analysis.dumps.printed import printed_error
from chaincor.analysis.dumps.view import DumpView
from chaincor.analysis.job_folder import (
    Job,
    find_job,
    find_jobs_below,
    has_dump,
    masses_declared,
    open_dump,
    view_of,
)
from chaincor.analysis.modes import mode_energies
from chaincor.analysis.restitution import energy_split
from chaincor.analysis.two_bodies.frames import BODY_COLUMN, BodiesLayout, BodiesState
from chaincor.analysis.two_bodies.results import TwoBodyAnalysis
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene

# A body has changed its momentum where that differs by more than rounding of this many additions.
_ROUNDINGS = 64.0
# Digits of the shortest formats of dumps.
_SAME_SPEED = 1e-4
# Sound crosses the longer body and comes back within twice its length over its speed.
_CROSSINGS = 2.0


def find_two_bodies(
    folder: Path | str, data: Path | None, dump: Path | None, given: int | None
) -> tuple[Job, int] | None:
    """
    Return the job in a folder and the particles of its target; None where there is a hard wall.

    Raises InputError as :func:`count_targets`, and where jobs with a target lie in folders below.
    """
    if data is None and dump is None and not has_dump(folder):
        for job in find_jobs_below(folder):
            if count_targets(job, given) is not None:
                raise InputError(
                    f"{job.dump.parent} holds two bodies, of which steps are not compared; "
                    "expected the folder of one job"
                )
        return None
    job = find_job(folder, data=data, dump=dump)
    targets = count_targets(job, given)
    return None if targets is None else (job, targets)


def count_targets(job: Job, given: int | None = None) -> int | None:
    """
    Return how many particles of a job's dump are a free target's; 0 for a soft wall.

    None where there is a chain and a hard wall only. By `given`, by ``scene.toml``, or by the dump,
    whose column ``mol`` is 1 in the chain and 2 in the target. Raises InputError where they differ.
    """
    scene = None if job.scene is None else Scene.from_file(job.scene)
    first = open_trajectory(job.dump).first()
    told: dict[str, int] = {}
    if given is not None:
        told["--target-particles"] = given
    if scene is not None and scene.target_particles is not None:
        told[str(job.scene)] = scene.target_particles
    if BODY_COLUMN in first.columns:
        bodies = first.column(BODY_COLUMN)
        if set(bodies.tolist()) == {1.0, 2.0}:
            told[f"column {BODY_COLUMN} of the dump"] = int(np.sum(bodies == 2.0))
    if len(set(told.values())) > 1:
        shown = ", ".join(f"{source} {count}" for source, count in told.items())
        raise InputError(f"the free target has {shown} particles; expected one number: drop one")
    if told:
        return next(iter(told.values()))
    return 0 if scene is not None and scene.contact == "power" else None


def analyze_two_bodies(
    job: Job,
    targets: int,
    *,
    bond: Potential | None = None,
    timestep: float | None = None,
    progress: Callable[[int], None] | None = None,
    view: DumpView | None = None,
) -> TwoBodyAnalysis:
    """
    Analyse the dump of a job with a free target, or with a soft wall.

    Parameters
    ----------
    job : Job
        Files of the job; masses are those of the dump or the data file.
    targets : int
        Particles of the target, those at the lowest x where the dump has no column ``mol``.
    bond : Potential, optional
        That of ``scene.toml`` by default.
    timestep : float, optional
        Simulated time per step, for dumps that do not carry the time.
    progress : callable, optional
        Called with the number of bytes of the dump read so far.
    view : DumpView, optional
        Units of the dump, and of `timestep`; by default those of ``units.toml`` beside the dump,
        else the chain's own.

    Returns
    -------
    TwoBodyAnalysis
        All results.

    Raises
    ------
    InputError
        If the dump does not hold two bodies that approach each other in its first frame.
    """
    view = view or view_of(job)
    dump = open_dump(job, view)
    first = dump.first()
    if timestep is not None:
        timestep /= view.units.time
    scene = None if job.scene is None else Scene.from_file(job.scene)
    if scene is not None:
        bond = bond or scene.bond
    layout = BodiesLayout.from_frame(first, targets, masses_declared(job, view.units))
    state = opening = layout.read(first)
    v0 = -layout.relative_velocity(opening)
    if not v0 > 0.0:
        raise InputError(
            f"the bodies move apart with {-v0:.6g} in the first frame; expected a dump that begins "
            "before they meet, with the chain at larger x than the target"
        )
    if scene is not None and abs(v0 / scene.impact_velocity - 1.0) > _SAME_SPEED:
        raise InputError(
            f"the bodies come together with {v0:.9g} in the first frame, in {job.scene} with "
            f"{scene.impact_velocity:.9g}; expected a dump of that job from before their contact"
        )
    last, changed, count = first, opening, 0
    small = _ROUNDINGS * np.finfo(float).eps * layout.size * v0 * float(np.sum(layout.masses[0]))
    small += 2.0 * float(layout.masses[0] @ first.resolution("vx", layout.digits)[layout.rows[0]])
    for frame in dump.frames(progress):
        state = layout.read(frame, timestep)
        if abs(layout.momentum(state) - layout.momentum(changed)) > small:
            changed = state
        last, count = frame, count + 1
    apart = layout.relative_velocity(state)
    e = apart / v0
    quiet = None if state.time is None or changed.time is None else state.time - changed.time
    crossing = _CROSSINGS * layout.slowest(1.0 if bond is None else bond.stiffness)
    caveats = []
    if dump.truncated:
        caveats.append("the last frame is cut short and was left out: the run may not have ended")
    finished = quiet is not None and quiet > crossing and apart > 0.0
    if not finished:
        caveats.append(
            "another contact may follow the last frame: the momentum of the chain has not been the "
            f"same for {crossing:.4g}, in which sound goes through the longer body and back"
        )
    if bond is None:
        caveats.append("the bonds' potential is not known: no energies; modes are of stiffness 1")
    data_error = 2.0 * abs(e) * (layout.resolution(last) + abs(e) * layout.resolution(first)) / v0
    error, says = printed_error(job.logs, e**2, data_error)
    if says is not None:
        caveats.append(says)
    return TwoBodyAnalysis(
        masses=layout.masses[0],
        target_masses=layout.masses[1],
        bond=bond,
        velocity=v0,
        restitution=e**2,
        kinematic_restitution=e,
        restitution_error=error,
        data_error=data_error,
        velocity_after=layout.mean(state, 0),
        target_velocity_after=layout.mean(state, 1),
        momentum_residual=layout.whole_change(opening, state)
        / (float(np.sum(layout.masses[0])) * v0),
        **_energies(layout, opening, state, bond),
        frames=count,
        quiet=quiet,
        finished=finished,
        caveats=tuple(caveats),
    )


def _energies(
    layout: BodiesLayout, first: BodiesState, last: BodiesState, bond: Potential | None
) -> dict[str, Any]:
    """Return energies and modes; in a mirror a target is a chain."""
    stiffness = 1.0 if bond is None else bond.stiffness
    names = ("mode_energies", "target_mode_energies"), ("energy", "target_energy")
    found: dict = dict.fromkeys(names[1]) | {"energy_drift": None}
    totals = [0.0, 0.0]
    for body, sign in enumerate((1.0, -1.0)):
        m = layout.masses[body]
        u, v = sign * last.displacements[body], sign * last.velocities[body]
        before = sign * first.displacements[body], sign * first.velocities[body]
        for name, state in ((names[0][body], (u, v)), (f"{names[0][body]}_start", before)):
            found[name] = mode_energies(*state, stiffness, m) if m.size else np.empty(0)
        if bond is None or not m.size:
            continue
        found[names[1][body]] = energy_split(u, v, bond, m)
        totals[0] += float(energy_split(*before, bond, m).total)
        totals[1] += float(found[names[1][body]].total)
    if bond is not None:
        found["energy_drift"] = (totals[1] - totals[0]) / totals[0]
    return found
