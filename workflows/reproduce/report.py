"""The report: verdicts first, then figures, slips, settings and times; HTML, Markdown and JSON."""

import base64
import json
import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from analysis.atomic_write import written_aside
from workflows.reproduce.beyond import remarks
from workflows.reproduce.figures.figure import Figure
from workflows.reproduce.findings.low_speed import increases
from workflows.reproduce.judging import Judged
from workflows.reproduce.measurements import Measurements
from workflows.reproduce.rules import Verdict
from workflows.reproduce.slips import Slip
from workflows.reproduce.tables import point_record

_CLASS = {
    Verdict.REPRODUCED: "good",
    Verdict.CORRECTED: "fair",
    Verdict.NOT_REPRODUCED: "bad",
}


@dataclass(frozen=True)
class Health:
    """
    How far the data themselves can be trusted.

    Attributes
    ----------
    points, by_lammps : int
        Different points, and those with a value from LAMMPS.
    compared, disagreements : int
        Points both engines computed; those outside the sum of the bars.
    worst_excess : float
        Largest |difference|/(sum of bars).
    largest_error : float
        Largest error bar of a plotted point.
    asked : float
        What it was to be at most.
    largest_relative_error : float
        Largest error bar of a plotted or fitted increase, as a share of it.
    failures : list of str
        What had no result, and why.
    """

    points: int
    by_lammps: int
    compared: int
    disagreements: int
    worst_excess: float
    largest_error: float
    asked: float
    largest_relative_error: float
    failures: list[str]


def examine_points(measured: Measurements) -> Health:
    """
    Count points, disagreements and failures.

    Parameters
    ----------
    measured : Measurements
        All points.

    Returns
    -------
    Health
        The counts.
    """
    points = list(measured.all_points())
    compared = [p for p in points if p.agrees is not None]
    excess = [abs(p.difference or 0.0) / (p.allowed_difference or 1.0) for p in compared]
    failures = [
        f"{p.scene.label}, n = {p.particles}, v0 = {p.scene.impact_velocity:.4g}, {engine}: "
        f"{answer.failure}"
        for p in points
        for engine, answer in (("LAMMPS", p.lammps), ("in-house", p.in_house))
        if answer is not None and answer.result is None
    ]
    relative = [float(np.max(np.abs(i.errors / i.values))) for i in increases(measured).values()]
    return Health(
        points=len(points),
        by_lammps=sum(p.source == "lammps" for p in points),
        compared=len(compared),
        disagreements=sum(p.agrees is False for p in compared),
        worst_excess=max(excess, default=math.nan),
        largest_error=max((p.error for p in points if p.source is not None), default=math.nan),
        asked=measured.plan.tolerance,
        largest_relative_error=max(relative, default=math.nan),
        failures=failures,
    )


