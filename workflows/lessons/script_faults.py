"""Faults in the five parts of a student's script of the chain, found by reading it."""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from chaincor.lammps_inputs.commands import commands_of
from chaincor.lammps_inputs.given_numbers import number_in

_VARIABLE = re.compile(r"\$\{(\w+)\}|\$(\w)")
# Styles whose atoms have no bonds.
_WITHOUT_BONDS = ("atomic", "charge", "sphere", "ellipsoid")
# Fixes that move atoms and hold a temperature or a pressure.
_THERMOSTATS = ("nvt", "npt", "langevin", "nph")

Command = list[str]


@dataclass(frozen=True)
class StudentScript:
    """Commands of a script, with the values of its variables."""

    commands: list[Command]  #: Words of each command, in order.

    @classmethod
    def of(cls, text: str) -> "StudentScript":
        """Read a script, and replace each variable that has one value by its value."""
        values: dict[str, str] = {}
        commands = []
        for line in commands_of(text):
            words = _VARIABLE.sub(lambda m: values.get(m[1] or m[2], m[0]), line).split()
            if words[0] == "variable" and words[2:3] in (["index"], ["string"], ["equal"]):
                values[words[1]] = " ".join(words[3:4])
            commands.append(words)
        return cls(commands)

    def named(self, name: str) -> list[Command]:
        """Return all commands with a name."""
        return [command for command in self.commands if command[0] == name]

    def last(self, name: str) -> Command | None:
        """Return the last command with a name, which overrides earlier commands."""
        found = self.named(name)
        return found[-1] if found else None

    def fixes(self, style: str) -> list[Command]:
        """Return the fixes whose style begins with `style`."""
        return [c for c in self.named("fix") if len(c) > 3 and c[3].startswith(style)]

    def place(self, name: str) -> int:
        """Return the place of the first command with a name; beyond all others if it is missing."""
        return next((k for k, c in enumerate(self.commands) if c[0] == name), len(self.commands))


def _units_and_box(script: StudentScript) -> Iterator[str]:
    units, boundary = script.last("units"), script.last("boundary")
    if units is None:
        yield "no `units`: the numbers of the chain have none, so write `units lj`"
    elif units[1:2] != ["lj"]:
        yield f"`units {' '.join(units[1:])}`: numbers without units are `units lj`"
    if boundary is None:
        yield (
            "no `boundary`: LAMMPS takes a periodic box, where a chain that leaves on one side "
            "comes back on the other; write `boundary f f f`"
        )
    elif boundary[1:2] == ["p"]:
        yield "the box is periodic in x: write `boundary f f f`"
    for name in ("units", "boundary"):
        if script.place("read_data") < script.place(name) < len(script.commands):
            yield f"`{name}` must stand before `read_data`, which makes the box"


def _atoms_and_bonds(script: StudentScript) -> Iterator[str]:
    style = script.last("atom_style")
    if style is None:
        yield "no `atom_style`: atoms have no bonds then; write `atom_style bond`"
    elif style[1:2] and style[1] in _WITHOUT_BONDS:
        yield f"`atom_style {style[1]}` has no bonds: write `atom_style bond`"
    elif script.place("read_data") < script.place("atom_style"):
        yield "`atom_style` must stand before `read_data`, which makes the atoms"
    if script.last("read_data") is None and script.last("create_atoms") is None:
        yield "no atoms: read them by `read_data chain.data`"


