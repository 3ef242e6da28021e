"""Imports point one way, and nothing slow is imported before it is needed."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from tests.floors import FLOORS_WITHIN, NAMED_FOR_TYPES
from tests.programs import python

ROOT = Path(__file__).parents[1]
MAY_IMPORT = {
    "lammps_inputs": set(),
    "analysis": {"lammps_inputs"},
    "workflows": {"lammps_inputs", "analysis"},
}
PACKAGES = (*MAY_IMPORT, "benchmarks")
# Folders and modules from the top floor down: each may import what stands in a row below it, and
# a folder also itself. What shares a row does not know each other.
FLOORS = {
    "workflows": [
        {"commands"},
        {"lessons", "reproduce"},
        {"grids", "tradeoff"},
        {"validation"},
        {"job", "job_analysis", "machine", "scripts", "tables"},
        {"collision", "pictures", "scripted"},
        {"campaign"},
        {"store"},
        {"result_of"},
        {"accuracy"},
        {"result"},
        {"showing"},
        {"bodies", "motion"},
        {"engines"},
        {"cli", "json_output", "outputs", "pages", "study_progress"},
        {"given"},
        {"durations", "errors", "measured", "versions"},
    ],
    "workflows/engines": [
        {"replay"},
        {"lammps"},
        {"in_house"},
        {"look_ahead", "rounding"},
        {"outcome", "parting", "schemes"},
        {"whole_end"},
        {"compositions", "end_watch", "interrupts", "splittings", "time_limit"},
        {"ending"},
        {"pieces"},
        {"piece_bounds"},
    ],
    "workflows/engines/in_house": [
        {"side_by_side"},
        {"modal", "stepping"},
        {"lines"},
        {"hard_sphere"},
        {"adaptive"},
        {"follow", "mode_flight"},
        {"motion_coast", "recorder"},
        {"moving"},
        {"finish", "kernels"},
        {"blocks"},
        {"motion", "compile"},
        {"contact", "loops"},
        {"contact_search", "line_stages"},
        {"stages"},
    ],
    "lammps_inputs/bonds": [
        {"equilibrium", "formula", "potentials", "table_file"},
        {"spline_bond"},
        {"formula_rest", "user_bond"},
        {"formula_code"},
        {"formula_text"},
        {"potential"},
        {"energy_levels"},
        {"check", "clamped_spline", "exponential", "series", "table_checks", "table_rows"},
    ],
    "workflows/reproduce": [
        {"reproduction"},
        {"report"},
        {"measuring", "paper", "questions", "trust"},
        {"figures"},
        {"drawing", "low_speed"},
        {"claims", "free_flight"},
        {"fits", "hard_spheres", "measurements", "slips"},
        {"plan"},
    ],
    "analysis": [
        {"step_error"},
        {"analysis_files", "job_folder"},
        {"frame_analysis"},
        {"caveats", "figures", "history"},
        {"results"},
        {"slow_chains"},
        {"contacts", "pair_theory", "theory"},
        {"dumps", "modes"},
        {
            *("atomic_write", "distribution", "ladders", "restitution", "showing", "start"),
            "wave_transforms",
        },
    ],
}
SLOW = (
    *("matplotlib", "MDAnalysis", "lammps", "numba", "scipy", "numpy", "pydantic", "ase"),
    *("mpmath", "sympy"),
)


ALL_FLOORS = FLOORS | FLOORS_WITHIN


def modules(folder):
    return sorted((ROOT / folder).rglob("*.py"))


@cache
def imported_modules(path):
    """Return what a module imports, wherever in it the import stands, by the full dotted names."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def imported_for_types(path):
    """Return what a module imports for the type checker alone."""
    blocks = (
        node
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    )
    return {
        f"{inner.module}.{alias.name}"
        for block in blocks
        for inner in block.body
        if isinstance(inner, ast.ImportFrom)
        for alias in inner.names
    }


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_dependencies_point_one_way(package):
    forbidden = {f"chaincor.{name}" for name in set(MAY_IMPORT) - MAY_IMPORT[package] - {package}}
    offenders = {
        str(path.relative_to(ROOT)): found
        for path in modules(package)
        if (
            found := {
                name
                for name in imported_modules(path)
                if ".".join(name.split(".")[:2]) in forbidden
                # The public face knows everything; nothing inside may come in through it.
                or (name.split(".")[0] == "chaincor" and name.split(".")[1] not in MAY_IMPORT)
                or name.split(".")[0] in {"tests", "benchmarks"}
            }
        )
    }
    assert offenders == {}


