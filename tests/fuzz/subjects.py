"""List the kinds of files that commands read, each with a valid file and a way to spoil it."""

import contextlib
import sqlite3
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from random import Random

import numpy as np

from chaincor.analysis.dumps.dump import Dump
from tests.extremes.cases import NASTY_NUMBERS, NASTY_TEXTS, mutate
from tests.extremes.materials import SCENES, SWEEPS, materials

LOG = """LAMMPS (22 Jul 2025)
contacts = 3
last_contact_time = 4.5
ending = it is over, end proved
momentum_change = 0.3
wall_impulse = 0.3
restitution = 0.9
restitution_error = 1e-7
Total wall time: 0:00:01
"""
MANIFEST = "number,folder,particles,refusal\n1,0001,3,\n2,0002,4,no job\n"
TEMPLATE = (
    '{% extends "job.in.j2" %}\n{% set n = particles * 2 %}\n'
    "{% block setup %}{% for i in range(n) %}# {{ i ** 2 }} {{ 'x' * i }}\n{% endfor %}"
    "compute ke all ke\n{% endblock %}\n"
)

_PROPERTIES = 'Properties=species:S:1:pos:R:3:vel:R:3 pbc="F F F"'


@dataclass(frozen=True)
class Subject:
    """A kind of file, how it is spoilt, and the commands that read it."""

    name: str  #: Name of the kind.
    file: str  #: Name in `files` of the file that is spoilt.
    files: dict[str, bytes]  #: Files in the folder where the command runs.
    commands: tuple[tuple[str, ...], ...]  #: Command lines that read the file.
    outputs: tuple[str, ...] = ()  #: Files that the commands may write.
    spoil: Callable[[Random, bytes], bytes] = mutate  #: Function that returns a spoilt file.


def _in_job(name: str, content: bytes) -> dict[str, bytes]:
    job = {f"job/{key}": value for key, value in materials().job.items()}
    if name != "dump.lammpstrj":
        del job["job/dump.lammpstrj"]
    return job | {f"job/{name}": content}


def _frames() -> tuple[np.ndarray, np.ndarray]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "d"
        path.write_bytes(materials().job["dump.lammpstrj"])
        frames = [(f.column("x"), f.column("vx")) for f in Dump(path)]
    return np.array([x for x, _ in frames]), np.array([v for _, v in frames])


def _xyz() -> bytes:
    lines = []
    for k, (x, v) in enumerate(zip(*_frames(), strict=True)):
        lines += [
            str(len(x)),
            f'Step={k} Time={k} Properties=species:S:1:pos:R:3:vel:R:3 pbc="F F F"',
        ]
        lines += [f"Ar {a:g} 0 0 {b:g} 0 0" for a, b in zip(x, v, strict=True)]
    return ("\n".join(lines) + "\n").encode()


def _by_ase() -> bytes:
    from ase import Atoms
    from ase.io import write

    images = []
    for time, (x, v) in enumerate(zip(*_frames(), strict=True)):
        atoms = Atoms("Ar" * len(x), np.column_stack((x, 0 * x, 0 * x)), info={"time": time})
        atoms.set_velocities(np.column_stack((v, 0 * v, 0 * v)))
        images.append(atoms)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "d.traj"
        write(path, images)
        return path.read_bytes()


def _yaml() -> bytes:
    parts = []
    for k, (x, v) in enumerate(zip(*_frames(), strict=True)):
        pairs = enumerate(zip(x, v, strict=True), 1)
        rows = "".join(f"  - [ {i} , {a} , {b} , ]\n" for i, (a, b) in pairs)
        parts.append(
            f"---\ncreator: LAMMPS\ntimestep: {k}\nunits: lj\ntime: {k}\nnatoms: {len(x)}\n"
            "boundary: [ f, f, f, f, f, f, ]\nbox:\n  - [ -9, 99 ]\n  - [ -1, 1 ]\n  - [ -1, 1 ]\n"
            f"keywords: [ id, x, vx,  ]\ndata:\n{rows}...\n"
        )
    return "".join(parts).encode()


def _by_mdanalysis(ending: str) -> bytes:
    import MDAnalysis

    xs, vs = _frames()
    universe = MDAnalysis.Universe.empty(xs.shape[1], trajectory=True, velocities=True)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = Path(folder) / f"t.{ending}"
        with MDAnalysis.Writer(str(path), xs.shape[1], velocities=True) as writer:
            for k, (x, v) in enumerate(zip(xs, vs, strict=True)):
                universe.trajectory.ts.dimensions = [99.0, 9.0, 9.0, 90.0, 90.0, 90.0]
                universe.trajectory.ts.data["step"], universe.trajectory.ts.time = k, float(k)
                universe.atoms.positions = np.column_stack((x, 0 * x, 0 * x))
                universe.atoms.velocities = np.column_stack((v, 0 * v, 0 * v))
                writer.write(universe.atoms)
        return path.read_bytes()


