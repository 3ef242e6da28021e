"""What the text of a script says beforehand: variables it cannot take, files it would overwrite."""

import re
from dataclasses import dataclass
from pathlib import Path

from chaincor.lammps_inputs.errors import InputError

# Styles of `variable` that keep a value given by -var; all others are errors of LAMMPS or replace
# it.
_KEEPS = ("index", "loop", "world", "universe", "uloop")
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
    """
    A script, read but not run.

    Attributes
    ----------
    path : pathlib.Path
        Where it lies.
    lines : tuple of (int, str)
        Its commands with the number of their first line, continued lines joined and comments gone.
    """

    path: Path
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
            raise InputError(f"--script is {str(path)!r}; expected a file: there is none")
        if path.stat().st_size > _LARGEST_SCRIPT:
            raise InputError(
                f"--script {str(path)!r} is larger than 10 MB; expected LAMMPS's input"
            )
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"cannot read the script {str(path)!r}: {error.strerror}") from None
    lines: list[tuple[int, str]] = []
    open_line = ""
    first = 1
    for number, raw in enumerate(text.splitlines(), start=1):
        line = _COMMENT.sub(r"\1", raw)
        first = number if not open_line else first
        open_line += line.rstrip()
        if open_line.endswith("&"):
            open_line = open_line[:-1] + " "
            continue
        if open_line.split():
            lines.append((first, open_line))
        open_line = ""
    return ScriptText(path, tuple(lines))


def check_variable(script: ScriptText, name: str) -> None:
    """
    Raise InputError where a script gives a variable a value of its own that -var cannot change.

    LAMMPS keeps a value from the command line against `variable NAME index`, and refuses or
    overwrites it with any other style.
    """
    own = re.compile(rf"\s*variable\s+{re.escape(name)}\s+(\S+)(.*)")
    for number, line in script.lines:
        match = own.match(line)
        if match and match[1] not in _KEEPS:
            rest = " ".join(match[2].split())
            raise InputError(
                f"line {number} of {script.path.name} says 'variable {name} {match[1]} {rest}', "
                f"which -var {name} cannot change; expected 'variable {name} index VALUE'"
            )
    if script.is_whole and not script.mentions(name):
        raise InputError(
            f"{script.path.name} does not use the variable {name!r}; expected ${{{name}}} or "
            f"v_{name} in it, after 'variable {name} index VALUE'"
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
            if re.match(r"/\w", word) and words[0] not in _READERS:
                raise InputError(
                    f"line {number} of {script.path.name} names {word!r} in '{words[0]}', so that "
                    "each run would write there; expected a path inside the script's folder"
                )
