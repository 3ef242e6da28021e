"""Find faults in the five parts of a student's script for the chain, without running it."""

import re
from collections.abc import Callable, Iterator

from chaincor.lammps_inputs.given_numbers import number_in
from chaincor.workflows.lessons.student_script import (
    COMMANDS_OF_PARTS,
    StudentCommand,
    StudentScript,
    is_formula,
)

# Boundary style of the box in one direction: one letter for both faces, or one letter for each
# face.
_FACES = re.compile("[pfsm]{1,2}")
_SIDES = ("xlo", "xhi", "ylo", "yhi", "zlo", "zhi")
# Atoms of these styles have no bonds.
_WITHOUT_BONDS = ("atomic", "charge", "sphere", "ellipsoid")
# These fixes move atoms and also control temperature or pressure.
_THERMOSTATS = ("nvt", "npt", "langevin", "nph")
# A comma or semicolon at the end of a word.
_SEPARATED = re.compile("[,;](?= |$)")
_DECIMAL_COMMA = re.compile(r"(?<![\w.,])\d+,\d+(?![\w.,])")
_QUOTED = re.compile("\"[^\"]*\"|'[^']*'")
# These walls push with a force that acts at a distance.
_SOFT_WALLS = ("harmonic", "lj93", "lj126", "lj1043", "colloid", "morse", "table", "region")


def _units_and_box(script: StudentScript) -> Iterator[str]:
    units, boundary = script.last("units"), script.last("boundary")
    if units is None:
        yield script.missing("units", "the chain has no units, so write `units lj`")
    elif units[1:2] != ["lj"]:
        yield f"`units {' '.join(units[1:])}`: the chain has no units, so write `units lj`"
    if boundary is None:
        yield script.missing(
            "boundary",
            "the box is then periodic, and a chain that leaves on one side enters on the other; "
            "write `boundary f f f`",
        )
    elif len(boundary) != 4 or not all(map(_FACES.fullmatch, boundary[1:])):
        given = " ".join(boundary)
        yield f"`{given}`: give one letter each for x, y and z, such as `boundary f f f`"
    elif boundary[1] == "p":
        yield "the box is periodic in x: write `f` for x, such as `boundary f f f`"
    for name in ("units", "boundary"):
        if script.place("read_data") < script.place(name) < len(script.commands):
            yield f"`{name}` must stand before `read_data`, which makes the box"


def _atoms_and_bonds(script: StudentScript) -> Iterator[str]:
    style = script.last("atom_style")
    if style is None:
        yield script.missing("atom_style", "atoms then have no bonds; write `atom_style bond`")
    elif style[1:2] and style[1] in _WITHOUT_BONDS:
        yield f"`atom_style {style[1]}` has no bonds: write `atom_style bond`"
    elif script.place("read_data") < script.place("atom_style"):
        yield "`atom_style` must stand before `read_data`, which makes the atoms"
    if script.last("read_data") is None and script.last("create_atoms") is None:
        yield script.missing("read_data", "there are no atoms; write `read_data chain.data`")
    for name in (command[1] for command in script.named("read_data") if len(command) > 1):
        if not is_formula(name) and not (script.folder / name.strip("\"'")).is_file():
            yield (
                f"there is no file `{name}` in {script.folder.resolve().name}, the folder of the "
                f"script; write `read_data {script.data_file()}`"
            )


