"""Write the report of the reproduction as HTML, Markdown and JSON."""

import json
import math
import re
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from chaincor.analysis.atomic_write import write_whole
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.documents import DOCUMENTS
from chaincor.workflows.json_output import finite, stamped
from chaincor.workflows.pages.page import data_uri, page_environment
from chaincor.workflows.pages.typesetting import format_value
from chaincor.workflows.reproduce import paper
from chaincor.workflows.reproduce.claims import ABOUT, ROUGHLY, Claim, ClaimFinding, Verdict
from chaincor.workflows.reproduce.drawing import Figure, point_record
from chaincor.workflows.reproduce.figures.agreement import examine_points
from chaincor.workflows.reproduce.figures.slow_chains import slopes_by_bond
from chaincor.workflows.reproduce.free_flight import FreeFlight
from chaincor.workflows.reproduce.measurements import MeasuredPoint, Measurements
from chaincor.workflows.reproduce.plan import Study

# Folder for the figures and their data.
DRAWINGS = "figures"
# The folder of a report has the file SIGN, and the same report in other formats.
SIGN, PAGES = "report.json", ("report.html", "report.md")
# On the page of slips, this mark means that the paper was suspected of a slip but is right.
RIGHT = "right as printed"
_BOND_FORMULAS = {
    "lj": "U = (x^(−12) − 2 x^(−6) + 1)/72",
    "toda": "U = (e^(−bs) − 1)/b² + s/b, b = 10",
    "log": "U = s − ln x",
}
_CLASS = {
    Verdict.REPRODUCED: "good",
    Verdict.CORRECTED: "fair",
    Verdict.UNDECIDED: "open",
    Verdict.NOT_REPRODUCED: "bad",
}


def gather(
    measured: Measurements,
    flights: tuple[FreeFlight, ...],
    figures: tuple[Figure, ...],
    seconds: dict[str, float],
) -> dict[str, Any]:
    """
    Judge the claims, and return the contents of ``report.json``.

    `seconds` is the time that the computation took.
    """
    verdicts = [verdict_row(claim, claim.found(measured)) for claim in paper.CLAIMS]
    slip_count, slips = read_slips()
    bonds = {name: Scene(potential=name, speed=1.0).bond for name in _BOND_FORMULAS}
    return {
        "plan": measured.plan.name,
        "tolerance": measured.plan.tolerance,
        "settings": asdict(measured.plan),
        "versions": _versions_of(measured),
        "verdicts": verdicts,
        "curves": [point_record(p) for p in measured.points["curves"]],
        "about": ABOUT,
        "roughly": ROUGHLY,
        "counts": {str(v): sum(x["verdict"] == v for x in verdicts) for v in Verdict},
        "health": examine_points(measured),
        "bonds": [
            {
                "name": name,
                "formula": _BOND_FORMULAS[name],
                "length": bond.compressed_root,
                "speed": bond.natural_speed,
            }
            for name, bond in bonds.items()
        ],
        "fits": [row for figure in figures for row in figure.fits],
        "readings": _answered(paper.readings(measured)),
        "beyond": _answered(paper.beyond(measured, flights)),
        "slopes": slopes_by_bond(measured),
        "slips": slips,
        "slip_count": slip_count,
        "figures": [
            {
                "key": f.key,
                "label": f"R{number}",
                "title": f.title,
                "caption": f.caption,
                "alt": f.alt,
                "has_data": bool(f.records),
            }
            for number, f in enumerate(figures, start=1)
        ],
        "work": [_work(measured, study) for study in measured.studies],
        "dearest": _dearest(measured),
        "seconds": seconds,
        "seeds": "none, because nothing here is random",
    }


def verdict_row(claim: Claim, finding: ClaimFinding) -> dict[str, Any]:
    """Judge the finding on a claim, and return its row for the report."""
    verdict, reason = claim.judge(finding)
    return {
        "key": claim.key,
        "brief": claim.brief,
        "figure": claim.figure,
        "where": claim.where,
        "claim": claim.text,
        "paper": claim.margin.paper,
        "value": finding.value,
        "error": finding.error,
        "errors_away": claim.errors_away(finding),
        "found": finding.text,
        "reproduced_within": claim.margin.reproduced_within,
        "corrected_within": claim.margin.corrected_within,
        "margin_reason": claim.margin.reason,
        "spread": finding.spread,
        "is_trend": claim.margin.is_trend,
        "in_brief": _in_brief(claim, finding),
        "points": len(finding.points),
        "unchecked": sum(point.agrees is None for point in finding.points),
        "verdict": str(verdict),
        "reason": reason,
        "class": _CLASS[verdict],
    }


def _answered(questions: dict[str, str]) -> list[dict[str, str]]:
    return [{"question": question, "answer": answer} for question, answer in questions.items()]


def describe_found(row: dict[str, Any]) -> str:
    """Write our number with its error, or for a trend whether it exists."""
    return _number(row["is_trend"], row["value"], row["error"])


