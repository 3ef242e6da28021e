"""Numbers behind the figures: columns that go to CSV, and to the eye."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from chaincor.workflows.reproduce.measurements import Point


@dataclass(frozen=True)
class Table:
    """Columns of equal length: their names, and rows of numbers, words or None."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]

    def to_csv(self) -> str:
        """Return the table as CSV, numbers with all their digits."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(["" if v is None or v != v else v for v in row] for row in self.rows)
        return text.getvalue()


def table_of(records: Sequence[Mapping[str, Any]]) -> Table:
    """Return a table of records."""
    columns = tuple(records[0]) if records else ()
    return Table(columns, tuple(tuple(record[name] for name in columns) for record in records))


def point_record(point: Point) -> dict[str, Any]:
    """Return a point as a row: scene, plotted value, error bar, both values, what failed."""
    answers = {"lammps": point.lammps, "in_house": point.in_house}
    record: dict[str, Any] = {
        "potential": point.scene.label,
        "power_order": point.scene.power_order,
        "particles": point.particles,
        "speed": point.speed,
        "velocity": point.scene.impact_velocity,
        "restitution": point.restitution,
        "restitution_error": point.error,
        "kinematic_restitution": point.restitution**0.5,
        "contacts": point.contacts,
        "contacts_per_particle": point.contacts / point.particles,
        "source": point.source,
        "agrees": point.agrees,
    }
    for engine, answer in answers.items():
        result = {} if answer is None or answer.result is None else answer.result
        record |= {
            f"{engine}_{name}": result.get(name)
            for name in ("restitution", "restitution_error", "scheme", "timestep")
        }
        record[f"{engine}_failure"] = None if answer is None else answer.failure
    return record
