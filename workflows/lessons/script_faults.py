"""Find faults in the five parts of a student's script for the chain, without running it."""

import difflib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from chaincor.lammps_inputs.commands import commands_of
from chaincor.lammps_inputs.given_numbers import number_in

_VARIABLE = re.compile(r"\$\{(\w+)\}|\$(\w)")
# Kinds of the box's two faces in one direction, with one letter for both faces or one for each.
_FACES = re.compile("[pfsm]{1,2}")
_SIDES = ("xlo", "xhi", "ylo", "yhi", "zlo", "zhi")
# Atoms of these styles have no bonds.
_WITHOUT_BONDS = ("atomic", "charge", "sphere", "ellipsoid")
# These fixes move atoms and also control temperature or pressure.
_THERMOSTATS = ("nvt", "npt", "langevin", "nph")
# These walls push with a force that acts at a distance.
_SOFT_WALLS = ("harmonic", "lj93", "lj126", "lj1043", "colloid", "morse", "table", "region")
# A misspelt command must be at least this similar to the right command, on a scale from 0 to 1.
_SIMILAR = 0.8

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
            if named or (words[2:3] == ["equal"] and number_in(words[-1]) is not None):
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

    def misspelt(self, name: str) -> str | None:
        """Return a misspelt form of a missing command, such as `boundry`, or None."""
        known = {command for commands in _BEGUN.values() for command in commands}
        names = {c[0].lower(): c[0] for c in self.commands if c[0] not in known}
        near = difflib.get_close_matches(name, names, 1, _SIMILAR)
        return names[near[0]] if near and not self.named(name) else None

    def missing(self, name: str, advice: str) -> str:
        """Describe a missing command by its misspelt form, or otherwise give advice."""
        misspelt = self.misspelt(name)
        if misspelt:
            return f"`{misspelt}` is no command of LAMMPS: write `{name}`"
        return f"no `{name}`: {advice}"


def _is_formula(word: str) -> bool:
    """Return whether only LAMMPS can evaluate a word."""
    return "$" in word or word.startswith("v_")


def _units_and_box(script: StudentScript) -> Iterator[str]:
    units, boundary = script.last("units"), script.last("boundary")
    if units is None:
        yield script.missing("units", "the numbers of the chain have none, so write `units lj`")
    elif units[1:2] != ["lj"]:
        yield f"`units {' '.join(units[1:])}`: numbers without units are `units lj`"
    if boundary is None:
        yield script.missing(
            "boundary",
            "LAMMPS takes a periodic box, where a chain that leaves on one side comes back on the "
            "other; write `boundary f f f`",
        )
    elif len(boundary) != 4 or not all(map(_FACES.fullmatch, boundary[1:])):
        yield f"`{' '.join(boundary)}`: give a letter for x, y and z each, as `boundary f f f`"
    elif boundary[1] == "p":
        yield "the box is periodic in x: write `f` for x, as `boundary f f f`"
    for name in ("units", "boundary"):
        if script.place("read_data") < script.place(name) < len(script.commands):
            yield f"`{name}` must stand before `read_data`, which makes the box"


def _atoms_and_bonds(script: StudentScript) -> Iterator[str]:
    style = script.last("atom_style")
    if style is None:
        yield script.missing("atom_style", "atoms have no bonds then; write `atom_style bond`")
    elif style[1:2] and style[1] in _WITHOUT_BONDS:
        yield f"`atom_style {style[1]}` has no bonds: write `atom_style bond`"
    elif script.place("read_data") < script.place("atom_style"):
        yield "`atom_style` must stand before `read_data`, which makes the atoms"
    if script.last("read_data") is None and script.last("create_atoms") is None:
        yield script.missing("read_data", "there are no atoms; write `read_data chain.data`")
    for name in (command[1] for command in script.named("read_data") if len(command) > 1):
        if not _is_formula(name) and not (script.folder / name.strip("\"'")).is_file():
            yield (
                f"there is no file `{name}` in {script.folder.resolve().name}, the folder of the "
                "script; write `read_data chain.data`"
            )


