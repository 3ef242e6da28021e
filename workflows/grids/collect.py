"""Collect the results of a grid of jobs from their logs."""

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from chaincor.analysis.dumps.printed import printed_numbers, stopped_with
from chaincor.analysis.error_bar import ErrorBar
from chaincor.lammps_inputs.errors import ChaincorError, InputError, one_line
from chaincor.lammps_inputs.given_numbers import number_in
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import NUMERICS_KEYS
from chaincor.lammps_inputs.script import SCENE_FILE, SCRIPT_FILE
from chaincor.lammps_inputs.small_file import read_small_file, refuse_device, refuse_endless
from chaincor.workflows.campaign.points import value_of
from chaincor.workflows.grids.grid import ASKED, MANIFEST
from chaincor.workflows.store.row import Row
from chaincor.workflows.versions import versions

_NAMES = (
    *("restitution", "restitution_error", "contacts", "last_contact_time"),
    *("momentum_change", "wall_impulse"),
)
_NOT_NEGATIVE = ("restitution", "restitution_error", "last_contact_time")
_RESTORE = "Restore the files of the job, or write the grid anew"
# A log prints eta and the momentum change with 17 digits. Due to rounding, the two speeds after the
# collision that follow from them may differ by this fraction.
_SAME = 1e-9
_SUBMIT_AGAIN = "Move log.lammps and chain.state away and submit it again"
# Largest count that both a store and a float represent exactly.
_MOST_CONTACTS = 2**53
_WALL_TIME = re.compile(r"^Total wall time: (\d+):(\d+):(\d+)", re.MULTILINE)


class JobError(Exception):
    """LAMMPS stopped with an error message."""


@dataclass(frozen=True)
class CollectedJob:
    """State of one job in a grid, as its logs show it."""

    folder: str  #: Name of the job's folder.
    #: ``done``; ``failed``: LAMMPS stopped with an error message; ``unfinished``: the job was
    #: stopped; ``missing``: the job never began; ``refused``: no job could be written.
    state: str
    words: str  #: Explanation in one line.
    scene: Scene | None = None  #: Requested scene; None if the job never ran.
    row: Row | None = None  #: Row for a store, with the result or the failure; None without either.


def collect_grid(folder: Path) -> list[CollectedJob]:
    """
    Read the logs of a grid of jobs.

    Raise InputError if the folder has no manifest.
    """
    try:
        reader = csv.DictReader(read_small_file(folder / MANIFEST).splitlines(keepends=True))
        rows, head = list(reader), list(reader.fieldnames or ())
    except (OSError, ValueError, csv.Error):
        rows, head = [], []
    if not rows or not {"folder", "refusal"} <= {*head} or len({*head}) < len(head):
        raise InputError(
            f"the folder {str(folder)!r} has no {MANIFEST} that can be read. Give a folder "
            "that `chaincor inputs SWEEP.toml -o DIR` wrote"
        )
    earlier: set[str] = set()
    for number, row in enumerate(rows, 1):
        _check_row(folder, number, row, earlier)
        earlier.add(row["folder"])
    known = {"lammps": "unknown", "chaincor": versions()["chaincor"]}
    return [_collect(folder, row, known) for row in rows]


def _check_row(grid: Path, number: int, row: dict[Any, Any], earlier: set[str]) -> None:
    """Raise InputError for a row whose fields differ from the head, or without its own folder."""
    name = row["folder"]
    wrong = None
    if None in row or None in row.values():
        wrong = "another number of fields than its first line"
    elif name in ("", "..") or Path(name).name != name or "\0" in name:
        wrong = f"the folder {name[:60]!a}, which is no folder of the grid"
    elif name in earlier:
        wrong = f"the folder {name[:60]!a}, which an earlier row has"
    if wrong is not None:
        raise InputError(
            f"{str(grid / MANIFEST)!r}: row {number} has {wrong}. Restore the row, or write "
            "the grid anew with `chaincor inputs SWEEP.toml -o DIR`"
        )