def test_every_folder_has_its_floors():
    """Whoever makes a folder says what stands on what in it."""
    folders = {
        str(path.parent.relative_to(ROOT))
        for package in PACKAGES
        for path in modules(package)
        if path.name != "__init__.py"
    }
    assert folders - set(ALL_FLOORS) == set(), "a folder without floors: list it in tests/floors.py"
    assert set(ALL_FLOORS) - folders == set(), "floors of a folder that is no more"
    assert set(FLOORS) & set(FLOORS_WITHIN) == set()


@pytest.mark.parametrize("folder", ALL_FLOORS)
def test_folders_import_only_what_stands_below(folder):
    rows = ALL_FLOORS[folder]
    floor = {name: k for k, row in enumerate(reversed(rows)) for name in row}
    assert len(floor) == sum(map(len, rows)), "a module stands in two rows"
    inside = {p.stem for p in (ROOT / folder).glob("*.py")} | {
        p.parent.name for p in (ROOT / folder).glob("*/__init__.py")
    }
    assert inside - {"__init__"} == set(floor)  # whoever adds a module says where it stands
    floor["__init__"] = len(rows)  # the face of a folder may show all that is in it
    package = folder.replace("/", ".")
    prefix = f"{package}." if package.split(".")[0] == "benchmarks" else f"chaincor.{package}."
    offenders = []
    for path in modules(folder):
        here = path.relative_to(ROOT / folder).parts[0].removesuffix(".py")
        typed = imported_for_types(path) & {NAMED_FOR_TYPES.get(folder)}
        for name in imported_modules(path) - typed:
            if name.startswith(prefix):
                there = name.removeprefix(prefix).split(".")[0]
                if there != here and floor[there] >= floor[here]:
                    offenders.append(f"{path.relative_to(ROOT)} imports {name}")
    assert offenders == []


@pytest.mark.parametrize("package", ["benchmarks", "chaincor", "docs", "tests", *MAY_IMPORT])
def test_nothing_is_imported_by_a_bare_name(package):
    # A user's own analysis.py, or another package of the name, would be found in its place.
    offenders = [
        str(path.relative_to(ROOT))
        for path in modules(package)
        if {name.split(".")[0] for name in imported_modules(path)} & set(MAY_IMPORT)
    ]
    assert offenders == []


def test_the_plan_of_the_house_names_what_is_there():
    page = (ROOT / "docs" / "explanation" / "architecture.md").read_text()
    named = set(re.findall(r"`((?:workflows|analysis|lammps_inputs|tests)/[\w./]*)`", page))
    assert len(named) > 20
    assert sorted(path for path in named if not (ROOT / path).exists()) == []


def test_analysis_works_without_lammps():
    # None in sys.modules makes an import fail as if the package were not installed.
    code = """
import sys
sys.modules["lammps"] = sys.modules["mpich"] = None
import importlib, pkgutil, chaincor.analysis
for module in pkgutil.walk_packages(chaincor.analysis.__path__, "chaincor.analysis."):
    importlib.import_module(module.name)
import numpy as np
from chaincor.analysis.restitution import restitution
print(restitution(np.array([0.05, 0.15]), 0.1))
"""
    assert float(python(code)) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import chaincor.__main__", SLOW),
        ("import chaincor.workflows.cli", SLOW),
        ("import chaincor.analysis, chaincor.lammps_inputs, chaincor.workflows", SLOW),
        ("from chaincor import Scene", ("matplotlib", "MDAnalysis", "lammps", "numba", "sympy")),
        ("import chaincor.lammps_inputs.scene", ("matplotlib", "MDAnalysis", "lammps", "numba")),
        ("import chaincor.analysis.restitution", ("matplotlib", "MDAnalysis", "lammps", "numba")),
        ("import chaincor.workflows.engines.lammps.engine", ("matplotlib", "MDAnalysis", "lammps")),
    ],
)
def test_nothing_slow_is_imported_early(statement, absent):
    loaded = python(f"{statement}; import sys; print(*sys.modules)").split()
    assert [name for name in absent if name in loaded] == []
