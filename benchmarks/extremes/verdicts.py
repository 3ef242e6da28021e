"""Rules that make a cell of the map of the extremes green, amber, red or unverified."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from benchmarks.extremes.cells import ENGINES, TOLERANCE, Cell, Found
from chaincor.workflows.errors import BarrierError, CrossingError

# Required accuracy of the judge.
SUREST_JUDGE = 1e-8
LONGEST_STEPPED_SPHERES = 100


class UnsureError(Exception):
    """Error: two runs of the judge do not agree on why they stop."""


# Refusals that state a fact about the motion, and verbs of remedies.
FACTS = (CrossingError.__name__, BarrierError.__name__)
REMEDY = re.compile(r"\b(use|lower|take|ask for|choose|give|extend|check|install)\b", re.IGNORECASE)
# Letters of the verdicts, because not everyone can distinguish the colours.
LETTERS = {
    "ToleranceError": "d",
    "RunError": "s",
    "CrossingError": "x",
    "BarrierError": "b",
    "TimestepError": "t",
    "UnfinishedCollisionError": "u",
}


def needs_judge(found: Found) -> bool:
    """Return whether the judge must run: for facts, and for results unless of many spheres."""
    if found.failure is not None:
        return found.failure in FACTS
    return found.scheme != "hard-sphere" or found.particles <= LONGEST_STEPPED_SPHERES


@dataclass(frozen=True)
class Verdict:
    """Colour and letter of a cell, and the reason."""

    colour: str
    letter: str
    why: str


def verdict(found: Found, judged: Found | None) -> Verdict:
    """Judge the result of an engine."""
    if found.failure is not None:
        return _verdict_on_refusal(found, judged)
    assert found.restitution is not None
    bar = found.error
    if not math.isfinite(found.restitution) or bar is None or not math.isfinite(bar):
        return Verdict("red", "N", f"eta {found.restitution}, bar {bar}")
    if found.met != (bar <= TOLERANCE) or not (found.met or found.message):
        return Verdict("red", "L", f"says {found.met}, bar {bar:.2g}")
    by_limit = not needs_judge(found) if judged is None else found.scheme == "hard-sphere"
    if by_limit and (judged is None or judged.failure is not None):
        reference_value, doubt, letter = 1.0, 0.0, "o"
    elif judged is None:
        return Verdict("unverified", "?", "not judged yet")
    elif judged.failure is not None:
        if judged.failure in FACTS:
            return Verdict("red", "F", f"answered, though {judged.message}")
        return Verdict("unverified", "?", f"judge: {judged.failure}: {judged.message}")
    else:
        assert judged.restitution is not None
        assert judged.error is not None
        reference_value, doubt, letter = judged.restitution, judged.error, ""
        if doubt > SUREST_JUDGE:
            return Verdict("unverified", "?", f"the judge is sure to {doubt:.1g} only")
    away = abs(found.restitution - reference_value)
    if away > bar + doubt:
        return Verdict("red", "X", f"{away:.2g} from the judge, bar {bar:.2g} + {doubt:.1g}")
    if found.met:
        return Verdict("green", letter, "")
    return Verdict("amber", "w", found.message)


def _verdict_on_refusal(found: Found, judged: Found | None) -> Verdict:
    said = f"{found.failure}: {found.message}"
    if found.failure == "TimeOut":
        return Verdict("red", "T", said)
    if not found.named or "\n" in found.message or not REMEDY.search(found.message):
        return Verdict("red", "E", said)
    if found.failure in FACTS and judged is None:
        return Verdict("unverified", "?", f"not judged yet: {said}")
    if found.failure in FACTS and judged is not None:
        confirmed = judged.failure == found.failure or judged.crossed
        if judged.failure in ("TimeOut", "TimestepError", UnsureError.__name__):
            return Verdict("unverified", "?", f"judge: {judged.failure}; {said}")
        if not confirmed:
            return Verdict("red", "U", f"{said}; the judge says {judged.restitution}")
    return Verdict("amber", LETTERS.get(str(found.failure), "e"), said)


def verdicts(
    found: Mapping[tuple[Cell, str], Found], cells: Iterable[tuple[Cell, str]]
) -> dict[tuple[Cell, str], Verdict]:
    """Return the verdicts on all cells that were computed."""
    return {
        (cell, engine): verdict(found[cell, engine], found.get((cell, "judge")))
        for cell, engine in cells
        if (cell, engine) in found
    }


def report(found: Mapping[tuple[Cell, str], Found], judged: dict[tuple[Cell, str], Verdict]) -> str:
    """Return counts for each engine, and a line for each red or unverified cell."""
    lines = []
    for engine in ENGINES:
        some = [each for (_, by), each in judged.items() if by == engine]
        colours = Counter(each.colour for each in some)
        letters = Counter(each.letter for each in some if each.colour == "amber")
        limits = sum(each.colour == "green" and each.letter == "o" for each in some)
        lines.append(
            f"{engine}: {len(some)} cells: "
            + ", ".join(f"{colours[c]} {c}" for c in ("green", "amber", "red", "unverified"))
            + f"; green by the limit of hard spheres: {limits}; amber: {dict(letters)}"
        )
    for (cell, engine), each in judged.items():
        if each.colour in ("red", "unverified"):
            name = f"{cell.potential} n={cell.particles} {cell.speed:g} {engine}"
            lines.append(f"{each.colour} {each.letter} {name}: {each.why}")
    seconds = sum(each.seconds for each in found.values())
    return "\n".join([*lines, f"processor time: {seconds / 60.0:.1f} min"])
