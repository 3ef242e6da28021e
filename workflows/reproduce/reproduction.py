"""From a plan to a report on disk."""

import time
from pathlib import Path
from typing import Any

from chaincor.workflows.reproduce import paper
from chaincor.workflows.reproduce.free_flight import free_flights
from chaincor.workflows.reproduce.measuring import Runner, measure
from chaincor.workflows.reproduce.plan import Plan
from chaincor.workflows.reproduce.report import gather, write_figures, write_report


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