def _collect(grid: Path, row: dict[str, str], known: dict[str, str]) -> CollectedJob:
    name = row["folder"]
    if row["refusal"]:
        return CollectedJob(name, "refused", row["refusal"])
    folder = grid / name
    try:
        for each in (ASKED, SCENE_FILE):
            refuse_device(folder / each)
        asked, as_run = Scene.from_file(folder / ASKED), Scene.from_file(folder / SCENE_FILE)
    except ChaincorError as error:
        return CollectedJob(name, "missing", one_line(error))
    try:
        log, *others = (_text(folder / each) for each in ("log.lammps", "log.motion", "screen.txt"))
        script = _text(folder / SCRIPT_FILE)
    except ValueError as error:
        return CollectedJob(name, "unfinished", f"{error}. Remove it and submit the job again")
    everything = "\n".join([log, *others])
    if not everything.strip():
        return CollectedJob(name, "missing", "it has no log: submit it")
    if words := _point_mismatch(row, asked, as_run):
        return CollectedJob(name, "unfinished", f"{words}. {_RESTORE}")
    asked = asked.replace(engine="lammps")
    said = stopped_with(everything)
    result = _last_result(log)
    found = printed_numbers(result, _NAMES)
    if {"restitution", "restitution_error"} <= set(found) and said is None:
        words = (
            _invalid(found)
            or _of_another_run(log, result, as_run, script)
            or _contradiction(found, asked)
        )
        if words is not None:
            return CollectedJob(name, "unfinished", words)
        made = re.search(r"^LAMMPS \(([^)]*)\)", everything, re.MULTILINE)
        known = known | ({} if made is None else {"lammps": made[1]})
        return CollectedJob(name, "done", "", asked, _row(asked, as_run, found, log, known))
    if said is not None:
        return CollectedJob(name, "failed", said, asked, Row.of(JobError(said)))
    return CollectedJob(name, "unfinished", "it was stopped: submit it again")


def _point_mismatch(row: dict[str, str], asked: Scene, as_run: Scene) -> str | None:
    """Return why the two scenes of a job and its row in the manifest are not of the same point."""
    wanted, ran = asked.canonical_fields, as_run.canonical_fields
    chosen = {key for key in NUMERICS_KEYS if key not in wanted}
    for key in sorted((wanted.keys() | ran.keys()) - chosen - {"tolerance", "error", "engine"}):
        if wanted.get(key) != ran.get(key):
            return f"its {ASKED} and its {SCENE_FILE} disagree on {key}"
    for axis, cell in row.items():
        value = value_of(asked, axis)
        if isinstance(value, int | float) and number_in(cell) != value:
            return f"its {ASKED} has {axis} = {value:g}, and its row in {MANIFEST} {cell[:40]!a}"
        if axis == "potential" and cell != value:
            return f"its {ASKED} has {axis} = {value!a}, and its row in {MANIFEST} {cell[:40]!a}"
    return None


def _last_result(log: str) -> str:
    """
    Return the lines of the last whole result in a log.

    Jobs print `restitution_error` last. Its line must end: a log that is cut within a number would
    give another number.
    """
    ends = [
        found.end() for found in re.finditer(r"^\s*restitution_error = .*\n", log, re.MULTILINE)
    ]
    return log[([0, *ends])[-2] : ends[-1]] if ends else ""


def _invalid(found: dict[str, float]) -> str | None:
    """Return which number in a log cannot be a result; None if all of them can."""
    contacts, wrong = found.get("contacts", 1.0), None
    if not (1.0 <= contacts <= _MOST_CONTACTS and contacts.is_integer()):
        wrong = f"contacts = {contacts:g}, which is no whole number of 1 or more"
    for name in _NOT_NEGATIVE:
        value = found.get(name, 0.0)
        # The scene requests no error bar.
        unknown = name == "restitution_error" and math.isnan(value)
        if not (unknown or 0.0 <= value < math.inf):
            wrong = f"{name} = {value:g}, which is no finite number of 0 or more"
    return None if wrong is None else f"its log says {wrong}. {_SUBMIT_AGAIN}"