def spoil_cells(random: Random, content: bytes) -> bytes:
    """Return a store with an invalid value, or with a table that is replaced."""
    connection = sqlite3.connect(":memory:")
    with contextlib.closing(connection):
        connection.deserialize(content)
        with contextlib.suppress(sqlite3.Error, UnicodeEncodeError):
            table, names = random.choice(_COLUMNS)
            value = random.choice([*NASTY_TEXTS, *map(_number, NASTY_NUMBERS), b"\x00\xff", None])
            if random.random() < 0.1:
                value = "[" * 5000 + "]" * 5000
            connection.execute(f"PRAGMA ignore_check_constraints = {random.randint(0, 1)}")
            connection.execute(f'UPDATE {table} SET "{random.choice(names)}" = ?', (value,))
            if random.random() < 0.1:
                connection.execute(random.choice(_SCHEMAS))
            connection.commit()
        return connection.serialize()


_SCHEMAS = (
    "CREATE VIEW v AS SELECT 1",
    "CREATE TRIGGER t AFTER INSERT ON arrays BEGIN DELETE FROM collisions; END",
    "DROP TABLE environments",
    "ALTER TABLE collisions ADD COLUMN c AS (particles + 1)",
)
_COLUMNS = (
    *3
    * (
        (
            "collisions",
            (
                *("potential", "particles", "velocity", "speed", "engine", "tolerance"),
                *("restitution", "restitution_error", "tolerance_met", "contacts", "crossed"),
                *("bond_min", "reason", "scheme", "timestep", "failure", "failure_message"),
                *("failure_stands", "tries", "host", "finished", "environment", "scene", "details"),
            ),
        ),
    ),
    ("environments", ("versions", "id")),
    ("arrays", ("name", "npy")),
)


def _number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


@cache
def subjects() -> dict[str, Subject]:
    """Return all kinds of files by name."""
    return {each.name: each for each in (*_dumps(), *_beside_dumps(), *_stores(), *_others())}


_ANALYZE = ("analyze", "job"), ("analyze", "job", "--json")


def _dumps() -> list[Subject]:
    dumps = {
        "text dump": ("dump.lammpstrj", materials().job["dump.lammpstrj"]),
        "yaml dump": ("d.yaml", _yaml()),
        "extended XYZ": ("d.extxyz", _xyz()),
        "ASE trajectory": ("d.traj", _by_ase()),
        "TRR": ("d.trr", _by_mdanalysis("trr")),
        "NetCDF": ("d.ncdf", _by_mdanalysis("ncdf")),
    }
    return [
        Subject(name, f"job/{file}", _in_job(file, content), _ANALYZE)
        for name, (file, content) in dumps.items()
    ]


def _beside_dumps() -> list[Subject]:
    job = _in_job("dump.lammpstrj", materials().job["dump.lammpstrj"])
    job["job/units.toml"] = b"[units]\nlength = 1.0\nmass = 1.0\nstiffness = 1.0\nstyle = 'lj'\n"
    files = {"data file": "chain.data", "script": "in.chain", "units": "units.toml"}
    return [Subject(name, f"job/{file}", job, _ANALYZE) for name, file in files.items()]


def _stores() -> list[Subject]:
    commands = (
        ("show", "s.sqlite"),
        ("show", "s.sqlite", "--json"),
        ("plot", "s.sqlite", "--x", "particles", "--y", "contacts", "-o", "p.png"),
        ("store", "export", "s.sqlite", "e.csv"),
        ("store", "merge", "m.sqlite", "s.sqlite"),
    )
    store, outputs = {"s.sqlite": materials().store}, ("p.png", "e.csv", "m.sqlite")
    return [
        Subject("store", "s.sqlite", store, commands, outputs),
        Subject("cells of a store", "s.sqlite", store, commands, outputs, spoil_cells),
    ]


def _others() -> list[Subject]:
    grid = {f"grid/0001/{name}": content for name, content in _grid().items()}
    grid["grid/manifest.csv"] = MANIFEST.encode()
    collect, collected = (("collect", "grid", "-o", "c.sqlite"),), ("c.sqlite",)
    table, sweep, template = materials().table, SWEEPS[0].encode(), TEMPLATE.encode()
    job = ("inputs", "--particles", "2", "--scheme", "verlet", "--template", "t.j2", "-o", "made")
    check = ("table", "t.table"), ("table", "t.table", "--json")
    return [
        Subject("log", "grid/0001/log.lammps", grid, collect, collected),
        Subject("manifest", "grid/manifest.csv", grid, collect, collected),
        Subject("table", "t.table", {"t.table": table}, check),
        Subject("sweep", "s.toml", {"s.toml": sweep}, (("sweep", "s.toml", "--dry-run"),)),
        Subject("template", "t.j2", {"t.j2": template}, (job,), ("made",)),
    ]


def _grid() -> dict[str, bytes]:
    scene = SCENES[0].encode()
    return {"asked.toml": scene, "scene.toml": scene, "log.lammps": LOG.encode()}
