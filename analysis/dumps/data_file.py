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
    read = [_MassCommands.of(each, path, expanded=expanded) for path, each in files.items()]
    found = [each.apply(in_data) for each in read] or [in_data]
    unclear = next((each.unclear for each in read if each.unclear), None)
    if any(masses != found[0] for masses in found):
        unclear = f"{' and '.join(path.name for path in files)} set different masses"
    hint, rows = sections.get("Atoms", ("", []))
    style = hint or next((each.atom_style for each in read if each.atom_style), "")
    source = "the job" if data is None or found[0] != in_data else str(data)
    return DeclaredMasses(found[0], _types_by_id(rows, style), source, unclear)


@dataclass
class _MassCommands:
    """The commands of one file that decide masses, in order."""

    masses: list[tuple[str, float] | None] = field(default_factory=list)  # None: read_data
    atom_style: str = ""
    unclear: str | None = None

    @classmethod
    def of(cls, commands: Sequence[Command], path: Path, *, expanded: bool) -> "_MassCommands":
        found = cls()
        for command in commands:
            words, said = command.words, f"'{command.line.strip()}' in {path.name}"
            if command.computed and words[0] in ("mass", "set"):
                # A log repeats the line with what variables stand for.
                if not expanded and _sets_masses(words):
                    found.unclear = f"{said} sets masses by a variable"
            elif words[0] == "read_data":
                found.masses.append(None)
            elif words[0] == "atom_style":
                found.atom_style = words[1] if len(words) > 1 else ""
            elif words[0] == "set" and _sets_masses(words):
                found.unclear = f"{said} changes masses or types"
            elif words[0] == "mass":
                found._add_mass(words, said)
        return found

    def _add_mass(self, words: list[str], said: str) -> None:
        try:
            _type_range(words[1])
            self.masses.append((words[1], float(words[2])))
        except (ValueError, IndexError):
            self.unclear = f"{said} cannot be read"

    def apply(self, in_data: dict[int, float]) -> dict[int, float]:
        """Return the masses after all commands; ``read_data`` brings those of the data file."""
        masses = {} if None in self.masses else dict(in_data)
        for command in self.masses:
            if command is None:
                masses.update(in_data)
                continue
            low, high = _type_range(command[0])
            known = {*in_data, *masses}
            last = max(known, default=low) if high is None else high
            masses.update(dict.fromkeys(range(low, max(last, low) + 1), command[1]))
        return masses


def _type_range(word: str) -> tuple[int, int | None]:
    """Read the first argument of ``mass``: ``3``, ``*``, ``2*``, ``*4`` or ``2*4``."""
    if "*" not in word:
        return int(word), int(word)
    low, high = word.split("*")
    return int(low or 1), int(high) if high else None


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
    rows: list[list[str]] | None = None
    for line in text.splitlines()[1:]:
        body, _, comment = line.partition("#")
        words = body.split()
        if not words:
            continue
        if words[0][0].isalpha() and len(words) <= 3 and not words[-1][-1].isdigit():
            name = " ".join(words)
            rows = [] if name in wanted else None
            if rows is not None:
                sections[name] = (comment.strip(), rows)
        elif rows is not None:
            rows.append(words)
    return sections


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
