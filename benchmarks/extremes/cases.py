"""
Five collisions at the edge, through the public interface.

    python -m benchmarks.extremes.cases
"""

from dataclasses import dataclass
from typing import Any

from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide

PARTICLES = 20
TOLERANCE = 1e-8
CASES: tuple[tuple[str, dict[str, Any]], ...] = (
    ("log, 5 v*", {"potential": "log", "speed": 5.0}),
    ("log, 10 v*", {"potential": "log", "speed": 10.0}),
    ("lj, 30 v*", {"potential": "lj", "speed": 30.0}),
    ("lj, 1000 v*", {"potential": "lj", "speed": 1000.0}),
    ("toda b = 100, 10 v*", {"potential": "toda", "toda_b": 100.0, "speed": 10.0}),
)


@dataclass(frozen=True)
class Row:
    """Result of an engine for a case."""

    case: str
    engine: str
    answer: str
    seconds: float | None
    met: bool


def ask(case: str, fields: dict[str, Any], engine: str) -> Row:
    """Ask an engine for a bar of 1e-8."""
    scene = Scene(**fields, particles=PARTICLES, engine=engine, tolerance=TOLERANCE)
    try:
        result = collide(scene)
    except ChaincorError as error:
        return Row(case, engine, f"{type(error).__name__}: {error}", None, False)
    lost = 1.0 - result.restitution
    answer = f"1 - eta = {lost:.6g} +- {result.restitution_error:.1e}, {result.scheme}"
    if not result.tolerance_met:
        answer += f"; {result.reason}"
    return Row(case, engine, answer, result.seconds_total, bool(result.tolerance_met))


def main() -> None:
    """Print the table; fail if the reference engine misses a bar."""
    print("| n = 20 | engine | answer | seconds |")
    print("|---|---|---|---|")
    missed = False
    for case, fields in CASES:
        for engine in ("reference", "lammps"):
            row = ask(case, fields, engine)
            missed |= engine == "reference" and not row.met
            seconds = "" if row.seconds is None else f"{row.seconds:.2g}"
            print(f"| {row.case} | {row.engine} | {row.answer} | {seconds} |", flush=True)
    raise SystemExit(missed)


if __name__ == "__main__":
    main()