def _springs(script: StudentScript) -> Iterator[str]:
    style, spring = script.last("bond_style"), script.last("bond_coeff")
    if style is None:
        yield "no `bond_style`: the bonds have no force; write `bond_style harmonic`"
        return
    if style[1:2] != ["harmonic"]:
        yield f"`bond_style {' '.join(style[1:])}`: springs are `bond_style harmonic`"
        return
    if spring is None:
        yield "no `bond_coeff`: give the bonds their stiffness and length, `bond_coeff 1 K r0`"
        return
    numbers = [number_in(word) for word in spring[2:4]]
    if len(numbers) < 2 or None in numbers:
        yield f"`{' '.join(spring)}`: give a type and two numbers, `bond_coeff 1 K r0`"
        return
    k, length = (float(word) for word in spring[2:4])
    if k == 1.0:
        yield (
            "K is 1.0: LAMMPS's energy of a bond is K (r - r0)^2, without a factor 1/2, so a "
            "stiffness of 1 is K = 0.5"
        )
    elif k != 0.5:
        yield f"K is {k:g}: a stiffness of 1 is K = 0.5, half of it"
    if length != 1.0:
        yield f"r0 is {length:g}: the bonds are 1 long at rest"


def _motion_and_wall(script: StudentScript) -> Iterator[str]:
    movers, walls = script.fixes("nve"), script.fixes("wall/")
    for fix in (f for style in _THERMOSTATS for f in script.fixes(style)):
        yield f"`fix {fix[1]} {fix[2]} {fix[3]}` exchanges energy with a bath: take `nve`"
    if not movers and not any(script.fixes(style) for style in _THERMOSTATS):
        yield "no integrator: `run` computes forces, and only `fix ID all nve` moves the atoms"
    elif len(movers) > 1:
        yield "two integrators: each would move the atoms, so keep one `fix ID all nve`"
    elif movers and movers[0][2] != "all":
        yield f"the integrator moves the group {movers[0][2]} alone: write `all`"
    if not walls:
        yield "no wall: add `fix ID all wall/reflect xlo 0.0`"
    for wall in walls:
        yield from _wall(wall)
    for name in ("fix", "velocity"):
        late = [k for k, c in enumerate(script.commands) if c[0] == name]
        if late and late[-1] > script.place("run"):
            yield f"`{' '.join(script.commands[late[-1]])}` stands after `run`: too late"


def _wall(wall: Command) -> Iterator[str]:
    if wall[3] != "wall/reflect":
        yield f"`{wall[3]}` is a soft wall: the hard wall is `wall/reflect`"
        return
    faces = dict(zip(wall[4::2], wall[5::2], strict=False))
    if "xlo" not in faces:
        yield (
            f"the wall is on the wrong side ({', '.join(faces) or 'no face'}): the chain comes "
            "from x > 0, so the wall closes the low side of x, `xlo 0.0`"
        )
    elif number_in(faces["xlo"]) != 0.0:
        yield f"the wall stands at x = {faces['xlo']}: particle 1 begins at the wall, x = 0"
    if wall[2] != "all":
        yield f"the wall acts on the group {wall[2]} alone: write `all`"


def _output_and_run(script: StudentScript) -> Iterator[str]:
    if script.last("thermo") is None:
        yield "no `thermo`: without it the energy is printed at the first and last step alone"
    if script.last("run") is None:
        yield "no `run`: LAMMPS reads the script and takes no step"
    if not any("restitution" in word for c in script.named("print") for word in c):
        yield (
            'nothing prints the result: after `run`, `print "restitution = $(v_restitution)"` with '
            "`variable restitution equal (vcm(all,x)/0.1)^2`"
        )


#: Name of each part of a script, and the function that yields its faults.
PARTS: dict[str, Callable[[StudentScript], Iterator[str]]] = {
    "1. units and box": _units_and_box,
    "2. atoms and bonds": _atoms_and_bonds,
    "3. springs": _springs,
    "4. motion and wall": _motion_and_wall,
    "5. output and run": _output_and_run,
}
#: First commands of each part. A part without such a command is still empty.
BEGUN = {
    "1. units and box": ("units", "boundary"),
    "2. atoms and bonds": ("atom_style", "read_data", "create_atoms"),
    "3. springs": ("bond_style", "bond_coeff"),
    "4. motion and wall": ("velocity", "fix"),
    "5. output and run": ("timestep", "thermo", "thermo_style", "run", "print"),
}
