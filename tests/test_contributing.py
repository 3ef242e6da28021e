"""Test that the patches in CONTRIBUTING.md apply, and that their additions work."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.programs import ROOT

_TREE = ("chaincor", "analysis", "lammps_inputs", "workflows")

# Each kind of addition is used as a reader would use it: bonds, laws and schemes in both engines.
_USED = """
import sys
from chaincor import Scene, collide, sweep
import chaincor.workflows.cli as cli
from chaincor.workflows.pictures.bond_script import bonds_script

bond = dict(potential="cosh", particles=5, velocity=0.3)
exact = collide(Scene(**bond, engine="reference"), tolerance=1e-9)
by_lammps = collide(Scene(**bond), tolerance=1e-5)
bars = exact.restitution_error + by_lammps.restitution_error
assert abs(exact.restitution - by_lammps.restitution) <= bars, (exact, by_lammps)

# A contact law is followed by both engines, too.
soft = dict(bond, contact="cubic", contact_stiffness=2.0)
exact_soft = collide(Scene(**soft, engine="reference"), tolerance=1e-8)
soft_by_lammps = collide(Scene(**soft), tolerance=1e-5)
bars = exact_soft.restitution_error + soft_by_lammps.restitution_error
assert abs(exact_soft.restitution - soft_by_lammps.restitution) <= bars, (exact_soft, bars)
assert abs(exact_soft.restitution - exact.restitution) > bars

# The live page has its formulas, too.
assert "cosh: {" in bonds_script()

# Of order 4: half the step, a sixteenth of the error, but for the next order.
errors = [
    collide(Scene(**bond, scheme="yoshida4", timestep=step)).restitution - exact.restitution
    for step in (0.05, 0.025)
]
assert 12 < errors[0] / errors[1] < 20, errors

scene = Scene(**bond, engine="reference", tolerance=1e-6)
sweep(scene, velocity=[0.3], store="s.db", workers=1, progress=False)
cli.main(sys.argv[1:])
"""


def run(arguments: list[str], tree: Path) -> str:
    """Run the patched program in an empty folder; return its output."""
    folder = tree / "run"
    folder.mkdir(exist_ok=True)
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env={"PYTHONPATH": str(tree), "PATH": "/usr/bin:/bin", "HOME": str(tree)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.slow
def test_each_walk_through_is_a_patch_that_works(tmp_path):
    for name in _TREE:
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / name, tmp_path / name, symlinks=True, ignore=ignored)
    page = (ROOT / "CONTRIBUTING.md").read_text()
    patches = re.findall(r"^```diff\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    assert len(patches) == 5
    for patch in patches:
        command = ["git", "apply", "--whitespace=nowarn", "-"]
        done = subprocess.run(
            command, cwd=tmp_path, input=patch, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{done.stderr}\n{patch}"
    scale = run(["-c", _USED, "scale", "--potential", "cosh"], tmp_path)
    # The root of cosh(5 s) - 1 = 25 s^2 is s = -0.59656, so that v* = sqrt(2) 0.59656.
    assert scale == "v* = 0.8436822316256\n"
    shown = run(
        ["-m", "chaincor", "show", "s.db", "--columns", "restitution,longest_silence"], tmp_path
    )
    assert "longest_silence" in shown