def _contradiction(found: dict[str, float], asked: Scene) -> str | None:
    """
    Return why a log lacks a number, or why its numbers contradict each other; None if they agree.

    Without a target, eta and the momentum change are forms of one number.
    """
    if "contacts" not in found:
        return (
            "its log lacks the contacts of its first run, because an earlier version of chaincor "
            f"wrote it. {_SUBMIT_AGAIN}"
        )
    eta, change = found["restitution"], found.get("momentum_change")
    if change is None or asked.line.targets:
        return None
    after = change / (asked.line.chain_mass * asked.impact_velocity) - 1.0
    if abs(math.sqrt(eta) - abs(after)) <= _SAME * max(1.0, abs(after)):
        return None
    wrong = f"restitution = {eta:g}, but its momentum_change gives {after**2:g}"
    return f"its log says {wrong}. {_SUBMIT_AGAIN}"


def _of_another_run(log: str, result: str, as_run: Scene, script: str) -> str | None:
    """Return why a result may be of another scene; None if it identifies its own scene."""
    named = re.findall(r"^scene = (\S+)", result, re.MULTILINE)
    if not re.search(r"^scene = ", log, re.MULTILINE) and _shows_script(log, script):
        return None
    last = named[-1] if named else ""
    if last == as_run.sha256:
        return None
    run = "a run at another velocity or step" if last == "other:" else "another scene"
    return f"its log is of {run}. {_SUBMIT_AGAIN}"


def _shows_script(log: str, script: str) -> bool:
    """
    Return whether a log echoes the velocity and the time step in a script, and no other velocity.

    Jobs of chaincor 0.1 do not print the hash of their scene, but their logs echo the script.
    """
    own = re.findall(r"^variable\s+(?:velocity|timestep) index \S+|^# A chain .*", script, re.M)
    speed = re.search(r"^variable\s+velocity index (\S+)", script, re.M)
    ran = re.findall(r"^velocity\s+all set -([^$\s]+) ", log, re.M)
    echoed = set(log.splitlines())
    return bool(own) and set(own) <= echoed and (speed is None or set(ran) == {speed[1]})


def _text(path: Path) -> str:
    """
    Return the text of a file; empty if the file is missing.

    Raise ValueError if the file may never end, such as a pipe.
    """
    try:
        refuse_endless(path)
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    except ValueError as error:
        raise ValueError(f"{path.name} cannot be read: {error}") from None


def _row(
    asked: Scene, as_run: Scene, found: dict[str, float], log: str, known: dict[str, str]
) -> Row:
    """Return a row for a store from a log; columns without a value in the log are empty."""
    numerics, tolerance = Numerics.from_scene(as_run), asked.asked_tolerance
    error = None if math.isnan(found["restitution_error"]) else found["restitution_error"]
    met = None if tolerance is None or error is None else error <= tolerance
    seconds = math.nan
    if took := _WALL_TIME.search(log):
        hours, minutes, rest = map(float, took.groups())
        seconds = 3600.0 * hours + 60.0 * minutes + rest
    ended = re.search(r"^ending = .*, end (\w+)$", log, re.MULTILINE)
    mass = float(np.sum(asked.line.chain_masses))
    residual = abs(found.get("momentum_change", math.nan) - found.get("wall_impulse", math.nan))
    return Row.of_fields(
        {
            "restitution": found["restitution"],
            "restitution_error": error,
            "kinematic_restitution": math.sqrt(found["restitution"]),
            "contacts": int(found["contacts"]),
            "last_contact_time": found.get("last_contact_time"),
            "wall": numerics.wall,
            "scheme": numerics.scheme,
            "timestep": numerics.timestep,
            "table": None if asked.bond.is_harmonic else numerics.table,
            "table_points": numerics.table_points,
            "v_star": asked.bond.natural_speed,
            "bond_range_source": "a log holds none",
            "momentum_residual": residual / (mass * asked.impact_velocity),
            "ending": "open" if ended is None else ended[1],
            "tolerance": tolerance,
            "tolerance_met": met,
            "reason": f"the job reached {error:.2g}, not {tolerance:g}" if met is False else None,
            "error_parts": vars(ErrorBar(error, 0.0, 0.0)),
            "seconds": seconds,
            "seconds_total": seconds,
            "versions": known,
            "details": {"collected": "from the log of a job"},
        }
    )
