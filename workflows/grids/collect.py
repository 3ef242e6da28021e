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
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.small_file import read_small_file, refuse_endless
from chaincor.workflows.grids.grid import ASKED, MANIFEST
from chaincor.workflows.store.row import Row
from chaincor.workflows.versions import versions

_NAMES = (
    *("restitution", "restitution_error", "contacts", "last_contact_time"),
    *("momentum_change", "wall_impulse"),
)
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
        rows = list(csv.DictReader(read_small_file(folder / MANIFEST).splitlines(keepends=True)))
    except (OSError, ValueError, csv.Error):
        rows = []
    if not rows or not {"folder", "refusal"} <= set(rows[0]):
        raise InputError(
            f"the folder {str(folder)!r} has no {MANIFEST} that can be read. Give a folder "
            "that `chaincor inputs SWEEP.toml -o DIR` wrote"
        )
    for number, row in enumerate(rows, 1):
        _check_row(folder, number, row)
    known = {"lammps": "unknown", "chaincor": versions()["chaincor"]}
    return [_collect(folder, row["folder"], row["refusal"], known) for row in rows]


def _check_row(grid: Path, number: int, row: dict[Any, Any]) -> None:
    """Raise InputError if a row in a manifest is too short, is too long, or names no folder."""
    name = row["folder"]
    wrong = None
    if None in row or None in row.values():
        wrong = "another number of fields than its first line"
    elif not name or Path(name).name != name or "\0" in name:
        wrong = f"the folder {name[:60]!a}, which is no folder of the grid"
    if wrong is not None:
        raise InputError(
            f"{str(grid / MANIFEST)!r}: row {number} has {wrong}. Restore the row, or write "
            "the grid anew with `chaincor inputs SWEEP.toml -o DIR`"
        )


def _collect(grid: Path, name: str, refusal: str, known: dict[str, str]) -> CollectedJob:
    if refusal:
        return CollectedJob(name, "refused", refusal)
    folder = grid / name
    try:
        asked = Scene.from_file(folder / ASKED)
        as_run = Scene.from_file(folder / "scene.toml")
    except ChaincorError as error:
        return CollectedJob(name, "missing", one_line(error))
    try:
        log, *others = (_text(folder / each) for each in ("log.lammps", "log.motion", "screen.txt"))
        script = _text(folder / "in.chain")
    except ValueError as error:
        return CollectedJob(name, "unfinished", f"{error}. Remove it and submit the job again")
    everything = "\n".join([log, *others])
    if not everything.strip():
        return CollectedJob(name, "missing", "it has no log: submit it")
    said = stopped_with(everything)
    found = printed_numbers(log, _NAMES)
    if {"restitution", "restitution_error"} <= set(found) and said is None:
        words = _missing(found) or _of_another_run(log, as_run, script)
        if words is not None:
            return CollectedJob(name, "unfinished", words)
        made = re.search(r"^LAMMPS \(([^)]*)\)", everything, re.MULTILINE)
        known = known | ({} if made is None else {"lammps": made[1]})
        return CollectedJob(name, "done", "", asked, _row(asked, as_run, found, log, known))
    if said is not None:
        return CollectedJob(name, "failed", said, asked, Row.of(JobError(said)))
    return CollectedJob(name, "unfinished", "it was stopped: submit it again")


def _missing(found: dict[str, float]) -> str | None:
    """Return why the numbers in a log form no valid result; None if they do."""
    eta, error = found["restitution"], found["restitution_error"]
    if not 0.0 <= eta < math.inf or error < 0.0:
        return (
            f"its log says restitution = {eta:g} and restitution_error = {error:g}, which "
            "must not be negative. Move the log away and submit the job again"
        )
    if "contacts" not in found:
        return (
            "its log lacks the contacts of its first run, because an earlier version of chaincor "
            "wrote it. Move log.lammps and chain.state away and submit it again"
        )
    contacts = found["contacts"]
    if not (1.0 <= contacts <= _MOST_CONTACTS and contacts.is_integer()):
        return (
            f"its log says contacts = {contacts:g}, which is no whole number of 1 or more. "
            "Move the log away and submit the job again"
        )
    return None


def _of_another_run(log: str, as_run: Scene, script: str) -> str | None:
    """Return why a log may belong to another scene; None if the log identifies its own scene."""
    named = re.findall(r"^scene = (\S+)", log, re.MULTILINE)
    if not named and _shows_script(log, script):
        return None
    last = named[-1] if named else ""
    if last == as_run.sha256:
        return None
    run = "a run at another velocity or step" if last == "other:" else "another scene"
    return f"its log is of {run}. Move log.lammps and chain.state away and submit it again"


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
