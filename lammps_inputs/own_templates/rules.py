"""Rules for the commands in templates of users: which are refused, and why."""

import itertools
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import NoReturn

from chaincor.lammps_inputs.commands import commands_of, words_of
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.own_templates.files import wrong_file

# First words of refused commands, with the reasons.
_REFUSED = {
    "minimize": "it moves the particles, although no time passes",
    "run": "the event loop runs the time steps, beginning with a 'run 0' that initializes them",
    "rerun": "the event loop runs the time steps",
    "timestep": "the event loop sets the time step",
    "run_style": "contacts are located within plain Verlet steps",
    "reset_timestep": "the times of contacts would jump",
    "clear": "it would delete the chain",
    "read_data": "the chain is there already",
    "read_restart": "the chain is there already",
    "create_atoms": "the chain is complete",
    "delete_atoms": "the chain would lose particles",
    "delete_bonds": "it cuts the chain without removing the energy of the bond",
    "displace_atoms": "the data file places the chain",
    "units": "the job sets the units",
    "atom_style": "the chain is there already",
    "bond_style": "the scene sets the bonds",
    "bond_coeff": "the scene sets the bonds",
    "boundary": "a chain in a periodic box would collide with itself",
    "kspace_style": "the particles have no charges",
    "quit": "the job would end before it prints its result",
    "log": "the result would not be in log.lammps",
    "next": "the job would skip its runs for the error bar",
    "velocity": "the job sets the velocities",
}
# Commands that measure or print, and change neither the motion nor the job. A template that extends
# the job may contain these, and fixes.
_HARMLESS = frozenset(
    (
        *("compute", "compute_modify", "uncompute", "dump", "dump_modify", "undump", "write_dump"),
        *("thermo", "thermo_modify", "thermo_style", "variable", "print", "echo", "info"),
        *("group", "region", "if", "label", "jump", "fix", "unfix"),
        *("fix_modify", "write_data", "write_restart", "write_coeff"),
    )
)
_OF_IF = ("then", "elif", "else")
# Commands that exert forces. A template may contain them if it declares other forces.
_PAIRS = ("pair_style", "pair_coeff", "pair_modify", "special_bonds", "angle_style", "angle_coeff")
# Commands that are also refused in a whole script, with the reasons. Only the last pattern of the
# refused fixes below applies to a whole script.
_PROGRAMS = {
    **dict.fromkeys(
        ("shell", "python", "plugin", "geturl", "mdi", "message", "server", "kim", "kim_query"),
        "a job runs LAMMPS alone",
    ),
    "include": "a job reads no other scripts",
    "partition": "a job runs in a single partition",
}
_VARIABLES = {
    "python": "a job runs LAMMPS alone",
    "getenv": "a job depends on its own files alone",
    **dict.fromkeys(("file", "atomfile"), "a job reads no other scripts"),
}
# Patterns of the styles of refused fixes, with the reasons.
_REFUSED_FIXES = [
    (
        r"nve.*|nvt.*|npt.*|nph.*|rigid.*|move|brownian.*|verlet.*",
        "`fix motion` moves the particles already, so they would move twice",
    ),
    (r"wall/.*|wall", "the momentum that a second wall transfers is not counted"),
    (
        r"langevin.*|temp/.*|gld|gle|bd|ttm.*|msst|nphug|qtb|qbmsst|dpd/.*",
        "momentum and energy from a thermostat would be attributed to the wall",
    ),
    (r"halt", "the job finds the wall by its own `fix halt`, and a second one would stop its runs"),
    (r"deform|balance|adapt.*|dt/reset", "the job needs a constant box and a constant time step"),
    (r"shake|rattle", "a chain of fixed bonds cannot be compressed"),
    (r"python.*|external|plumed|colvars|client.*|mdi.*|ipi|imd", "a job runs LAMMPS alone"),
]
# Patterns of the styles of fixes that measure and do not act on the particles.
_PASSIVE = r"ave/.*|print|store/.*|vector|nonaffine/displacement"
# Suffixes of accelerated styles, which LAMMPS runs like the plain style.
_ACCELERATED = re.compile(r"/(omp|kk(/(host|device))?|gpu|intel|opt)$")
_BY_VELOCITY = r"viscous.*|drag|damping.*"
# Commands that change an object with a name, and the commands that create such objects.
_OF_NAMES = {
    "unfix": "fix",
    "fix_modify": "fix",
    "undump": "dump",
    "dump_modify": "dump",
    "uncompute": "compute",
    "compute_modify": "compute",
    "jump": "label",
}
_WITH_NAMES = ("fix", "variable", "label", "group", "dump", "compute")


