"""What the text of a script says beforehand: variables it cannot take, files it would overwrite."""

import re
from dataclasses import dataclass
from pathlib import Path

from chaincor.lammps_inputs.errors import InputError

# Styles of `variable` that count, and are no value.
_COUNTS = ("loop", "world", "universe", "uloop")
# Commands that run many times by themselves, or run again what was dumped.
_OTHER_RUNS = (
    *("rerun", "temper", "temper/grem", "temper/npt", "neb", "neb/spin"),
    *("prd", "tad", "hyper"),
)
# What stands in quotes or not, up to a comment.
_COMMENT = re.compile(r"""^((?:[^#"']|"[^"]*"|'[^']*'|["'])*?)#.*$""")
_LARGEST_SCRIPT = 10_000_000
# Commands that read what the words behind them name; whatever else names a path writes there.
_READERS = (
    *("read_data", "read_restart", "read_dump", "include", "jump", "rerun", "molecule"),
    *("pair_coeff", "bond_coeff", "angle_coeff", "dihedral_coeff", "improper_coeff", "plugin"),
    *("pair_style", "bond_style", "kim", "variable", "lattice", "region", "group", "if"),
)


@dataclass(frozen=True)
class ScriptText:
    """A script, read but not run."""

    path: Path  #: Where it lies.
    #: Its commands with the number of their first line, continued lines joined and comments gone.
    lines: tuple[tuple[int, str], ...]

    def mentions(self, name: str) -> bool:
        """Return whether a variable's value is used anywhere in this text."""
        short = rf"|\${re.escape(name)}" if len(name) == 1 else ""
        used = re.compile(rf"\$\{{{re.escape(name)}\}}|\bv_{re.escape(name)}\b{short}")
        return any(used.search(line) for _, line in self.lines)

    @property
    def is_whole(self) -> bool:
        """Whether no other text is included, which may use a variable as well."""
        return not any(line.split()[0] in ("include", "jump") and "SELF" not in line.split()
                       for _, line in self.lines)  # fmt: skip


def read_script(path: Path) -> ScriptText:
    """Read a script; raises InputError where that cannot be done."""
    try:
        if not path.is_file():
            raise InputError(f"the script is {str(path)!r}; expected a file: there is none")
        if path.stat().st_size > _LARGEST_SCRIPT:
            raise InputError(
                f"the script {str(path)!r} is larger than 10 MB; expected LAMMPS's input"
            )
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"cannot read the script {str(path)!r}: {error.strerror}") from None
    lines: list[tuple[int, str]] = []
    number = 1
    for raw, command in join_lines(text):
        if command.split():
            lines.append((number, command))
        number += raw.count("\n") + 1
    return ScriptText(path, tuple(lines))


def join_lines(text: str) -> list[tuple[str, str]]:
    """
    Return each command of a script, as it stands and as LAMMPS reads it.

    The second is without comments, and with lines joined that ``&`` continues; what stands in
    triple quotes over several lines is left as it is.
    """
    found: list[tuple[str, str]] = []
    raw: list[str] = []
    command = ""
    for line in text.splitlines():
        raw.append(line)
        command += _COMMENT.sub(r"\1", line).rstrip()
        if "\n".join(raw).count('"""') % 2:
            command += "\n"
            continue
        if command.endswith("&"):
            command = command[:-1] + " "
            continue
        found.append(("\n".join(raw), command))
        raw, command = [], ""
    if raw:
        found.append(("\n".join(raw), command))
    return found


def included(script: ScriptText) -> list[ScriptText]:
    """Return a script and all that it includes, or jumps into, by names that stand in it."""
    found = [script]
    for each in found:
        for _, line in each.lines:
            words = line.split()
            if words[0] in ("include", "jump") and len(words) > 1 and words[1] != "SELF":
                path = script.path.parent / words[1].strip("\"'")
                if path.is_file() and path.resolve() not in {f.path.resolve() for f in found}:
                    found.append(read_script(path))
    return found


def check_variable(script: ScriptText, name: str) -> None:
    """
    Raise InputError where a script does not use a variable, or counts a loop with it.

    Whatever else sets the variable is set to the value that is given instead.
    """
    own = re.compile(rf"\s*variable\s+{re.escape(name)}\s+(\S+)(.*)")
    for number, line in script.lines:
        match = own.match(line)
        if match and match[1] in _COUNTS:
            rest = " ".join(match[2].split())
            raise InputError(
                f"line {number} of {script.path.name} says 'variable {name} {match[1]} {rest}', "
                f"which counts and cannot be given a value; expected 'variable {name} index VALUE'"
            )
    if script.is_whole and not script.mentions(name):
        raise InputError(
            f"{script.path.name} does not use the variable {name!r}; expected ${{{name}}} or "
            f"v_{name} in it"
        )


def refuse_other_runs(script: ScriptText) -> None:
    """Raise InputError where a script runs by commands whose time is not that of ``run``."""
    for each in included(script):
        for number, line in each.lines:
            if line.split()[0] in _OTHER_RUNS:
                raise InputError(
                    f"line {number} of {each.path.name} is '{line.split()[0]}', whose runs cannot "
                    "be held at one time with other steps; expected a script of 'run' commands"
                )


def check_paths(script: ScriptText) -> None:
    """
    Raise InputError where a script reaches out of its folder, a copy of which it runs in.

    Paths through ``..`` would not be found there, and files named from the root would be
    overwritten by every run.
    """
    for number, line in script.lines:
        words = [word.strip("\"'") for word in line.split()]
        for word in words[1:]:
            if word.startswith("../") or "/../" in word or word.endswith("/.."):
                raise InputError(
                    f"line {number} of {script.path.name} names {word!r}, and runs take place in a "
                    "copy of the script's folder; expected paths inside it, or from the root"
                )
            if re.match(r"/\w|~/|\$\{?HOME\b", word) and words[0] not in _READERS:
                raise InputError(
                    f"line {number} of {script.path.name} names {word!r} in '{words[0]}', so that "
                    "each run would write there; expected a path inside the script's folder"
                )