def gather(
    measured: Measurements,
    judged: Judged,
    slips: tuple[Slip, ...],
    figures: tuple[Figure, ...],
    seconds: dict[str, float],
) -> dict[str, Any]:
    """
    Gather everything the report says, as plain values.

    Parameters
    ----------
    measured : Measurements
        All points.
    judged : Judged
        Verdicts.
    slips : tuple of Slip
        The paper's slips.
    figures : tuple of Figure
        The figures.
    seconds : dict
        Wall-clock time of the steps of this run.

    Returns
    -------
    dict
        What ``report.json`` holds.
    """
    verdicts = [
        {
            "key": j.rule.key,
            "where": j.rule.where,
            "claim": j.rule.claim,
            "paper": j.rule.paper,
            "value": j.finding.value,
            "error": j.finding.error,
            "found": j.finding.text,
            "reproduced_within": j.rule.reproduced_within,
            "corrected_within": j.rule.corrected_within,
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
    return {
        "plan": measured.plan.name,
        "tolerance": measured.plan.tolerance,
        "versions": _versions_of(measured),
        "verdicts": verdicts,
        "curves": [point_record(p) for p in measured.points["curves"]],
        "counts": {str(v): sum(x["verdict"] == v for x in verdicts) for v in Verdict},
        "health": asdict(examine_points(measured)),
        "fits": {
            "harmonic 1 - eta, all points": [fit.to_dict() for fit in judged.law.ranges],
            **_increase_fits(measured),
        },
        "beyond": [asdict(remark) for remark in remarks(measured)],
        "slips": [asdict(slip) for slip in slips],
        "figures": [{"key": f.key, "title": f.title, "caption": f.caption} for f in figures],
        "work": work,
        "seconds": seconds,
        "seeds": "none: nothing here is random",
    }


def _increase_fits(measured: Measurements) -> dict[str, list[dict[str, Any]]]:
    return {
        f"increase, r = {order}": [law.to_dict() for law in increase.fits()]
        for order, increase in increases(measured).items()
    }


def _versions_of(measured: Measurements) -> dict[str, str]:
    for point in measured.all_points():
        if point.answer is not None and point.answer.result is not None:
            return dict(point.answer.result["versions"])
    return {}


def write_report(folder: Path, contents: dict[str, Any], figures: tuple[Figure, ...]) -> None:
    """
    Write the report with its figures and their data.

    Parameters
    ----------
    folder : pathlib.Path
        Where; made if it is not there.
    contents : dict
        From :func:`gather`.
    figures : tuple of Figure
        Drawn here.
    """
    drawings = folder / "figures"
    drawings.mkdir(parents=True, exist_ok=True)
    images = {}
    for figure in figures:
        rendered = figure.render()
        for kind, content in rendered.items():
            (drawings / f"{figure.key}.{kind}").write_bytes(content)
        if figure.table is not None:
            _write(drawings / f"{figure.key}.csv", figure.table.to_csv())
        images[figure.key] = _data_uri(rendered)
    environment = Environment(
        loader=PackageLoader("workflows.reproduce"),
        autoescape=lambda name: name is not None and name.endswith("html.j2"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["number"] = format_number
    environment.filters["value"] = format_value
    environment.filters["unbroken"] = lambda text: text.replace(" v*", "\u00a0v*")
    environment.filters["cell"] = lambda text: str(text).replace("|", r"\|").replace("\n", " ")
    for name in ("report.html", "report.md"):
        text = environment.get_template(f"{name}.j2").render(**contents, images=images)
        _write(folder / name, text)
    _write(folder / "report.json", json.dumps(_finite(contents), indent=1, ensure_ascii=False))


def _write(path: Path, text: str) -> None:
    with written_aside(path) as aside:
        aside.write_text(text, encoding="utf-8")


# An SVG beyond this size is shown as PNG in the page.
_LARGEST_SVG = 400_000


def _data_uri(rendered: dict[str, bytes]) -> str:
    kind = "svg" if len(rendered["svg"]) <= _LARGEST_SVG else "png"
    media = {"svg": "image/svg+xml", "png": "image/png"}[kind]
    return f"data:{media};base64,{base64.b64encode(rendered[kind]).decode()}"


def format_number(value: float | None) -> str:
    """
    Write a number with a few significant digits.

    Parameters
    ----------
    value : float or None
        Number.

    Returns
    -------
    str
        A dash where there is none.
    """
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.4g}".replace("-", "−")


def format_value(value: float, error: float) -> str:
    """
    Write a number with its error, to the digits the error allows.

    Parameters
    ----------
    value, error : float
        Number and its error.

    Returns
    -------
    str
        Such as ``0.8098 ± 0.0001``; a dash where there is no number.
    """
    if not math.isfinite(value):
        return "–"
    if not math.isfinite(error) or error <= 0.0:
        return f"{value:.4g}".replace("-", "−")
    digits = min(max(1 - math.floor(math.log10(error)), 0), 9)
    if abs(value) < 1e-3:
        return f"{value:.1e} ± {error:.0e}".replace("-", "−")
    digits = min(digits, 5)
    shown = f"{error:.{digits}f}" if error >= 10.0**-digits else f"{error:.0e}"
    return f"{value:.{digits}f} ± {shown}".replace("-", "−")


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(inner) for inner in value]
    return value
