"""From a plan to a report on disk."""

import time
from pathlib import Path
from typing import Any

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.reproduce import paper
from chaincor.workflows.reproduce.free_flight import free_flights
from chaincor.workflows.reproduce.measuring import Runner, measure, run_into_store
from chaincor.workflows.reproduce.plan import FULL, QUICK, Plan
from chaincor.workflows.reproduce.report import gather, write_figures, write_report

STORE_FILE = "results.sqlite"


def reproduce(
    folder: Path | str = "reproduction",
    *,
    quick: bool = True,
    workers: int = 2,
    progress: bool = True,
) -> dict[str, Any]:
    """
    Recompute the paper by LAMMPS, check it in-house, and judge each of its claims.

    Parameters
    ----------
    folder : path
        For the report, its figures and their data, and the results store. What the store has is not
        computed again, so that an interrupted run goes on.
    quick : bool
        Minutes with errors of 1e-5; otherwise half an hour with 1e-7 and more points.
    workers : int
        Processes that compute.
    progress : bool
        Whether a bar shows how far it is.

    Returns
    -------
    dict
        What ``report.json`` in the folder holds: ``verdicts`` claim by claim, ``curves``,
        ``health``, and more.

    Raises
    ------
    InputError
        If the folder cannot be made.

    Examples
    --------
    >>> from chaincor import reproduce
    >>> [row["verdict"] for row in reproduce("report")["verdicts"]]
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot make the folder {str(folder)!r}: {error.strerror}; give another"
        ) from None
    runner = run_into_store(folder / STORE_FILE, workers, progress=progress)
    return reproduce_paper(QUICK if quick else FULL, folder, runner)


def reproduce_paper(plan: Plan, folder: Path, run: Runner) -> dict[str, Any]:
    """Compute a plan, judge it and write the report; returns what ``report.json`` holds."""
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
