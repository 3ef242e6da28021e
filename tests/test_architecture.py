"""Imports point one way, and nothing slow is imported before it is needed."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

from tests.programs import python

ROOT = Path(__file__).parents[1]
MAY_IMPORT = {
    "lammps_inputs": set(),
    "analysis": {"lammps_inputs"},
    "workflows": {"lammps_inputs", "analysis"},
}
# Folders and modules from the top floor down: each may import what stands in a row below it, and
# a folder also itself. What shares a row does not know each other.
FLOORS = {
    "workflows": [
        {"commands"},
        {"lessons", "reproduce"},
        {"ensemble"},
        {"grids", "sweep", "tradeoff"},
        {"validation"},
        {"job", "job_analysis", "machine", "store"},
        {"collision", "pictures", "scripted"},
        {"result_of"},
        {"accuracy"},
        {"result"},
        {"showing"},
        {"bodies", "motion"},
        {"engines"},
        {"cli", "json_output", "outputs", "pages", "processes", "run_progress"},
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
        {"compositions", "end_watch", "interrupts", "splittings"},
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
        {"chain_coast"},
        {"chain"},
        {"finish", "kernels"},
        {"blocks"},
        {"motion", "compile"},
        {"loops"},
        {"contact_search", "stages"},
    ],
    "lammps_inputs/bonds": [
        {"named"},
        {"equilibrium", "formula", "potentials", "table_file"},
        {"formula_rest", "user_bond"},
        {"formula_code"},
        {"formula_text"},
        {"force_kernels"},
        {"potential"},
        {"check", "clamped_spline", "exponential", "series"},
    ],
    "workflows/reproduce": [
        {"reproduction"},
        {"report"},
        {"beyond", "bonds_used", "judging", "readings", "runners", "trust"},
        {"claims", "figures"},
        {"rules"},
        {"findings", "tables"},
        {"exact_hard_spheres", "fits", "measurements", "slips"},
        {"studies"},
        {"plan"},
    ],
    "analysis": [
        {"step_error", "two_bodies"},
        {"analysis_files", "job_folder"},
        {"frame_analysis"},
        {"caveats", "figures", "history"},
        {"results"},
        {"contacts", "pair_theory", "theory"},
        {"dumps", "modes"},
        {
            *("atomic_write", "distribution", "ladders", "restitution", "showing", "start"),
            "wave_transforms",
        },
    ],
}
MOST_MODULES = 16
SLOW = (
    *("matplotlib", "MDAnalysis", "lammps", "numba", "scipy", "numpy", "pydantic", "ase"),
    *("mpmath", "sympy"),
)


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


@pytest.mark.parametrize("folder", FLOORS)
def test_folders_import_only_what_stands_below(folder):
    floor = {name: k for k, row in enumerate(reversed(FLOORS[folder])) for name in row}
    inside = {p.stem for p in (ROOT / folder).glob("*.py")} | {
        p.parent.name for p in (ROOT / folder).glob("*/__init__.py")
    }
    assert inside - {"__init__"} == set(floor)  # whoever adds a module says where it stands
    prefix = f"chaincor.{folder.replace('/', '.')}."
    offenders = []
    for path in modules(folder):
        here = path.relative_to(ROOT / folder).parts[0].removesuffix(".py")
        for name in imported_modules(path):
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


@pytest.mark.parametrize("package", ["benchmarks", *MAY_IMPORT])
def test_no_folder_is_a_heap(package):
    folders = {path.parent for path in modules(package)}
    heaps = {
        str(folder.relative_to(ROOT)): len(found)
        for folder in folders
        if len(found := [p for p in folder.glob("*.py") if p.name != "__init__.py"]) > MOST_MODULES
    }
    assert heaps == {}


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
