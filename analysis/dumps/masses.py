"""Masses of the particles, from the wall outward: from the dump, the job's files, or the user."""

import gzip
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.run_commands import CommandWords, RunCommands, is_computed
from chaincor.analysis.modes import are_equal
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.small_file import refuse_endless

MASS_COLUMN = "mass"
TYPE_COLUMN = "type"
# Largest relative difference between given masses and the masses in a dump, which may have only the
# six digits of the default format.
_SAME_MASS = 1e-5
# Larger masses are refused, because squares of energies would overflow.
_LARGEST_MASS = 1e100
# A data file with more types does not describe a chain.
_MOST_TYPES = 10_000_000
# Column of the type in the section Atoms, by atom style.
_TYPE_PLACE = dict.fromkeys(("bond", "angle", "molecular", "full"), 2)
_TYPE_PLACE |= dict.fromkeys(("atomic", "charge", "sphere", "ellipsoid"), 1)


@dataclass(frozen=True)
class DeclaredMasses:
    """Masses that the files of a job declare, for dumps without masses."""

    #: Mass of each type; empty if none is declared.
    by_type: dict[int, float] = field(default_factory=dict)
    #: Types in the order of ids, from the data file, of shape (n,); None if they are unknown.
    types: NDArray[np.int64] | None = None
    source: str = ""  #: File that declares the masses.
    unclear: str | None = None  #: Reason why the declaration is unreliable; None if it is reliable.


_NONE_DECLARED = DeclaredMasses()


def masses_of_bodies(
    frame: DumpFrame,
    layout: ChainLayout,
    *,
    given: ArrayLike | None = None,
    declared: DeclaredMasses = _NONE_DECLARED,
    scene: Scene | None = None,
) -> tuple[list[Array], bool]:
    """
    Return the masses of the chain, and of a free target, each from the contact outward.

    The masses come from the first available source: the column ``mass`` of the dump; the types of
    the particles, with the masses that the job declares; given masses, which are repeated along a
    chain and must not contradict the job; the masses of the scene. Without a source, masses are 1.
    The second returned value says whether there is a source. Raises InputError if types differ and
    their masses are not known, if given masses are not those of the job, or if masses are given for
    a chain with a free target.
    """
    if given is not None and layout.targets:
        raise InputError(
            "masses are given for a chain with a free target. Drop --masses, and give the "
            "masses of both bodies in a column 'mass' of the dump or in the data file"
        )
    found, why = _by_id(frame, layout.all_particles, declared)
    if given is None:
        if found is not None:
            return layout.by_body(found), True
        if scene is not None:
            line = scene.line
            bodies = [line.chain_masses, line.target_masses][: 1 + bool(layout.targets)]
            # If the types have different masses, a scene with equal masses does not describe this
            # chain.
            if not (why and are_equal(np.concatenate(bodies))):
                return bodies, True
        if why:
            raise InputError(
                f"the masses of the particles are not known: {why}; give them from the wall "
                "outwards (--masses 1,2 or --masses FILE), or dump a column 'mass'"
            )
        return layout.by_body(np.ones(layout.all_particles)), False
    masses = _repeated(given, layout.particles)
    if found is not None:
        (found,) = layout.by_body(found)
        if not np.allclose(masses, found, rtol=_SAME_MASS, atol=0.0):
            i = int(np.argmax(np.abs(masses / found - 1.0)))
            raise InputError(
                f"--masses gives particle {i + 1} from the wall the mass {masses[i]:g}, {why} "
                f"{found[i]:g}. Drop --masses, or give the masses of the run"
            )
    return [masses], True


def mass_resolution(frame: DumpFrame, layout: ChainLayout, masses: Array) -> Array:
    """
    Return the error of masses due to the printed digits of a dump.

    The error is half a unit of the last digit. The error is 0 if the masses do not come from a
    column of the dump. If all masses are equal, the error is also 0, because restitution does not
    depend on a common factor.
    """
    if MASS_COLUMN in frame.columns and not are_equal(masses):
        printed = layout.by_body(frame.column(MASS_COLUMN))[0]
        if np.array_equal(masses, printed):
            half = frame.resolution(MASS_COLUMN, frame.significant_digits())
            return layout.by_body(half)[0]
    return np.zeros(masses.size)


def _repeated(masses: ArrayLike, particles: int) -> Array:
    """Repeat k masses along the chain: particle k + 1 again has the first mass."""
    given = np.atleast_1d(np.asarray(masses, dtype=float))
    wrong = given[~((given > 1.0 / _LARGEST_MASS) & (given < _LARGEST_MASS))]
    if given.size == 0 or wrong.size:
        what = f"a mass is {wrong[0]:g}" if wrong.size else "no mass is given"
        raise InputError(f"{what}. Give positive finite numbers, as in --masses 1,2")
    if given.size > particles:
        raise InputError(
            f"{given.size} masses are given for {particles} particles. Give one mass for "
            "each particle from the wall outwards, or fewer, which are then repeated along "
            "the chain"
        )
    return np.resize(given, particles)


