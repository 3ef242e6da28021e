"""Read a student's script: its commands, the values of its variables and its data file."""

import difflib
import re
from dataclasses import dataclass
from pathlib import Path

from chaincor.lammps_inputs.commands import commands_of
from chaincor.lammps_inputs.given_numbers import number_in

_VARIABLE = re.compile(r"\$\{(\w+)\}|\$(\w)")
# A word counts as a misspelt command if its similarity to a command is at least this, on a scale
# from 0 to 1.
_SIMILAR = 0.8
# First commands that a student writes in each part. If a part has none of them, it is still empty.
COMMANDS_OF_PARTS = {
    "1. units and box": ("units", "boundary"),
    "2. atoms and bonds": ("atom_style", "read_data", "create_atoms"),
    "3. springs": ("bond_style", "bond_coeff"),
    "4. motion and wall": ("velocity", "fix"),
    "5. output and run": ("timestep", "thermo", "thermo_style", "run", "print"),
}

StudentCommand = list[str]


@dataclass(frozen=True)
class StudentScript:
    """Commands of a script, with the values of its variables."""

    commands: list[StudentCommand]  #: Words of each command, in the order of the script.
    folder: Path  #: Folder in which LAMMPS runs the script.

    @classmethod
    def of(cls, text: str, folder: Path) -> "StudentScript":
        """
        Read a script, and replace each variable by its value if it has a single value.

        Formulas are not replaced, because only LAMMPS can evaluate them.
        """
        values: dict[str, str] = {}
        commands = []
        for line in commands_of(text):
            words = _VARIABLE.sub(lambda m: values.get(m[1] or m[2], m[0]), line).split()
            named = words[0] == "variable" and words[2:3] in (["index"], ["string"])
            formula = " ".join(words[3:])
            if named or (words[2:3] == ["equal"] and number_in(formula) is not None):
                values[words[1]] = " ".join(words[3:4])
            commands.append(words)
        return cls(commands, folder)

    def named(self, name: str) -> list[StudentCommand]:
        """Return all commands with this name."""
        return [command for command in self.commands if command[0] == name]

    def last(self, name: str) -> StudentCommand | None:
        """Return the last command with this name, which overrides earlier ones."""
        found = self.named(name)
        return found[-1] if found else None

    def fixes(self, style: str) -> list[StudentCommand]:
        """Return the fixes whose style begins with `style`."""
        return [c for c in self.named("fix") if len(c) > 3 and c[3].startswith(style)]

    def fixes_without_group(self, style: str) -> list[StudentCommand]:
        """Return the fixes of a style that lack a name or a group, such as `fix all nve`."""
        return [
            c
            for c in self.named("fix")
            if any(word.startswith(style) for word in (c[1:3] if len(c) < 4 else c[2:3]))
        ]

    def has_group(self, name: str) -> bool:
        """Return whether a group of atoms has this name."""
        return name == "all" or any(c[1:2] == [name] for c in self.named("group"))

    def place(self, name: str) -> int:
        """Return the position of the first command with a name; the end if there is none."""
        return next((k for k, c in enumerate(self.commands) if c[0] == name), len(self.commands))

    def last_place(self, name: str) -> int:
        """Return the position of the last command with a name; -1 if there is none."""
        return max((k for k, c in enumerate(self.commands) if c[0] == name), default=-1)

    def data_file(self) -> str:
        """Return the data file that the script reads, or the most likely one in its folder."""
        command = self.last("read_data") or []
        named = "".join(command[1:2]).strip("\"'")
        if named and (self.folder / named).is_file():
            return named
        files = [path.name for path in self.folder.glob("*.data")]
        near = difflib.get_close_matches(named, files, 1, _SIMILAR)
        return (near or (files if len(files) == 1 else ["chain.data"]))[0]

    def misspelt(self, name: str) -> str | None:
        """Return a misspelt form of a missing command, such as `boundry`, or None."""
        known = {command for commands in COMMANDS_OF_PARTS.values() for command in commands}
        names = {c[0].lower().partition("=")[0]: c[0] for c in self.commands if c[0] not in known}
        near = difflib.get_close_matches(name, names, 1, _SIMILAR)
        return names[near[0]] if near and not self.named(name) else None

    def missing(self, name: str, advice: str) -> str:
        """Describe a missing command by its misspelt form, or otherwise give advice."""
        misspelt = self.misspelt(name)
        if misspelt:
            return f"`{misspelt}` is no command of LAMMPS: write `{name}`"
        return f"no `{name}`: {advice}"


def is_formula(word: str) -> bool:
    """Return whether only LAMMPS can evaluate a word."""
    return "$" in word or word.startswith("v_")
