"""Test that the scenes under docs/examples run and appear in the reference."""

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from tests.docs.documents import ROOT

EXAMPLES = sorted((ROOT / "docs" / "examples").glob("*.toml"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_example_runs_and_keeps_what_it_asks_for(path):
    result = collide(Scene.from_file(path))
    assert 0.0 < result.restitution < 1.0 + 1e-6
    assert result.tolerance_met is not False, result.reason


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_example_is_shown_and_commented(path):
    assert f"../examples/{path.name}" in (ROOT / "docs/reference/scene.md").read_text()
    assert path.read_text().startswith("# ")