def _number(is_trend: bool, value: float, error: float) -> str:
    if is_trend and math.isfinite(value):
        return "yes" if value else "no"
    return format_value(value, error)


def _in_brief(claim: Claim, finding: ClaimFinding) -> str:
    """Summarize a claim: our number, and its difference from the paper's number."""
    margin, value = claim.margin, finding.value
    if finding.brief:
        return finding.brief
    number = _number(margin.is_trend, value, finding.error).split(" ±")[0]
    if margin.is_trend or margin.paper == 0.0 or not math.isfinite(value):
        return number
    return f"{number}, {100.0 * (value / margin.paper - 1.0):+.2g} %".replace("-", "−")


def _runs(points: Iterable[MeasuredPoint]) -> list[dict[str, Any]]:
    """Return the runs that gave a result, with their computing time in seconds."""
    return [
        {
            "engine": engine,
            "potential": point.scene.label,
            "particles": point.particles,
            "speed": point.speed,
            "seconds": answer.result["seconds_total"],
        }
        for point in points
        for engine, answer in (("LAMMPS", point.lammps), ("reference", point.reference))
        if answer is not None and answer.result
    ]


def _work(measured: Measurements, study: Study) -> dict[str, Any]:
    """Return the number of points in a study, and the seconds that each engine took."""
    runs = _runs(measured.points[study.key])
    lammps, reference = (
        sum(run["seconds"] for run in runs if run["engine"] == engine)
        for engine in ("LAMMPS", "reference")
    )
    points = len(study.all_scenes)
    return {"study": study.title, "points": points, "lammps": lammps, "reference": reference}


def _dearest(measured: Measurements) -> list[dict[str, Any]]:
    """Return the eight longest runs, with the fraction of the total computing time for each."""
    runs = _runs(measured.all_points())
    total = sum(run["seconds"] for run in runs) or 1.0
    longest = sorted(runs, key=lambda run: -run["seconds"])[:8]
    return [run | {"share": run["seconds"] / total} for run in longest]


def _versions_of(measured: Measurements) -> dict[str, str]:
    """
    Return the versions that computed the results.

    If a store was continued, several versions can have computed its results.
    """
    found: dict[str, set[str]] = {}
    for point in measured.all_points():
        for answer in point.answers:
            for name, version in answer.result["versions"].items():
                found.setdefault(name, set()).add(version)
    return {name: " and ".join(sorted(versions)) for name, versions in found.items()}


def read_slips() -> tuple[str, list[dict[str, str]]]:
    """
    Read the paper's slips from the page ``paper_slips.md``, which tests write.

    Return a sentence that gives the number of slips, and the list of entries in the paper's order.
    Each entry has the place in the paper, the printed text, the correct text (empty if the paper is
    right), the kind of entry (for example ``slip``), the consequence (a dash if the entry is no
    slip) and the check.
    """
    page = (DOCUMENTS / "paper_slips.md").read_text(encoding="utf-8")
    head, *entries = re.split(r"\n## \d+\. ", page)
    return head.strip().rpartition("\n")[2].removesuffix("."), [_slip(entry) for entry in entries]


def _slip(entry: str) -> dict[str, str]:
    where, *lines = entry.splitlines()
    said = dict(line[2:].split(": ", 1) for line in lines if line.startswith("- "))
    kind = said.get("Kind", "slip")
    return {
        "where": where,
        "printed": said["Printed"],
        "correct": "" if kind == RIGHT else said["Correct"],
        "kind": kind,
        "matters": said.get("Matters", "–"),
        "evidence": said["Evidence"],
    }


def write_figures(folder: Path, figures: tuple[Figure, ...]) -> dict[str, str]:
    """Draw the figures, write them with their data, and return data URIs for the page."""
    drawings = folder / DRAWINGS
    drawings.mkdir(parents=True, exist_ok=True)
    images = {}
    for figure in figures:
        if figure.records:
            write_whole(drawings / f"{figure.key}.csv", figure.to_csv())
    for figure in figures:
        rendered = figure.render()
        for kind, content in rendered.items():
            (drawings / f"{figure.key}.{kind}").write_bytes(content)
        images[figure.key] = data_uri(rendered)
    return images


def write_report(folder: Path, contents: dict[str, Any], images: dict[str, str]) -> None:
    """Write the JSON file, which marks the folder as a report, the page, and the summary."""
    numbers = json.dumps(stamped(finite(contents)), indent=1, ensure_ascii=False)
    write_whole(folder / SIGN, numbers, "report")
    environment = page_environment("chaincor.workflows.reproduce")
    environment.filters["found"] = describe_found
    environment.filters["anchor"] = lambda key: "claim-" + re.sub(r"\W+", "-", key)
    environment.filters["cell"] = lambda text: str(text).replace("|", r"\|").replace("\n", " ")
    for name in PAGES:
        text = environment.get_template(f"{name}.j2").render(**contents, images=images)
        write_whole(folder / name, text, "report")
