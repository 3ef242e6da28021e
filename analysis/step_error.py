"""Estimate the error of a run, from its log or from a run at another time step."""

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from chaincor.analysis.dumps.printed import printed_error
from chaincor.analysis.dumps.view import DumpView
from chaincor.analysis.job_analysis import analyze_job
from chaincor.analysis.job_folder import Job, find_jobs
from chaincor.analysis.results import CollisionAnalysis
from chaincor.lammps_inputs.errors import InputError

StepProgress = Callable[[int], None] | None
# The error bar is one of these factors times the larger of two quantities: the difference between
# two jobs and their energy drift. The study benchmarks/bars/analyzed.py measured the ratio of the
# true error to this larger quantity. The largest ratio is 1.9 in 79 pairs of random jobs with the
# impact-located wall, and 3.6 in 67 pairs with the stock wall. The factors are about twice as
# large. The study also counts how often the true error is within the error bar.
EVENT_RESERVE = 4.0
REFLECT_RESERVE = 8.0
_SAME_STEP = 1e-9
# Scene keys in which two runs of one collision may differ.
_NUMERICS = ("timestep", "tolerance", "error")


def analyze_folder(
    folder: Path | str,
    *,
    data: Path | str | None = None,
    dump: Path | str | None = None,
    scene: Path | str | None = None,
    watch: Callable[[Path], AbstractContextManager[StepProgress]] | None = None,
    see: Callable[[Job], DumpView] | None = None,
    **known: Any,
) -> CollisionAnalysis:
    """
    Analyse the job in a folder, and the same collision at other time steps in its subfolders.

    `scene` replaces a ``scene.toml`` beside the dump. `known` are further arguments of
    :func:`~chaincor.analysis.job_analysis.analyze_job`. `watch` returns a context manager, which is
    active while a dump is read and yields a function that reports the progress. `see` returns units
    and wall of the dump of a job. Returns the analysis of the run at the finest time step. Its
    `restitution_error` comes from the log of this run or from the runs at other time steps. Raises
    InputError if there is no job, or if the jobs in the subfolders do not simulate the same
    collision.
    """
    job, below = find_jobs(folder, data=data, dump=dump, scene=scene)
    runs = []
    for each in (job, *below):
        if each is not None:
            view = None if see is None else see(each)
            with nullcontext() if watch is None else watch(each.dump) as progress:
                runs.append(analyze_job(each, progress=progress, view=view, **known))
    alike, notes = runs[:1], []
    for run in runs[1:]:
        what = _difference(runs[0], run)
        first, other = _job_of(runs[0]).dump.parent, _job_of(run).dump.parent
        if what is None:
            alike.append(run)
        elif job is None:
            raise InputError(
                f"{first} and {other} differ in {what}. Give runs of one collision at different "
                "steps, in the folder of one job"
            )
        else:
            notes.append(
                f"the job in {other} is another collision and was left out: it differs in {what}"
            )
    alike[0] = replace(runs[0], notes=(*runs[0].notes, *notes))
    return estimate_error(alike)


def estimate_error(runs: Sequence[CollisionAnalysis]) -> CollisionAnalysis:
    r"""
    Return the run at the finest time step, with its error.

    If the log of the run belongs to the dump, the error is taken from the log and a caveat says so
    (see :func:`~chaincor.analysis.dumps.printed.printed_error`).

    Otherwise the error comes from a run at another time step. With the impact-located wall and a
    scheme of order p, the runs at steps h and H > h differ by :math:`d = c (H^p - h^p)`, and the
    error of the finer run is :math:`|d|/((H/h)^p - 1)`. With the stock wall, the error is of first
    order and irregular, and d gives only its order of magnitude. d may be small by chance. The
    relative energy drifts :math:`D_h` and :math:`D_H` have the same order, and are seldom small in
    the same runs. The error bar is therefore a multiple of the larger of difference and drift, with
    a factor from measurements,

    .. math:: 4 \max\left(\frac{|d|}{(H/h)^p - 1}, |D_h|, \frac{|D_H|}{(H/h)^p}\right)
              \quad\text{and}\quad 8 \max(|d|, |D_h|, |D_H|, |D_H - D_h|),

    with the impact-located and the stock wall, respectively. The rounding of both dumps is added.

    The requested run comes first. `restitution_error` is None if there is only one run, if time
    steps, their order or the bond are unknown, if the numbers of contacts differ, or if a dump ends
    too early. A caveat then gives the reason.
    """
    every = [_job_of(run).step for run in runs]
    steps = sorted({step for step in every if step is not None})
    # Equal time steps may differ by rounding if they were converted from different units.
    steps = [h for k, h in enumerate(steps) if not k or h > (1.0 + _SAME_STEP) * steps[k - 1]]
    alone = len(runs) == 1 or None in every or len(steps) < 2
    fine = runs[0] if alone else runs[every.index(steps[0])]
    error, says = printed_error(_job_of(fine).logs, fine.restitution, fine.data_error)
    notes = [] if says is None else [says]
    if error is None:
        coarse = None if alone else runs[every.index(steps[1])]
        found = _why_alone(runs, steps) if coarse is None else _bar(fine, coarse, steps)
        if isinstance(found, float):
            error = found
        else:
            notes.append(
                f"restitution_error is unknown: {found}. To measure it, run the same job at half "
                "the step, in a folder beside or inside this folder. data_error comes from the "
                "digits and frames of the dump"
            )
    return replace(fine, restitution_error=error, notes=(*fine.notes, *notes))