def _springs(script: StudentScript) -> Iterator[str]:
    style, spring = script.last("bond_style"), script.last("bond_coeff")
    if style is None:
        yield script.missing("bond_style", "bonds have no force; write `bond_style harmonic`")
        return
    if style[1:2] == ["hybrid"]:
        return
    if style[1:2] != ["harmonic"]:
        yield f"`bond_style {' '.join(style[1:])}`: springs are `bond_style harmonic`"
        return
    if spring is None:
        yield script.missing(
            "bond_coeff", "give the bonds their stiffness and length, `bond_coeff 1 K r0`"
        )
        return
    if any(map(_is_formula, spring)):
        return
    if script.place("bond_coeff") < script.place("bond_style"):
        yield "`bond_style` must stand before `bond_coeff`, whose numbers depend on the style"
    numbers = [number_in(word) for word in spring[2:]]
    if len(numbers) != 2 or None in numbers:
        yield f"`{' '.join(spring)}`: give a type and two numbers, `bond_coeff 1 K r0`"
        return
    k, length = (float(word) for word in spring[2:4])
    if (k, length) == (1.0, 0.5):
        yield "K and r0 are exchanged: write `bond_coeff 1 0.5 1`, K before r0"
        return
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
    for fix in (f for style in _THERMOSTATS for f in script.fixes(style)):
        yield f"`fix {fix[1]} {fix[2]} {fix[3]}` exchanges energy with a bath: take `nve`"
    yield from _motion(script)
    removed = {command[1] for command in script.named("unfix") if len(command) > 1}
    names = [c[1] for c in script.named("fix") if len(c) > 3 and c[1] not in removed]
    for name in sorted({name for name in names if names.count(name) > 1}):
        yield f"two fixes have the name {name}: give each its own"
    walls, unnamed = script.fixes("wall/"), script.fixes_without_group("wall/")
    for wall in unnamed:
        right = "`fix NAME all wall/reflect xlo 0.0`"
        yield f"`{' '.join(wall)}` lacks its name or its group: write {right}"
    if not walls and not unnamed:
        yield "no wall: add `fix NAME all wall/reflect xlo 0.0`"
    # There may be a second wall behind the chain, so the wall at xlo is checked.
    for wall in [wall for wall in walls if "xlo" in wall] or walls:
        yield from _wall(script, wall)
    after_run = script.commands[script.last_place("run") + 1 :] if script.named("run") else []
    for late in after_run:
        if late[0] in ("fix", "velocity"):
            yield f"`{' '.join(late)}` stands after `run`: too late"


def _motion(script: StudentScript) -> Iterator[str]:
    movers, unnamed = script.fixes("nve"), script.fixes_without_group("nve")
    for fix in unnamed:
        yield f"`{' '.join(fix)}` lacks its name or its group: write `fix NAME all nve`"
    baths = any(script.fixes(style) for style in _THERMOSTATS)
    if not movers and not unnamed and not baths:
        yield "no integrator: `run` computes forces, and only `fix NAME all nve` moves the atoms"
    elif len(movers) > 1:
        yield "two integrators: each would move the atoms, so keep one `fix NAME all nve`"
    elif movers and not script.has_group(movers[0][2]):
        yield f"there is no group {movers[0][2]}: write `all`"


