"""Imports point one way, and nothing slow is imported before it is needed."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MAY_IMPORT = {
    "lammps_inputs": set(),
    "analysis": {"lammps_inputs"},
    "workflows": {"lammps_inputs", "analysis"},
}
SLOW = ("matplotlib", "MDAnalysis", "lammps", "numba", "scipy", "numpy", "pydantic", "ase")


def imported_packages(path):
    """Return the top-level packages a module imports, wherever in it the import stands."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found.add(node.module.split(".")[0])
    return found


def modules(package):
    return sorted((ROOT / package).rglob("*.py"))


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_dependencies_point_one_way(package):
    forbidden = set(MAY_IMPORT) - MAY_IMPORT[package] - {package} | {"tests"}
    offenders = {
        str(path.relative_to(ROOT)): imported_packages(path) & forbidden
        for path in modules(package)
        if imported_packages(path) & forbidden
    }
    assert offenders == {}


def python(code):
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_analysis_works_without_lammps():
    # None in sys.modules makes an import fail as if the package were not installed.
    code = """
import sys
sys.modules["lammps"] = sys.modules["mpich"] = None
import importlib, pkgutil, analysis
for module in pkgutil.walk_packages(analysis.__path__, "analysis."):
    importlib.import_module(module.name)
import numpy as np
from analysis.restitution import restitution
print(restitution(np.array([0.05, 0.15]), 0.1))
"""
    assert float(python(code)) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("statement", "absent"),
    [
        ("import workflows.cli", SLOW),
        ("import analysis, lammps_inputs, workflows", SLOW),
        ("import lammps_inputs.scene", ("matplotlib", "MDAnalysis", "lammps", "numba")),
        ("import analysis.restitution", ("matplotlib", "MDAnalysis", "lammps", "numba")),
        ("import workflows.engines.lammps", ("matplotlib", "MDAnalysis", "lammps")),
    ],
)
def test_nothing_slow_is_imported_early(statement, absent):
    loaded = python(f"{statement}; import sys; print(*sys.modules)").split()
    assert [name for name in absent if name in loaded] == []
