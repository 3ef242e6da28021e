"""Reproduce the paper: compute a plan, judge the claims, and write the report."""

import time
from pathlib import Path
from typing import Any

from chaincor.analysis.output_paths import judge_folder
from chaincor.workflows.outputs import make_folder
from chaincor.workflows.reproduce import paper
from chaincor.workflows.reproduce.free_flight import free_flights
from chaincor.workflows.reproduce.measuring import MeasurementRunner, measure, run_into_store
from chaincor.workflows.reproduce.plan import FULL, QUICK, ReproductionPlan
from chaincor.workflows.reproduce.report import (
    DRAWINGS,
    PAGES,
    SIGN,
    gather,
    write_figures,
    write_report,
)
from chaincor.workflows.research_object import describe_folder, require_rocrate

STORE_FILE = "results.sqlite"
_TITLE = "Collision of one-dimensional nonlinear chains (2003), recomputed by chaincor"
_REPORT = {
    "report.html": "Verdicts on the paper's statements, and all figures.",
    "report.md": "The verdicts.",
    "report.json": "All numbers of the report, with the versions that gave them.",
    STORE_FILE: "Every collision that was stepped or found by modes: its scene, its results "
    "and their error bars.",
}


def reproduce(
    folder: Path | str = "reproduction",
    *,
    quick: bool = True,
    workers: int = 2,
    progress: bool = True,
    as_crate: bool = False,
) -> dict[str, Any]:
    """
    Recompute the paper with LAMMPS, check it with the reference engine, and judge each claim.

    Parameters
    ----------
    folder : path
        Folder for the report, its figures and their data, and the results store. Stored results are
        not computed again, so an interrupted run can be continued.
    quick : bool
        Whether to use the quick plan, which takes minutes and has errors of 1e-5. The full plan
        takes half an hour and has errors of 1e-7 and more points.
    workers : int
        Number of worker processes.
    progress : bool
        Whether to show a progress bar.
    as_crate : bool
        Whether to describe each file and its origin in ``ro-crate-metadata.json``. The description
        needs ``chaincor[crate]``.

    Returns
    -------
    dict
        Contents of ``report.json`` in the folder, such as ``verdicts`` on all claims, ``curves``
        and ``health``.

    Raises
    ------
    InputError
        If the folder cannot be created, or has files of something else.
    MissingLibraryError
        If `as_crate` is true and the library rocrate is not installed.

    Examples
    --------
    >>> from chaincor import reproduce
    >>> report = reproduce("report")  # doctest: +SKIP
    >>> [row["verdict"] for row in report["verdicts"]]  # doctest: +SKIP
    """
    folder = Path(folder)
    judge_folder(folder, SIGN, PAGES)
    make_folder(folder)
    if as_crate:
        require_rocrate()
    runner = run_into_store(folder / STORE_FILE, workers, progress=progress)
    contents = reproduce_paper(QUICK if quick else FULL, folder, runner)
    if as_crate:
        describe_reproduction(folder, contents)
    return contents


def describe_reproduction(folder: Path, contents: dict[str, Any]) -> None:
    """
    Describe each file in ``ro-crate-metadata.json``.

    `contents` are the contents of ``report.json``.
    """
    titles = {figure["key"]: figure["title"] for figure in contents["figures"]}
    drawings = sorted(path for key in titles for path in (folder / DRAWINGS).glob(f"{key}.*"))
    files = {path.relative_to(folder).as_posix(): titles[path.stem] for path in drawings}
    describe_folder(folder, _TITLE, _REPORT | files, contents["versions"].items())


def reproduce_paper(plan: ReproductionPlan, folder: Path, run: MeasurementRunner) -> dict[str, Any]:
    """Compute and judge a plan, write the report, and return the contents of ``report.json``."""
    started = time.perf_counter()
    measured = measure(plan, paper.studies(plan), run)
    computed = time.perf_counter()
    flights = free_flights(measured)
    figures = paper.figures(measured, flights)
    derived = time.perf_counter()
    images = write_figures(folder, figures)
    drawn = time.perf_counter()
    seconds = {
        "collisions": computed - started,
        "flights and figures": derived - computed,
        "drawing": drawn - derived,
    }
    contents = gather(measured, flights, figures, seconds)
    write_report(folder, contents, images)
    return contents
