"""Test that the annotated job runs in `lmp` and gives the results of the plain job."""

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.job import write_job
from tests.lmp import run_lmp, unexpected_warnings


def results(text):
    return [line for line in text.splitlines() if " = " in line and "CPU" not in line]


@pytest.mark.slow_cases
@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize("fields", [{"potential": "harmonic"}, {"potential": "lj", "speed": 1.0}])
def test_explaining_changes_no_result(fields, wall, tmp_path):
    scene = Scene(particles=10, wall=wall, scheme="verlet", **fields)
    runs = {}
    for explain in (False, True):
        folder = tmp_path / str(explain)
        write_job(scene, folder, dump=True, explain=explain)
        runs[explain] = run_lmp(folder)
        assert runs[explain].returncode == 0, runs[explain].stdout[-2000:]
        assert unexpected_warnings(runs[explain].stdout) == []
    assert results(runs[True].stdout) == results(runs[False].stdout)
    assert any(line.startswith("restitution") for line in results(runs[True].stdout))
    said = (tmp_path / "True" / "chain.data").read_text()
    # Comments are wrapped to the width of a slide.
    assert "Without this section the chain would be a gas" in said.replace("\n# ", " ")


@pytest.mark.slow
def test_a_composed_job_is_explained(tmp_path):
    scene = Scene(particles=4, contact="power", tolerance=1e-6)
    for explain in (False, True):
        write_job(scene, tmp_path / str(explain), dump=True, explain=explain)
    lean, annotated = (
        (tmp_path / str(explain) / "in.chain").read_text().splitlines() for explain in (False, True)
    )
    commands = [
        [line for line in lines if line and not line.startswith("#")] for lines in (lean, annotated)
    ]
    assert commands[0] == commands[1]
    assert len(annotated) > 1.3 * len(lean)
