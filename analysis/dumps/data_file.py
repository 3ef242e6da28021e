"""What a LAMMPS data file, and the commands that read it, say of masses and types."""

import gzip
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.run_commands import NO_COMMANDS, Command, RunCommands
from chaincor.lammps_inputs.errors import InputError

# Where the type stands in a line of the section Atoms.
_TYPE_PLACE = dict.fromkeys(("bond", "angle", "molecular", "full"), 2)
_TYPE_PLACE |= dict.fromkeys(("atomic", "charge", "sphere", "ellipsoid"), 1)


@dataclass(frozen=True)
class DeclaredMasses:
    """Masses as the files of a job declare them, for dumps that do not carry them."""

    #: Mass of each type; empty where none is declared.
    by_type: dict[int, float] = field(default_factory=dict)
    #: Types in order of id, from the data file; None where they are not known; of shape (n,).
    types: NDArray[np.int64] | None = None
    source: str = ""  #: Which file says so.
    unclear: str | None = None  #: Why that cannot be relied on.


def declared_masses(data: Path | None, commands: RunCommands = NO_COMMANDS) -> DeclaredMasses:
    """
    Gather what a job declares of masses: section Masses, and the commands ``mass`` and ``set``.

    Raises InputError if the section cannot be read.
    """
    sections = {} if data is None else _read_sections(data, ("Masses", "Atoms"))
    in_data = _masses_section(sections.get("Masses", ("", []))[1], data)
    files, expanded = commands.named("mass", "set", "read_data", "atom_style")
    read = [_masses_after(each, in_data, path.name, expanded) for path, each in files.items()]
    found = read[0][0] if read else in_data
    unclear = next((why for _, why in read if why), None)
    if any(masses != found for masses, _ in read):
        unclear = f"{' and '.join(path.name for path in files)} set different masses"
    hint, rows = sections.get("Atoms", ("", []))
    said = (c.words for each in files.values() for c in each if not c.computed)
    styles = [words[1] for words in said if words[0] == "atom_style" and len(words) > 1]
    source = "the job" if data is None or found != in_data else str(data)
    return DeclaredMasses(found, _types_by_id(rows, hint or "".join(styles[-1:])), source, unclear)


def _masses_after(
    commands: Sequence[Command], in_data: dict[int, float], name: str, expanded: bool
) -> tuple[dict[int, float], str | None]:
    """Return masses by type after the commands of a file, and why they cannot be relied on."""
    reads_data = any(command.words[0] == "read_data" for command in commands)
    masses, unclear = {} if reads_data else dict(in_data), None
    for command in commands:
        words, said = command.words, f"'{command.line.strip()}' in {name}"
        if words[0] == "read_data":
            masses.update(in_data)
        elif words[0] == "atom_style" or not _sets_masses(words):
            continue
        elif command.computed:
            # A log repeats the line with what variables stand for.
            unclear = unclear if expanded else f"{said} sets masses by a variable"
        elif words[0] == "set":
            unclear = f"{said} changes masses or types"
        else:
            try:
                masses.update(_masses_of_types(words, {*in_data, *masses}))
            except (ValueError, IndexError):
                unclear = f"{said} cannot be read"
    return masses, unclear


def _masses_of_types(words: list[str], known: set[int]) -> dict[int, float]:
    """Return what ``mass TYPES M`` sets; TYPES is ``3``, ``*``, ``2*``, ``*4`` or ``2*4``."""
    low, star, high = words[1].partition("*")
    first = int(low or 1)
    last = int(high) if high else max(known, default=first) if star else first
    return dict.fromkeys(range(first, max(last, first) + 1), float(words[2]))


def _sets_masses(words: list[str]) -> bool:
    if words[0] == "mass":
        return True
    return any(word == "mass" or word.startswith("type") for word in words[3:])


def _read_sections(path: Path, wanted: Sequence[str]) -> dict[str, tuple[str, list[list[str]]]]:
    """Return hint and rows of some sections."""
    try:
        raw = path.read_bytes()
        text = (gzip.decompress(raw) if raw.startswith(b"\x1f\x8b") else raw).decode("utf-8")
    except (OSError, EOFError, UnicodeDecodeError) as error:
        raise InputError(f"cannot read {path}: {error}; expected a LAMMPS data file") from None
    sections: dict[str, tuple[str, list[list[str]]]] = {}
    rows: list[list[str]] = []
    for line in text.splitlines()[1:]:
        body, _, comment = line.partition("#")
        words = body.split()
        if words and words[0][0].isalpha() and len(words) <= 3 and not words[-1][-1].isdigit():
            rows = []
            sections[" ".join(words)] = (comment.strip(), rows)
        elif words:
            rows.append(words)
    return {name: found for name, found in sections.items() if name in wanted}


def _masses_section(rows: list[list[str]], path: Path | None) -> dict[int, float]:
    try:
        return {int(row[0]): float(row[1]) for row in rows}
    except (ValueError, IndexError):
        raise InputError(
            f"section Masses of {path} cannot be read; expected lines of type and mass, as '1 1.0'"
        ) from None


def _types_by_id(rows: list[list[str]], style: str) -> NDArray[np.int64] | None:
    place = _TYPE_PLACE.get(style)
    if place is None or not rows:
        return None
    try:
        return np.array([t for _, t in sorted((int(row[0]), int(row[place])) for row in rows)])
    except (ValueError, IndexError):
        return None
