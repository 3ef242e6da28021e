"""Commands, units, springs, walls and time steps of a run, from its scripts and logs."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from chaincor.lammps_inputs.commands import commands_of
from chaincor.lammps_inputs.errors import InputError, SceneError
from chaincor.lammps_inputs.small_file import refuse_endless, why_unreadable
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem

# Only these commands are kept, because they declare the setup. Logs contain many other lines.
_KEPT = (
    *("units", "lattice", "atom_style", "pair_style", "bond_style", "bond_coeff"),
    *("read_data", "mass", "set", "fix", "timestep"),
)
_SETUP = ("units", "bond_style", "bond_coeff", "pair_style", "lattice", "fix")
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")


# Words of a command, without comments. The first word is the name of the command.
CommandWords = list[str]


def is_computed(command: CommandWords) -> bool:
    """Return whether a command contains a variable."""
    return any("$" in word for word in command)


@dataclass(frozen=True)
class DeclaredSetup:
    """Setup of a run, as its commands declare it."""

    style: str = "lj"  #: Style of the units.
    #: K and r0 if ``bond_style harmonic`` is the only force; otherwise None.
    spring: tuple[float, float] | None = None
    #: Position of each face (``xlo``, ``xhi``) of ``fix wall/reflect``, as written in the script.
    walls: dict[str, str] = field(default_factory=dict)

    def units(self, mass: float | None) -> UnitSystem:
        """Return the chain's units in units of the run, from the springs and a mass."""
        mass = 1.0 if self.style == "lj" else mass
        if self.spring is None or mass is None:
            return CHAIN_UNITS
        fields = {"length": self.spring[1], "mass": mass, "stiffness": 2.0 * self.spring[0]}
        try:
            return UnitSystem.from_fields(fields | {"style": self.style})
        except SceneError:
            return CHAIN_UNITS


@dataclass(frozen=True)
class RunCommands:
    """Commands of one run, from its logs and its scripts."""

    #: Commands of each file, in order. Logs print a command again with the values of variables.
    logs: dict[Path, list[CommandWords]]
    scripts: dict[Path, list[CommandWords]]  #: See ``logs``.

    @classmethod
    def read(cls, logs: Iterable[Path] = (), scripts: Iterable[Path] = ()) -> "RunCommands":
        """Read the files of a run."""
        # In a log LAMMPS has joined continuation lines, and most lines are not commands.
        kept_lines = {
            p: [r for r in _text(p).splitlines() if r.lstrip().startswith(_KEPT)] for p in logs
        }
        return cls(
            {path: _commands(lines) for path, lines in kept_lines.items()},
            {path: _commands([_text(path)]) for path in scripts},
        )

    def named(self, *names: str) -> tuple[dict[Path, list[CommandWords]], bool]:
        """
        Return the commands with given names, by file, and whether they come from logs.

        The commands come from logs if a log has them, else from all scripts. A log contains the
        values of variables. A file of the screen output begins like a log but contains no commands.
        """
        of_logs, of_scripts = (
            {path: [c for c in commands if c[0] in names] for path, commands in each.items()}
            for each in (self.logs, self.scripts)
        )
        echoed = {path: commands for path, commands in of_logs.items() if commands}
        return (echoed, True) if echoed else (of_scripts, False)

    @property
    def files(self) -> dict[Path, list[CommandWords]]:
        """Commands by file, scripts first."""
        return self.scripts | self.logs

    @property
    def stock_wall(self) -> bool:
        """Whether the run had the stock wall, ``fix wall/reflect``."""
        return any(
            command[0] == "fix" and "wall/reflect" in command
            for commands in self.files.values()
            for command in commands
        )

    @property
    def timestep(self) -> float | None:
        """
        Time step of the whole run; None if it is unknown or changes.

        The result is None if there is no ``timestep`` command, if a script computes the time step,
        or if there are several time steps.
        """
        steps = set(self._timesteps())
        return _positive(steps.pop()) if len(steps) == 1 else None

    @property
    def first_timestep(self) -> float | None:
        """
        First time step of a run; None if it is unknown.

        Runs that stop at contacts set other time steps later. The first one is that of the motion.
        """
        return _positive(next(iter(self._timesteps()), None))

    def _timesteps(self) -> list[float | None]:
        """Return the time steps that a run sets, in order; a computed time step is None."""
        found, expanded = self.named("timestep")
        words = [w for commands in found.values() for c in commands for w in c[1:2]]
        kept = [w for w in words if _NUMBER.fullmatch(w) or ("$" in w and not expanded)]
        return [None if "$" in word else float(word) for word in kept]

    @property
    def setup(self) -> DeclaredSetup:
        """Units, springs and walls; default values if the files disagree."""
        found, _ = self.named(*_SETUP)
        setups = [_setup_of([c for c in each if not is_computed(c)]) for each in found.values()]
        alike = setups and all(each == setups[0] for each in setups)
        return setups[0] if alike else DeclaredSetup()


def _text(path: Path) -> str:
    try:
        refuse_endless(path)
        return path.read_text(errors="replace")
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {str(path)!r}: {why_unreadable(error)}") from None


def _commands(parts: Iterable[str]) -> list[CommandWords]:
    """Return the commands in the parts of a file. No command continues in the next part."""
    commands = (words.split() for part in parts for words in commands_of(part))
    return [command for command in commands if command[0] in _KEPT]


def _positive(step: float | None) -> float | None:
    return step if step is not None and step > 0.0 else None


def _setup_of(commands: Sequence[CommandWords]) -> DeclaredSetup:
    last = {words[0]: words[1:] for words in commands}
    walls: dict[str, str] = {}
    for words in commands:
        if words[0] == "fix" and words[3:4] == ["wall/reflect"]:
            walls |= dict(pairwise(words[4:]))
    walls = {face: place for face, place in walls.items() if face in ("xlo", "xhi")}
    springs = {tuple(words[2:4]) for words in commands if words[0] == "bond_coeff"}
    alone = last.get("pair_style", ["none"])[0] in ("none", "zero")
    spring = None
    if last.get("bond_style") == ["harmonic"] and len(springs) == 1 and alone:
        try:
            stiffness, length = map(float, springs.pop())
            spring = stiffness, length
        except ValueError:
            spring = None
    style = last.get("units", ["lj"])
    # With a lattice, positions may be in units of the lattice.
    return DeclaredSetup(style[0] if style else "lj", spring, {} if "lattice" in last else walls)