def check_commands(text: str, plain: str, *, composed: bool, other_forces: bool) -> None:
    """
    Refuse commands of a template that break the event wall or the detection of the end.

    `text` is the job with these commands, and `plain` the job without them. `composed` says whether
    the job composes its steps, and `other_forces` whether the template declares forces. Raises
    SceneError with the command and the reason.
    """
    ours = Counter(commands_of(plain))
    names: dict[str, set[str]] = {kind: set() for kind in _WITH_NAMES}
    for kind, *rest in map(str.split, ours):
        if kind in names:
            names[kind].update(rest[:1])
    theirs = []
    for command in commands_of(text):
        if ours[command]:
            ours[command] -= 1
        else:
            theirs.append(command)
    for part, words in _with_quoted(theirs):
        _check(part, words, names, composed, other_forces)


def check_whole(text: str) -> None:
    """Raise SceneError if a script has a command that does more than run LAMMPS."""
    commands = commands_of(text)
    if not any(command.split()[0] == "run" for command in commands):
        raise SceneError(
            "the template extends nothing and has no run command. Begin it with {% extends "
            '"job.in.j2" %}, or write a whole script'
        )
    for part, words in _with_quoted(commands):
        _first_word(part, words, _PROGRAMS, _REFUSED_FIXES[-1:])
        _refuse_files(part, words)


def _first_word(
    command: str,
    words: list[str],
    refused: dict[str, str],
    refused_fixes: Sequence[tuple[str, str]],
) -> str:
    """Return the first word of a command; refuse forbidden words and forbidden styles of fixes."""
    first = "".join(" ".join(words).split()[:1])
    if "$" in first:
        _refuse(command, "the name of a command must not contain a variable")
    if first in refused:
        _refuse(command, refused[first])
    if first == "jump" and words[1:2] != ["SELF"]:
        _refuse(command, "a job jumps only within its own file, by SELF")
    if first in ("fix", "variable") and "$" in "".join(
        words[2:4] if first == "fix" else words[2:3]
    ):
        _refuse(command, "its style must not contain a variable")
    if first == "variable" and (reason := _VARIABLES.get("".join(words[2:3]))):
        _refuse(command, reason)
    if first == "fix" and len(words) > 3:
        for pattern, reason in refused_fixes:
            if re.fullmatch(pattern, _style_of(words)):
                _refuse(command, reason)
    return first


def _style_of(words: list[str]) -> str:
    """Return the style of a fix, without the suffix of an accelerated style."""
    return _ACCELERATED.sub("", words[3])


def _check(
    command: str,
    words: list[str],
    names: dict[str, set[str]],
    composed: bool,
    other_forces: bool,
) -> None:
    first = _first_word(command, words, _REFUSED | _PROGRAMS, _REFUSED_FIXES)
    _refuse_files(command, words)
    kind = _OF_NAMES.get(first, first)
    name = words[2 if first == "jump" else 1 :][:1]
    if kind in _WITH_NAMES and name:
        if "$" in name[0]:
            _refuse(command, "its name must not contain a variable")
        if name[0] in names[kind]:
            _refuse(command, f"the job itself uses the name {name[0]}")
    if first == "thermo_modify" and "lost" in words:
        _refuse(command, "a job must not lose particles")
    acts = first in _PAIRS
    if first == "fix" and len(words) > 3:
        acts = not re.fullmatch(_PASSIVE, _style_of(words))
        if composed and re.fullmatch(_BY_VELOCITY, _style_of(words)):
            _refuse(
                command,
                "composed schemes contain backward steps, and a force that depends on the velocity "
                "is not reversible",
                "Give --scheme verlet, or remove it",
            )
    if acts and not other_forces:
        _refuse(
            command,
            "momentum from other forces would be attributed to the wall",
            "Declare it by {% set other_forces = true %} in the template, or remove it",
        )
    if not acts and first not in _HARMLESS:
        _refuse(command, "a template may only measure, print and add declared forces")


def _refuse(command: str, reason: str, remedy: str = "Remove it") -> NoReturn:
    raise SceneError(f"the template has the command {command[:60]!a}, but {reason}. {remedy}")


def _refuse_files(command: str, words: list[str]) -> None:
    reason = wrong_file(words)
    if reason is not None:
        _refuse(command, reason, "Give the name of a file of its own in the folder of the job")


def _with_quoted(commands: Iterable[str]) -> Iterator[tuple[str, list[str]]]:
    """
    Yield commands and their words, also those quoted in an `if` or in a `run ... every`.

    Words are split like in LAMMPS. Otherwise LAMMPS might run commands that were not checked.
    """
    for command in commands:
        if not (command.isascii() and command.isprintable()):
            _refuse(
                command, "LAMMPS may read its special characters as quotes, spaces or line ends"
            )
        try:
            words = words_of(command)
        except ValueError:
            _refuse(command, "a quote is not closed")
        yield command, words
        if words[:1] == ["if"]:
            # The word after `elif` is a condition.
            found = itertools.pairwise(words[1:])
            parts = [word for before, word in found if before != "elif"]
            yield from _with_quoted(part for part in parts if part not in _OF_IF)
        elif words[:1] == ["run"] and "every" in words:
            yield from _with_quoted(words[words.index("every") + 2 :])