def _by_id(frame: DumpFrame, n: int, declared: DeclaredMasses) -> tuple[Array | None, str]:
    """Return masses by id and their source; else None and the reason, which may be empty."""
    if MASS_COLUMN in frame.columns:
        return _repeated(frame.column(MASS_COLUMN), n), f"column '{MASS_COLUMN}' of the dump"
    if declared.unclear is not None:
        return None, declared.unclear
    types = frame.whole_numbers(TYPE_COLUMN) if TYPE_COLUMN in frame.columns else declared.types
    kinds = [] if types is None else [int(kind) for kind in np.unique(types)]
    if not declared.by_type:
        differ = "particles are of types " + ", ".join(map(str, kinds[:5]))
        return None, f"{differ} and no Masses are declared" if len(kinds) > 1 else ""
    missing = [kind for kind in kinds if kind not in declared.by_type]
    if missing:
        return None, f"{declared.source} declares no mass for type {missing[0]}"
    used = {declared.by_type[kind] for kind in kinds} or set(declared.by_type.values())
    if len(used) == 1:
        return _repeated([*used], n), declared.source
    if types is None:
        return None, f"{declared.source} declares several, and the dump has no column 'type'"
    if types.size != n:
        return None, f"{declared.source} has {types.size} atoms, the dump {n}"
    by_particle = [declared.by_type[int(kind)] for kind in types]
    return _repeated(by_particle, n), declared.source


def declared_masses(data: Path | None, commands: RunCommands) -> DeclaredMasses:
    """
    Return the masses that a job declares, in section Masses or by ``mass`` and ``set``.

    Raises InputError if the section cannot be read.
    """
    sections = {} if data is None else read_data_sections(data)
    in_data = _masses_section(sections.get("Masses", ("", []))[1], data)
    files, expanded = commands.named("mass", "set", "read_data", "atom_style")
    read = [_masses_after(each, in_data, path.name, expanded) for path, each in files.items()]
    found = read[0][0] if read else in_data
    unclear = next((why for _, why in read if why), None)
    if any(masses != found for masses, _ in read):
        unclear = f"{' and '.join(path.name for path in files)} set different masses"
    hint, rows = sections.get("Atoms", ("", []))
    said = (c for each in files.values() for c in each if not is_computed(c))
    styles = [words[1] for words in said if words[0] == "atom_style" and len(words) > 1]
    source = "the job" if data is None or found != in_data else str(data)
    return DeclaredMasses(found, _types_by_id(rows, hint or "".join(styles[-1:])), source, unclear)


def _masses_after(
    commands: Sequence[CommandWords], in_data: dict[int, float], name: str, expanded: bool
) -> tuple[dict[int, float], str | None]:
    """Return masses by type after the commands of a file, and why they are unreliable, or None."""
    reads_data = any(words[0] == "read_data" for words in commands)
    masses, unclear = {} if reads_data else dict(in_data), None
    for words in commands:
        said = f"'{' '.join(words)}' in {name}"
        if words[0] == "read_data":
            masses.update(in_data)
        elif words[0] == "atom_style" or not _sets_masses(words):
            continue
        elif is_computed(words):
            # A log prints a command again with the values of variables.
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
    """Return the masses that ``mass TYPES M`` sets, such as ``3``, ``*``, ``2*``, ``2*4``."""
    low, star, high = words[1].partition("*")
    first = int(low or 1)
    last = int(high) if high else max(known, default=first) if star else first
    if last > _MOST_TYPES:
        raise ValueError(f"{last} types")
    return dict.fromkeys(range(first, max(last, first) + 1), float(words[2]))


def _sets_masses(words: list[str]) -> bool:
    if words[0] == "mass":
        return True
    return any(word == "mass" or word.startswith("type") for word in words[3:])


def read_data_sections(path: Path) -> dict[str, tuple[str, list[list[str]]]]:
    """
    Return the style hint and rows of each section of a data file; the header has an empty name.

    The file may be gzipped. Raises InputError if it cannot be read.
    """
    try:
        refuse_endless(path)
        raw = path.read_bytes()
        text = (gzip.decompress(raw) if raw.startswith(b"\x1f\x8b") else raw).decode("utf-8")
    except (OSError, EOFError, zlib.error, ValueError) as error:
        raise InputError(f"cannot read {path}: {error}. Give a LAMMPS data file") from None
    rows: list[list[str]] = []
    sections = {"": ("", rows)}
    for line in text.splitlines()[1:]:
        body, _, comment = line.partition("#")
        words = body.split()
        if words and words[0][0].isalpha() and len(words) <= 3 and not words[-1][-1].isdigit():
            rows = []
            sections[" ".join(words)] = (comment.strip(), rows)
        elif words:
            rows.append(words)
    return sections


def _masses_section(rows: list[list[str]], path: Path | None) -> dict[int, float]:
    try:
        return {int(row[0]): float(row[1]) for row in rows}
    except (ValueError, IndexError):
        raise InputError(
            f"section Masses of {path} cannot be read. Write lines of type and mass, such "
            "as '1 1.0'"
        ) from None


def _types_by_id(rows: list[list[str]], style: str) -> NDArray[np.int64] | None:
    place = _TYPE_PLACE.get(style)
    if place is None or not rows:
        return None
    try:
        return np.array([t for _, t in sorted((int(row[0]), int(row[place])) for row in rows)])
    except (ValueError, IndexError):
        return None
