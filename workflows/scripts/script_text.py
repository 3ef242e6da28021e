"""Read a user's script and its included files, and check that it can run in a copied folder."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from chaincor.lammps_inputs.commands import join_lines
from chaincor.lammps_inputs.errors import InputError

# Variables of these styles are counters, which cannot be given a value.
_COUNTS = ("loop", "world", "universe", "uloop")
# These commands execute many runs or process dumps again.
_OTHER_RUNS = (
    *("rerun", "temper", "temper/grem", "temper/npt", "neb", "neb/spin"),
    *("prd", "tad", "hyper"),
)
# A command can also stand in the quotes of an `if`.
_INCLUDED = re.compile(r"""(?:^|["'])\s*(?:include|jump)\s+["']?(?!SELF\b)([^\s"']+)""")
_LARGEST_SCRIPT = 10_000_000
# These commands read the file that they name. Any other command with a path writes a file.
_READERS = (
    *("read_data", "read_restart", "read_dump", "include", "jump", "rerun", "molecule"),
    *("pair_coeff", "bond_coeff", "angle_coeff", "dihedral_coeff", "improper_coeff", "plugin"),
    *("pair_style", "bond_style", "kim", "variable", "lattice", "region", "group", "if"),
)


class Command(NamedTuple):
    """Command of a script, with continued lines joined and without its comment."""

    path: Path  #: File that contains the command.
    number: int  #: Line number of its first line.
    text: str

    @property
    def words(self) -> list[str]:
        """Words of the command, starting with its name."""
        return self.text.split()

    def __str__(self) -> str:
        return f"line {self.number} of {self.path.name}"


@dataclass(frozen=True)
class ScriptText:
    """Text of a script and of all files that it includes or jumps into."""

    path: Path
    commands: tuple[Command, ...]
    #: Whether all included files were found. A file cannot be found if the script computes its
    #: name.
    whole: bool

    @classmethod
    def read(cls, path: Path) -> "ScriptText":
        """Read a script; raise InputError if it cannot be read."""
        commands, files, whole = _commands_of(path), {path.resolve()}, True
        for command in commands:
            for name in _INCLUDED.findall(command.text):
                more = path.parent / name
                if not more.is_file():
                    whole = False
                elif more.resolve() not in files:
                    files.add(more.resolve())
                    commands += _commands_of(more)
        return cls(path, tuple(commands), whole)

    def mentions(self, name: str, *, of: str = "") -> bool:
        """Return whether any command, or any command named `of`, uses the value of a variable."""
        short = rf"|\${re.escape(name)}" if len(name) == 1 else ""
        used = re.compile(rf"\$\{{{re.escape(name)}\}}|\bv_{re.escape(name)}\b{short}")
        return any(used.search(c.text) for c in self.commands if of in ("", c.words[0]))

    def of_variable(self, name: str) -> list[Command]:
        """Return the commands that define or delete a variable."""
        return [c for c in self.commands if c.words[:2] == ["variable", name] and c.words[2:]]

    def check_variable(self, name: str) -> None:
        """
        Raise InputError if the script does not use a variable, or if the variable is a counter.

        Commands that set a variable of another style are no fault, because each run replaces them.
        """
        for command in self.of_variable(name):
            if command.words[2] in _COUNTS:
                raise InputError(
                    f"{command} is '{' '.join(command.words)}', which is a counter and "
                    f"cannot be given a value. Write 'variable {name} index VALUE'"
                )
        if self.whole and not self.mentions(name):
            raise InputError(
                f"{self.path.name} does not use the variable {name!r}. Write ${{{name}}} or "
                f"v_{name} in it"
            )

    def check(self) -> None:
        """
        Raise InputError if a script cannot be studied in a copy of its folder.

        A path with ``..`` would lead elsewhere from the copy, and a command that writes to an
        absolute path would overwrite the same file in every run. If a command other than ``run``
        runs steps, its simulated time cannot be kept.
        """
        for command in self.commands:
            words = [word.strip("\"'") for word in command.words]
            for word in words[1:]:
                if word.startswith("../") or "/../" in word or word.endswith("/.."):
                    raise InputError(
                        f"{command} names {word!r}, but each run works in a copy of the script's "
                        "folder that lacks this file. Use a path inside the folder, or an "
                        "absolute path"
                    )
                if re.match(r"/\w|~/|\$\{?HOME\b", word) and words[0] not in _READERS:
                    raise InputError(
                        f"{command} writes to {word!r}, so all runs would overwrite the same "
                        "file. Use a path inside the script's folder"
                    )
            if words[0] in _OTHER_RUNS:
                raise InputError(
                    f"{command} is '{words[0]}', whose end depends on the timestep. "
                    "Use 'run' commands"
                )


def _commands_of(path: Path) -> list[Command]:
    """Read the commands of one file; raise InputError if the file cannot be read."""
    try:
        if not path.is_file():
            raise InputError(
                f"the script {str(path)!r} does not exist. Give the file of a LAMMPS script"
            )
        if path.stat().st_size > _LARGEST_SCRIPT:
            raise InputError(
                f"the script {str(path)!r} is larger than 10 MB. Give a LAMMPS input script"
            )
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(
            f"cannot read the script {str(path)!r} ({error.strerror}). Give a readable file"
        ) from None
    found: list[Command] = []
    number = 1
    for raw, command in join_lines(text):
        if command.split():
            found.append(Command(path, number, command))
        number += raw.count("\n") + 1
    return found