def _springs(script: StudentScript) -> Iterator[str]:
    style, spring = script.last("bond_style"), script.last("bond_coeff")
    if style is None:
        yield script.missing("bond_style", "bonds have no force; write `bond_style harmonic`")
        return
    yield from _too_early(script, "bond_style", "atom_style", "which gives the atoms bonds")
    yield from _too_early(script, "bond_coeff", "read_data", "which makes the box")
    if style[1:2] == ["hybrid"]:
        return
    if style[1:2] != ["harmonic"]:
        yield f"`bond_style {' '.join(style[1:])}`: springs need `bond_style harmonic`"
        return
    if spring is None:
        yield script.missing(
            "bond_coeff", "write the stiffness and length of the bonds, `bond_coeff 1 K R0`"
        )
        return
    if any(map(is_formula, spring)):
        return
    if not spring[1].isdecimal() and "*" not in spring[1]:
        yield f"`{' '.join(spring)}`: the first number is the type of the bonds, then come K and R0"
        return
    if script.place("bond_coeff") < script.place("bond_style"):
        yield "`bond_style` must stand before `bond_coeff`, whose numbers depend on the style"
    numbers = [number_in(word) for word in spring[2:]]
    if len(numbers) != 2 or None in numbers:
        fraction = ", and no fraction" if any("/" in word for word in spring) else ""
        yield f"`{' '.join(spring)}`: give a type and two numbers{fraction}, `bond_coeff 1 K R0`"
        return
    k, length = (float(word) for word in spring[2:4])
    if (k, length) == (1.0, 0.5):
        yield "K and R0 are exchanged: write `bond_coeff 1 0.5 1`, K before R0"
        return
    if k == 1.0:
        yield (
            "K is 1.0: LAMMPS's energy of a bond is K (r - R0)^2, without a factor 1/2, so a "
            "stiffness of 1 needs K = 0.5"
        )
    elif k != 0.5:
        yield f"K is {k:g}: a stiffness of 1 needs K = 0.5"
    if length != 1.0:
        yield f"R0 is {length:g}: the bonds at rest have the length 1"


def _motion_and_wall(script: StudentScript) -> Iterator[str]:
    for fix in (f for style in _THERMOSTATS for f in script.fixes(style)):
        yield f"`fix {fix[1]} {fix[2]} {fix[3]}` exchanges energy with a heat bath: write `nve`"
    yield from _too_early(script, "fix", "read_data", "which makes the atoms")
    yield from _too_early(script, "velocity", "read_data", "which makes the atoms")
    yield from _motion(script)
    removed = {command[1] for command in script.named("unfix") if len(command) > 1}
    names = [c[1] for c in script.named("fix") if len(c) > 3 and c[1] not in removed]
    for name in sorted({name for name in names if names.count(name) > 1}):
        yield f"two fixes have the name {name}: give them different names"
    walls, unnamed = script.fixes("wall/"), script.fixes_without_group("wall/")
    for wall in unnamed:
        right = "`fix NAME all wall/reflect xlo 0.0`"
        yield f"`{' '.join(wall)}` lacks its name or its group: write {right}"
    apart = [c for c in script.named("fix") if "reflect" in c]
    if apart and not walls:
        yield f"`{' '.join(apart[0])}`: write `wall/reflect` as one word"
    elif not walls and not unnamed:
        yield "no wall: add `fix NAME all wall/reflect xlo 0.0`"
    # The wall at xlo is checked if there is one, because another wall may lie behind the chain.
    for wall in [wall for wall in walls if "xlo" in wall] or walls:
        yield from _wall(script, wall)
    after_run = script.commands[script.last_place("run") + 1 :] if script.named("run") else []
    for late in after_run:
        if late[0] in ("fix", "velocity"):
            yield f"`{' '.join(late)}` stands after `run`: too late"


def _motion(script: StudentScript) -> Iterator[str]:
    movers, unnamed = script.fixes("nve"), script.fixes_without_group("nve")
    for fix in unnamed:
        if fix[3:4] == ["all"]:
            yield f"`{' '.join(fix)}` names its style before its group: write `fix NAME all nve`"
            continue
        yield f"`{' '.join(fix)}` lacks its name or its group: write `fix NAME all nve`"
    baths = any(script.fixes(style) for style in _THERMOSTATS)
    if not movers and not unnamed and not baths:
        yield "no integrator: only `fix NAME all nve` moves the atoms, `run` alone does not"
    elif len(movers) > 1:
        yield "two integrators: both would move the atoms, so keep one `fix NAME all nve`"
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
            "the wall must close the low side of x: write `xlo 0.0`"
        )
    elif place != 0.0 and not is_formula(faces["xlo"]):
        place_given = f"the wall stands at x = {faces['xlo']}"
        yield f"{place_given}, but particle 1 starts at x = 0: write `xlo 0.0`"
    if not script.has_group(wall[2]):
        yield f"there is no group {wall[2]}: write `all`"