def _wall(script: StudentScript, wall: StudentCommand) -> Iterator[str]:
    if wall[3] != "wall/reflect":
        soft = wall[3].removeprefix("wall/") in _SOFT_WALLS
        kind = "is a soft wall" if soft else "is another fix"
        yield f"`{wall[3]}` {kind}: the hard wall is `wall/reflect`"
        return
    faces = dict(zip(wall[4::2], wall[5::2], strict=False))
    place = number_in(faces.get("xlo", "0"))
    unknown = [face for face in faces if face not in (*_SIDES, "units")]
    if not faces:
        yield f"`{' '.join(wall)}` names no face and place: write `xlo 0.0`"
    elif unknown:
        yield f"`{unknown[0]}` is no face of the box: write `xlo 0.0`"
    elif "xlo" not in faces:
        yield (
            f"the wall is on the wrong side ({', '.join(faces)}): the chain comes from x > 0, so "
            "the wall closes the low side of x, `xlo 0.0`"
        )
    elif place != 0.0 and not _is_formula(faces["xlo"]):
        place_given = f"the wall stands at x = {faces['xlo']}"
        yield f"{place_given}: particle 1 begins at the wall, so write `xlo 0.0`"
    if not script.has_group(wall[2]):
        yield f"there is no group {wall[2]}: write `all`"


def _output_and_run(script: StudentScript) -> Iterator[str]:
    if script.last("timestep") is None:
        yield script.missing("timestep", "LAMMPS takes steps of 0.005; write `timestep 0.01`")
    elif script.last_place("timestep") < script.place("units") < len(script.commands):
        yield "`timestep` must stand after `units`, which sets the step to its default"
    if script.last("thermo") is None:
        yield script.missing("thermo", "the energy is then printed at the first and last step only")
    if script.last("run") is None:
        yield script.missing("run", "LAMMPS reads the script and takes no step")
    for name in ("timestep", "thermo") if script.named("run") else ():
        if script.last_place("run") < script.place(name) < len(script.commands):
            yield f"`{name}` must stand before `run`"
    prints = [k for k, c in enumerate(script.commands) if _prints_restitution(c)]
    if prints and prints[-1] < script.last_place("run"):
        yield "`print` stands before `run`: it prints the restitution before the collision"
    if not prints:
        yield (
            'nothing prints the result: after `run`, `print "restitution = $(v_restitution)"` with '
            "`variable restitution equal (vcm(all,x)/0.1)^2`"
        )


def _prints_restitution(command: StudentCommand) -> bool:
    return command[0] == "print" and any("restitution" in word for word in command)


#: Name of each part of a script, and the function that yields the faults in this part.
_PARTS: dict[str, Callable[[StudentScript], Iterator[str]]] = {
    "1. units and box": _units_and_box,
    "2. atoms and bonds": _atoms_and_bonds,
    "3. springs": _springs,
    "4. motion and wall": _motion_and_wall,
    "5. output and run": _output_and_run,
}
# Commands of each part that a student writes first. A part without any of them is still empty.
_BEGUN = {
    "1. units and box": ("units", "boundary"),
    "2. atoms and bonds": ("atom_style", "read_data", "create_atoms"),
    "3. springs": ("bond_style", "bond_coeff"),
    "4. motion and wall": ("velocity", "fix"),
    "5. output and run": ("timestep", "thermo", "thermo_style", "run", "print"),
}
# In the lesson, these words stand for values that a script must have.
_PLACEHOLDERS = {
    "FILE": "the name of the data file",
    "K": "half the stiffness of a bond",
    "R0": "the length of a bond at rest",
    "FACE": "the side of the box that the wall closes",
    "PLACE": "the wall's x",
    "N": "the number of steps",
}


def faults_by_part(script: StudentScript) -> dict[str, tuple[str, ...]]:
    """Return the faults in each part of a script, in order."""
    return {part: _faults_of_part(script, part) for part in _PARTS}


def _faults_of_part(script: StudentScript, part: str) -> tuple[str, ...]:
    begun = _BEGUN[part]
    if not any(script.named(name) or script.misspelt(name) for name in begun):
        return ("nothing yet",)
    unreplaced = tuple(
        f"`{' '.join(command)}`: write {_PLACEHOLDERS[word]} in place of {word}"
        for command in script.commands
        if command[0] in begun
        for word in command[1:]
        if word in _PLACEHOLDERS and not (command[0] == "fix" and word == command[1])
    )
    return unreplaced or tuple(_PARTS[part](script))
