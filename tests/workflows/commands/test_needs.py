"""Test that doctor lists the libraries that each command loads."""

import ast
import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from chaincor.workflows import machine
from chaincor.workflows.command_list import COMMANDS, GROUPS

ROOT = Path(__file__).parents[3]
LIBRARIES = sorted({n for facts in COMMANDS.values() for n in (*facts.needs, *facts.also)})
SWEEP = """
[scene]
potential = "lj"
engine = "reference"
tolerance = 1e-4
[axes]
particles = [3, 4]
speed = [0.1, 0.2]
"""
PROGRAM = """
import sys
from chaincor.workflows.cli import main
names = sys.argv[1].split(",")
try:
    main(sys.argv[2:])
except SystemExit as leave:
    print("\\nLOADED", leave.code, *(n for n in names if n in sys.modules))
"""
# Each use of a command loads these libraries in addition to those that the command always loads.
USES = {
    "run": {
        "--particles 3 --tolerance 1e-4 --engine reference": (),
        "--particles 3 --tolerance 1e-4": ("lammps", "jinja2"),
        "--particles 3 --tolerance 1e-4 --engine reference --animate a.gif": (
            "matplotlib",
            "scipy",
        ),
    },
    "explain": {"eta": ()},
    "inputs": {"--particles 3 --frames -o job": ()},
    # ASE reads trajectories in a separate process.
    "analyze": {"job": (), "job -o report": ("matplotlib",), "ase": ()},
    "validate": {"--particles 3": (), "--particles 3 --plot v.png": ("matplotlib",)},
    "tradeoff": {
        "--particles 3 --quick": (),
        "--particles 3 --quick -o t": ("matplotlib",),
    },
    "timestep": {
        "in.x --observable x=(.*) --vary h=1:.1:4 --phases 3": (),
        "in.x --observable x=(.*) --vary h=1:.1:4 --phases 3 -o s": ("matplotlib",),
    },
    "table": {"good.table": ()},
    "sweep": {"s.toml --store new.sqlite --workers 1": ()},
    "show": {"s.sqlite": ()},
    "plot": {"s.sqlite -o curves.png": ()},
    "store": {
        "export s.sqlite s.csv": (),
        "export s.sqlite s.parquet": ("pyarrow",),
        "export s.sqlite crate --rocrate": ("rocrate",),
    },
    "explore": {"--particles 3 -o page.html": ()},
    "check-script": {"plain/in.chain": ("numba", "scipy")},
    "lessons": {"-o lessons": ()},
    "doctor": {"--help": ()},
}
# Worker processes load these libraries for the command.
BY_WORKERS = {"sweep": {"numba"}}
# Libraries that another library loads.
BROUGHT = {"pyarrow": ("pandas",), "rocrate": ("jinja2",)}


def loaded(folder, *arguments):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, ",".join([*LIBRARIES, "llvmlite"]), *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    assert "\nLOADED 0" in done.stdout, done.stdout + done.stderr
    found = set(done.stdout.rsplit("LOADED 0", 1)[1].split())
    # Compiled loops need Numba if they are not in a cache.
    return found - {"llvmlite"} | ({"numba"} if "llvmlite" in found else set())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a job that was run, a store, and a trajectory of ASE."""
    from chaincor.lammps_inputs.scene import Scene
    from chaincor.workflows.collision import collide

    path = tmp_path_factory.mktemp("needs")
    (path / "s.toml").write_text(SWEEP)
    for name in ("ase", "job"):
        (path / name).mkdir()
    scene = Scene(particles=3, tolerance=1e-4)
    collide(scene.replace(dump=path / "job" / "dump.lammpstrj"))
    from ase.io import write

    write(path / "ase" / "m.traj", collide(scene).to_ase(100))
    (path / "in.x").write_text('variable h index 1\nprint "x=$(v_h^2:%.17g)"\n')
    loaded(path, "inputs", "--potential", "harmonic", "--particles", "3", "--plain", "-o", "plain")
    rows = "\n".join(
        f"{k} {k / 99} {(k / 99 - 0.5) ** 2 / 2} {0.5 - k / 99}" for k in range(1, 100)
    )
    (path / "good.table").write_text(f"KEY\nN 99\n\n{rows}\n")
    loaded(path, "sweep", "s.toml", "--store", "s.sqlite", "--workers", "1")
    return path


@pytest.mark.slow
@pytest.mark.parametrize("command", USES)
def test_needs_are_what_is_loaded(folder, command):
    facts = COMMANDS[command]
    for arguments, more in USES[command].items():
        words = [word.replace("job", "new") if command == "inputs" else word
                 for word in arguments.split()]  # fmt: skip
        assert set(more) <= set(facts.also)
        found = loaded(folder, command, *words) | BY_WORKERS.get(command, set())
        brought = (name for library in more for name in BROUGHT.get(library, ()))
        assert found == {*facts.needs, *more, *brought}, arguments


@cache
def imports_of(module):
    path = ROOT / module.replace(".", "/")
    package = path / "__init__.py"  # an older checkout may have left a folder without this file
    path = package if package.exists() else path.with_suffix(".py")
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                full = f"{node.module}.{alias.name}"
                inside = (ROOT / full.replace(".", "/")).with_suffix(".py").exists()
                found.add(full if inside else node.module)
    return found


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.slow_cases
def test_nothing_is_named_that_the_code_does_not_import(command):
    """Check the imports in the source, which include uses that take minutes or a cluster."""
    seen, todo, libraries = (
        set(),
        [f"chaincor.workflows.commands.{command.replace('-', '_')}"],
        set(),
    )
    while todo:
        module = todo.pop()
        if module in seen:
            continue
        seen.add(module)
        for name in imports_of(module):
            if name.startswith("chaincor."):
                todo.append(name)
            else:
                libraries.add(name.split(".")[0])
    # LAMMPS is imported by its name as a string, and pandas imports pyarrow.
    source = (ROOT / "chaincor" / "workflows/engines/lammps/library.py").read_text()
    assert '"lammps"' in source or "import lammps" in source
    by_name = {"lammps", "pyarrow"}
    facts = COMMANDS[command]
    assert {*facts.needs, *facts.also} - by_name <= libraries


def test_what_is_missing_stops_the_commands_that_need_it(chaincor, monkeypatch):
    def fail():
        raise ImportError("libmpi.so.12 is not there")

    monkeypatch.setattr(machine, "_lammps_library", fail)
    status, out, _ = chaincor("doctor")
    assert status == 1
    lines = out.splitlines()
    (run,) = (line for line in lines if line.startswith("yes  run:"))
    assert "lammps for engine lammps" in run
    assert run.endswith("- lacks lammps")
    assert any(line.startswith("NO   reproduce:") for line in lines)
    (show,) = (line for line in lines if " show:" in line)
    assert show == "yes  show: nothing more"
    _, out, _ = chaincor("doctor", "--json")
    commands = {entry["command"]: entry for entry in json.loads(out)["commands"]}
    assert list(commands) == list(COMMANDS)
    assert commands["validate"]["works"] is False
    assert commands["validate"]["missing"] == ["lammps"]
    assert commands["plot"]["works"] is True


def test_help_shows_every_command_once_under_its_task(chaincor):
    assert sorted(name for names in GROUPS.values() for name in names) == sorted(COMMANDS)
    _, out, _ = chaincor("--help")
    for title, names in GROUPS.items():
        section = out.split(f"{title}:\n")[1].split("\n\n")[0]
        assert [line.split()[0] for line in section.splitlines() if line[2] != " "] == list(names)
