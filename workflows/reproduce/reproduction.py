"""From a plan to a report on disk."""

import time
from pathlib import Path
from typing import Any

from chaincor.workflows.reproduce.figures.all_figures import all_figures
from chaincor.workflows.reproduce.findings.free_flight import free_flights
from chaincor.workflows.reproduce.judging import judge_all
from chaincor.workflows.reproduce.measurements import Runner, measure
from chaincor.workflows.reproduce.plan import Plan
from chaincor.workflows.reproduce.report import gather, write_figures, write_report
from chaincor.workflows.reproduce.slips.all_slips import all_slips


def reproduce_paper(plan: Plan, folder: Path, run: Runner) -> dict[str, Any]:
    """Compute a plan, judge it and write the report; returns what ``report.json`` holds."""
    started = time.perf_counter()
    measured = measure(plan, run)
    computed = time.perf_counter()
    judged = judge_all(measured)
    slips = all_slips()
    flights = free_flights(measured)
    figures = all_figures(measured, judged.law, flights)
    derived = time.perf_counter()
    images = write_figures(folder, figures)
    seconds = {
        "collisions": computed - started,
        "findings, slips and flights": derived - computed,
        "drawing": time.perf_counter() - derived,
    }
    contents = gather(measured, judged, slips, figures, flights, seconds)
    write_report(folder, contents, images)
    return contents