def _output_and_run(script: StudentScript) -> Iterator[str]:
    if script.last("timestep") is None:
        yield script.missing("timestep", "LAMMPS then takes steps of 0.005; write `timestep 0.01`")
    elif script.last_place("timestep") < script.place("units") < len(script.commands):
        yield "`timestep` must stand after `units`, which sets the step to its default"
    if script.last("thermo") is None:
        yield script.missing(
            "thermo",
            "LAMMPS then prints the energy only at the first and the last step; write `thermo 100`",
        )
    if script.last("run") is None:
        yield script.missing("run", "LAMMPS then takes no step; write `run` and a number of steps")
    for name in ("timestep", "thermo") if script.named("run") else ():
        if script.last_place("run") < script.place(name) < len(script.commands):
            yield f"`{name}` must stand before `run`"
    every = script.last("thermo") or []
    if len(every) == 2 and "." in every[1] and not is_formula(every[1]):
        yield f"`thermo {every[1]}`: give a whole number of steps; `timestep` is the time of a step"
    prints = [k for k, c in enumerate(script.commands) if _prints_restitution(c)]
    if prints and prints[-1] < script.last_place("run"):
        yield "`print` stands before `run`, so it prints the restitution before the collision"
    if not prints:
        yield (
            "nothing prints the result: after `run`, write `variable restitution equal "
            '(vcm(all,x)/0.1)^2` and `print "restitution = $(v_restitution)"`'
        )


def _too_early(script: StudentScript, late: str, early: str, reason: str) -> Iterator[str]:
    """Yield a fault if the first command `late` stands before the command `early`."""
    if script.place(late) < script.place(early) < len(script.commands):
        yield f"`{late}` must stand after `{early}`, {reason}"


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
# In the lesson, these words stand for values that a script must have.
_PLACEHOLDERS = {
    "FILE": "the name of the data file",
    "K": "half the stiffness of a bond",
    "R0": "the length of a bond at rest",
    "FACE": "the side of the box that the wall closes",
    "PLACE": "the wall's x",
    "N": "the number of steps",
    "STEPS": "the number of steps",
}


def faults_by_part(script: StudentScript) -> dict[str, tuple[str, ...]]:
    """Return the faults in each part of a script, in order."""
    return {part: _faults_of_part(script, part) for part in _PARTS}


def _faults_of_part(script: StudentScript, part: str) -> tuple[str, ...]:
    begun = COMMANDS_OF_PARTS[part]
    formulas = ("variable",) if "print" in begun else ()
    notation = tuple(
        fault for command in script.commands for fault in _notation(command, (*begun, *formulas))
    )
    if notation:
        return notation
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


def _notation(command: StudentCommand, names: tuple[str, ...]) -> Iterator[str]:
    """Yield faults in the notation of a command, if it is one of these names."""
    first, *others = command
    shown = " ".join(command)
    if others and others[0] in names and re.fullmatch(r"\$|[1-5][.)]?", first):
        yield f"`{shown}`: delete `{first}` at the beginning of the line"
    elif first not in names and first.lower() in names:
        yield f"`{first}` is no command of LAMMPS: write `{first.lower()}`"
    elif "=" in first and first.partition("=")[0] in names:
        yield f"`{shown}`: write a space in place of `=`"
    elif first.rstrip(",;") in names:
        yield from _separators(command)


def _separators(command: StudentCommand) -> Iterator[str]:
    """Yield a fault if a comma or semicolon stands between the words of a command or at its end."""
    text = " ".join(command)
    bare = _QUOTED.sub("''", text)
    found = _SEPARATED.search(bare)
    if decimal := _DECIMAL_COMMA.search(bare):
        yield f"`{text}`: write a decimal point, {decimal[0].replace(',', '.')}"
        return
    # The formula of a variable may contain a comma and spaces.
    if found is None or (command[0] == "variable" and found.end() < len(bare)):
        return
    sign = "comma" if found[0] == "," else "semicolon"
    known = {name for names in COMMANDS_OF_PARTS.values() for name in names}
    if known.intersection(bare.split()[1:]):
        yield f"`{text}`: write each command on its own line, without a {sign}"
    elif found.end() < len(bare):
        yield f"`{text}`: LAMMPS separates words by spaces only, so delete each {sign}"
    else:
        yield f"`{text}` ends with a {sign}: delete it"
