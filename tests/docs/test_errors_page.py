"""Test that each named error has a section on the page of errors, and that no section is stale."""

import importlib
import math
import pkgutil
import re

import numpy as np

import chaincor.analysis
import chaincor.lammps_inputs
import chaincor.workflows
from chaincor.lammps_inputs.bonds.potentials import CHAIN_POTENTIALS
from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from tests.docs.documents import ROOT


def named_errors():
    for package in (chaincor.lammps_inputs, chaincor.analysis, chaincor.workflows):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            importlib.import_module(module.name)
    found, queue = set(), [ChaincorError]
    while queue:
        for kind in queue.pop().__subclasses__():
            found.add(kind.__name__)
            queue.append(kind)
    return found


def test_each_error_has_a_section_with_cause_and_remedy():
    page = (ROOT / "docs" / "errors.md").read_text()
    sections = dict(re.findall(r"^### (\w+)\n(.*?)(?=^##|\Z)", page, re.MULTILINE | re.DOTALL))
    assert set(sections) == named_errors()
    for name, text in sections.items():
        assert "**Cause.**" in text, name
        assert "**Remedy.**" in text, name


def test_bonds_that_particles_can_cross_are_named_with_the_error_that_says_so():
    page = (ROOT / "docs" / "errors.md").read_text()
    section = page.split("### CrossingError\n")[1].split("\n### ")[0]
    # Particles can cross bonds whose energy is finite at length zero. Only harmonic chains are
    # followed beyond a crossing.
    for name in CHAIN_POTENTIALS:
        keys = {"power": {"power_order": 4, "power_c": 1.0}, "harmonic": {"velocity": 0.1}}
        bond = Scene(potential=name, **keys.get(name, {})).bond
        with np.errstate(divide="ignore"):
            crosses = math.isfinite(float(bond.energy(np.array(-1.0))))
        if crosses and bond.crossing_strain == -1.0:
            assert f"`{name}`" in section
    assert "The reference engine refuses other bonds, too" in section


def test_a_message_names_its_section(chaincor):
    status, _, err = chaincor("run", "--particles", "0")
    assert status == 2
    assert err.rstrip().endswith("(see: chaincor explain SceneError)")
