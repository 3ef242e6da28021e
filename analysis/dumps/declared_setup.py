"""What the script of a run, or its log, says of units, springs and walls."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from chaincor.analysis.dumps.run_commands import RunCommands
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem

_COMMANDS = ("units", "bond_style", "bond_coeff", "pair_style", "lattice", "fix")


@dataclass(frozen=True)
class DeclaredSetup:
    """What can be told of a run by its commands."""

    style: str = "lj"  #: Of the units.
    #: K and r0 of ``bond_style harmonic``, the only force; None for others.
    spring: tuple[float, float] | None = None
    #: Place of each face (``xlo``, ``xhi``) of ``fix wall/reflect``, as it is written.
    walls: dict[str, str] = field(default_factory=dict)

    def units(self, mass: float | None) -> UnitSystem:
        """Return the chain's units in those of the run, by its springs and a particle's mass."""
        mass = 1.0 if self.style == "lj" else mass
        if self.spring is None or mass is None:
            return CHAIN_UNITS
        fields = {"length": self.spring[1], "mass": mass, "stiffness": 2.0 * self.spring[0]}
        try:
            return UnitSystem.from_fields(fields | {"style": self.style})
        except SceneError:
            return CHAIN_UNITS


def declared_setup(commands: RunCommands) -> DeclaredSetup:
    """Gather what a run declares; nothing is taken that several files say differently."""
    found, _ = commands.named(*_COMMANDS)
    setups = [_setup_of([c.words for c in each if not c.computed]) for each in found.values()]
    return setups[0] if setups and all(each == setups[0] for each in setups) else DeclaredSetup()


def _setup_of(commands: Sequence[list[str]]) -> DeclaredSetup:
    last = {words[0]: words[1:] for words in commands}
    walls: dict[str, str] = {}
    for words in commands:
        if words[0] == "fix" and words[3:4] == ["wall/reflect"]:
            walls |= dict(pairwise(words[4:]))
    walls = {face: place for face, place in walls.items() if face in ("xlo", "xhi")}
    springs = {tuple(words[2:4]) for words in commands if words[0] == "bond_coeff"}
    spring = None
    if last.get("bond_style") == ["harmonic"] and len(springs) == 1 and _alone(last):
        try:
            stiffness, length = map(float, springs.pop())
            spring = stiffness, length
        except ValueError:
            spring = None
    style = last.get("units", ["lj"])
    # With a lattice, places may be in units of it.
    return DeclaredSetup(style[0] if style else "lj", spring, {} if "lattice" in last else walls)


def _alone(last: dict[str, list[str]]) -> bool:
    return last.get("pair_style", ["none"])[0] in ("none", "zero")
