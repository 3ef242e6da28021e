"""The report: verdicts first, then figures, slips, settings and times; HTML, Markdown and JSON."""

import json
import math
import re
from dataclasses import asdict
from pathlib import Path
from typing import Any

from chaincor.analysis.atomic_write import written_aside
from chaincor.workflows.json_output import stamped
from chaincor.workflows.pages.page import data_uri, page_environment
from chaincor.workflows.pages.typesetting import format_value
from chaincor.workflows.reproduce.beyond import remarks
from chaincor.workflows.reproduce.bonds_used import bonds_used
from chaincor.workflows.reproduce.figures.figure import Figure
from chaincor.workflows.reproduce.findings.fits_made import fits_made
from chaincor.workflows.reproduce.findings.free_flight import FreeFlight
from chaincor.workflows.reproduce.judging import Judged
from chaincor.workflows.reproduce.measurements import Measurements
from chaincor.workflows.reproduce.readings import readings
from chaincor.workflows.reproduce.rules import ABOUT, ROUGHLY, Judgement, Put, Verdict
from chaincor.workflows.reproduce.slips.all_slips import count_slips
from chaincor.workflows.reproduce.slips.slip import Slip
from chaincor.workflows.reproduce.tables import point_record
from chaincor.workflows.reproduce.trust import examine_points
from chaincor.workflows.result import finite

_CLASS = {
    Verdict.REPRODUCED: "good",
    Verdict.CORRECTED: "fair",
    Verdict.UNDECIDED: "open",
    Verdict.NOT_REPRODUCED: "bad",
}


def gather(
    measured: Measurements,
    judged: Judged,
    slips: tuple[Slip, ...],
    figures: tuple[Figure, ...],
    flights: tuple[FreeFlight, ...],
    seconds: dict[str, float],
) -> dict[str, Any]:
    """Gather everything ``report.json`` holds, as plain values; `seconds` are those of this run."""
    verdicts = [
        {
            "key": j.rule.key,
            "brief": j.rule.brief,
            "figure": j.rule.figure,
            "where": j.rule.where,
            "claim": j.rule.claim,
            "paper": j.rule.paper,
            "value": j.finding.value,
            "error": j.finding.error,
            "found": j.finding.text,
            "reproduced_within": j.rule.reproduced_within,
            "corrected_within": j.rule.corrected_within,
            "margin_reason": j.rule.margin_reason,
            "spread": j.finding.spread,
            "is_trend": j.rule.put is Put.TREND,
            "in_brief": _in_brief(j),
            "points": len(j.finding.points),
            "unchecked": j.finding.unchecked,
            "verdict": str(j.verdict),
            "reason": j.reason,
            "class": _CLASS[j.verdict],
        }
        for j in judged.judgements
    ]
    work = [
        {
            "study": s.title,
            "points": len(s.scenes) + len(s.in_house),
            **measured.seconds(s.key),
        }
        for s in measured.studies
    ]
    settings = {name: value for name, value in asdict(measured.plan).items() if name != "alter"}
    return {
        "plan": measured.plan.name,
        "tolerance": measured.plan.tolerance,
        "settings": settings,
        "versions": _versions_of(measured),
        "verdicts": verdicts,
        "curves": [point_record(p) for p in measured.points["curves"]],
        "about": ABOUT,
        "roughly": ROUGHLY,
        "counts": {str(v): sum(x["verdict"] == v for x in verdicts) for v in Verdict},
        "health": asdict(examine_points(measured)),
        "bonds": [asdict(bond) for bond in bonds_used()],
        "fits": [asdict(fit) for fit in fits_made(measured, judged.law)],
        "readings": [asdict(reading) for reading in readings(measured)],
        "beyond": [asdict(remark) for remark in remarks(measured, flights)],
        "slips": [asdict(slip) for slip in slips],
        "slip_count": count_slips(slips),
        "figures": [
            {
                "key": f.key,
                "label": f"R{number}",
                "title": f.title,
                "caption": f.caption,
                "alt": f.alt,
                "has_data": f.table is not None,
            }
            for number, f in enumerate(figures, start=1)
        ],
        "work": work,
        "dearest": _dearest(measured),
        "seconds": seconds,
        "seeds": "none: nothing here is random",
    }


def describe_found(row: dict[str, Any]) -> str:
    """Write the number found, or whether a trend is there."""
    if row["is_trend"] and math.isfinite(row["value"]):
        return "yes" if row["value"] else "no"
    return format_value(row["value"], row["error"])


def _in_brief(judgement: Judgement) -> str:
    """Return what the summary says of a claim: our number, and how far it is from the paper's."""
    rule, finding = judgement.rule, judgement.finding
    if finding.brief:
        return finding.brief
    if rule.put is Put.TREND:
        return "yes" if finding.value else "no"
    number = format_value(finding.value, finding.error).split(" ±")[0]
    if rule.paper == 0.0 or not math.isfinite(finding.value):
        return number
    return f"{number}, {100.0 * (finding.value / rule.paper - 1.0):+.2g} %".replace("-", "−")


def _dearest(measured: Measurements, count: int = 8) -> list[dict[str, Any]]:
    """Return the runs that took longest, each with its share of all computing time."""
    runs = [
        (answer.result["seconds_total"], engine, point)
        for point in measured.all_points()
        for engine, answer in (("LAMMPS", point.lammps), ("in-house", point.in_house))
        if answer is not None and answer.result is not None
    ]
    total = sum(seconds for seconds, _, _ in runs) or 1.0
    longest = sorted(runs, key=lambda run: -run[0])[:count]
    return [
        {
            "engine": engine,
            "potential": point.scene.label,
            "particles": point.particles,
            "speed": point.speed,
            "seconds": seconds,
            "share": seconds / total,
        }
        for seconds, engine, point in longest
    ]


def _versions_of(measured: Measurements) -> dict[str, str]:
    """Return the versions that made the results: several where a store was carried on with."""
    found: dict[str, set[str]] = {}
    for point in measured.all_points():
        for answer in (point.lammps, point.in_house):
            if answer is not None and answer.result is not None:
                for name, version in answer.result["versions"].items():
                    found.setdefault(name, set()).add(version)
    return {name: " and ".join(sorted(versions)) for name, versions in found.items()}


def write_figures(folder: Path, figures: tuple[Figure, ...]) -> dict[str, str]:
    """Draw the figures and write them with their data; returns them as data URIs, by key."""
    drawings = folder / "figures"
    drawings.mkdir(parents=True, exist_ok=True)
    images = {}
    for figure in figures:
        rendered = figure.render()
        for kind, content in rendered.items():
            (drawings / f"{figure.key}.{kind}").write_bytes(content)
        if figure.table is not None:
            _write(drawings / f"{figure.key}.csv", figure.table.to_csv())
        images[figure.key] = data_uri(rendered)
    return images


def write_report(folder: Path, contents: dict[str, Any], images: dict[str, str]) -> None:
    """Write the page, the summary and the numbers."""
    environment = page_environment("chaincor.workflows.reproduce")
    environment.filters["found"] = describe_found
    environment.filters["anchor"] = lambda key: "claim-" + re.sub(r"\W+", "-", key)
    environment.filters["cell"] = lambda text: str(text).replace("|", r"\|").replace("\n", " ")
    for name in ("report.html", "report.md"):
        text = environment.get_template(f"{name}.j2").render(**contents, images=images)
        _write(folder / name, text)
    _write(
        folder / "report.json", json.dumps(stamped(finite(contents)), indent=1, ensure_ascii=False)
    )


def _write(path: Path, text: str) -> None:
    with written_aside(path) as aside:
        aside.write_text(text, encoding="utf-8")
