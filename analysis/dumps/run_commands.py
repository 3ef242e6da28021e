"""The commands of a run, as its logs echo them and its scripts hold them, each file read once."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

# What anything is told by; logs have many other lines.
_TOLD = (
    *("units", "lattice", "atom_style", "pair_style", "bond_style", "bond_coeff"),
    *("read_data", "mass", "set", "fix", "timestep"),
)


class Command(NamedTuple):
    """A command."""

    words: list[str]  #: Without a comment; the first is its name.
    line: str  #: As it stands in the file.

    @property
    def computed(self) -> bool:
        """Whether a variable stands in it."""
        return any("$" in word for word in self.words)


@dataclass(frozen=True)
class RunCommands:
    """The commands of one run."""

    #: By file, in order. Logs repeat a command with what its variables stand for.
    logs: dict[Path, list[Command]] = field(default_factory=dict)
    scripts: dict[Path, list[Command]] = field(default_factory=dict)  #: See ``logs``.

    @classmethod
    def read(cls, logs: Iterable[Path] = (), scripts: Iterable[Path] = ()) -> "RunCommands":
        """Read the files of a run."""
        return cls(*({path: _commands(path) for path in paths} for paths in (logs, scripts)))

    def named(self, *names: str) -> tuple[dict[Path, list[Command]], bool]:
        """
        Return the commands of some names by file, and whether variables stand for their values.

        They are those of the logs that have any, and where none has, of all scripts. What a run
        prints on the screen begins like a log and repeats no commands.
        """
        of_logs, of_scripts = (
            {path: [c for c in commands if c.words[0] in names] for path, commands in each.items()}
            for each in (self.logs, self.scripts)
        )
        echoed = {path: commands for path, commands in of_logs.items() if commands}
        return (echoed, True) if echoed else (of_scripts, False)

    @property
    def stock_wall(self) -> bool:
        """Whether the run had the stock wall, ``fix wall/reflect``."""
        return any(
            command.words[0] == "fix" and "wall/reflect" in command.words
            for commands in self.files.values()
            for command in commands
        )

    @property
    def files(self) -> dict[Path, list[Command]]:
        """All commands by file, scripts first."""
        return self.scripts | self.logs

    def timesteps(self) -> tuple[Sequence[str], bool]:
        """Return what follows ``timestep``, and whether variables stand for their values."""
        found, expanded = self.named("timestep")
        words = [c.words[1] for commands in found.values() for c in commands if len(c.words) > 1]
        return words, expanded


NO_COMMANDS = RunCommands()


def _commands(path: Path) -> list[Command]:
    found = []
    for line in path.read_text(errors="replace").splitlines():
        words = line.split("#")[0].split()
        if words and words[0] in _TOLD:
            found.append(Command(words, line))
    return found