def _job_of(run: CollisionAnalysis) -> Job:
    assert run.job is not None
    return run.job


def _difference(a: CollisionAnalysis, b: CollisionAnalysis) -> str | None:
    """Explain why two runs are not the same collision at two time steps; None if they are."""
    if a.particles != b.particles:
        return f"the number of particles ({a.particles} and {b.particles})"
    # A speed that was read from a dump is only as precise as the printed digits.
    if abs(a.velocity - b.velocity) > 1e-5 * a.velocity:
        return f"the impact speed ({a.velocity:g} and {b.velocity:g})"
    if a.bodies.keys() != b.bodies.keys() or a.soft != b.soft:
        return "what the chain hits"
    if a.target_particles != b.target_particles:
        both = f"{a.target_particles} and {b.target_particles}"
        return f"the number of particles of the target ({both})"
    for owner, body in a.bodies.items():
        if not np.allclose(body.masses, b.bodies[owner].masses, rtol=1e-5, atol=0.0):
            return "the masses of the target" if owner else "the masses"
    scenes = _job_of(a).loaded_scene, _job_of(b).loaded_scene
    if None in scenes:
        return None if scenes == (None, None) else "scene.toml, which one of them lacks"
    one, two = (scene.canonical_fields for scene in scenes if scene is not None)
    keys = sorted(k for k in {*one, *two} if k not in _NUMERICS and one.get(k) != two.get(k))
    return None if not keys else f"{keys[0]} ({one.get(keys[0])} and {two.get(keys[0])})"


def _bar(fine: CollisionAnalysis, coarse: CollisionAnalysis, steps: Sequence[float]) -> float | str:
    """Return the error of the finer of two runs, or the reason why it is unknown."""
    order, drift, coarse_drift = _job_of(fine).order, fine.energy_drift, coarse.energy_drift
    if fine.soft or fine.target is not None:
        return "error bars from two runs hold only for chains before a hard wall"
    if order is None or order != _job_of(coarse).order:
        return "the wall and the scheme of the jobs are unknown"
    if fine.contacts is None or fine.contacts != coarse.contacts:
        return (
            f"the runs at steps {steps[0]:g} and {steps[1]:g} do not show the same number of "
            "contacts"
        )
    if not (fine.finished and coarse.finished):
        return "the collision is not over in the last frame"
    if drift is None or coarse_drift is None:
        return "without the potential (--potential) the energy drift is unknown"
    difference = abs(fine.restitution - coarse.restitution)
    digits = fine.data_error + coarse.data_error
    if order == 0:
        drifts = (abs(drift), abs(coarse_drift), abs(drift - coarse_drift))
        return REFLECT_RESERVE * max(difference, *drifts) + digits
    ratio = (steps[1] / steps[0]) ** order
    # If the difference is smaller than the rounding of the printed digits, the rounding is the
    # error.
    error = max(difference / (ratio - 1.0), abs(drift), abs(coarse_drift) / ratio)
    return EVENT_RESERVE * error + digits * (1.0 + EVENT_RESERVE / (ratio - 1.0))


def _why_alone(runs: Sequence[CollisionAnalysis], steps: Sequence[float]) -> str:
    if len(runs) == 1:
        return "there is only one run, and its log does not give the error"
    if len(steps) == 1:
        return f"all runs have the step {steps[0]:g}"
    return "the step of a run is in neither its log nor its script"
