"""Test jobs of collisions whose restitution the reference engine cannot determine."""

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows import scripted
from chaincor.workflows.errors import ToleranceError, UnsureJobWarning
from chaincor.workflows.job import job_files, write_job
from tests.lmp import number, run_lmp

# A piece of the broken chain moves so slowly that a further contact cannot be excluded.
OPEN = {"potential": "lj", "particles": 30, "speed": 1.37}


def longest_bond(table):
    """Return the largest length in a bond table."""
    return float([row for row in map(str.split, table.splitlines()) if len(row) == 4][-1][1])


def test_a_job_of_unknown_restitution_warns_and_has_a_wider_table():
    scene = Scene(**OPEN, tolerance=1e-4)
    with pytest.warns(UnsureJobWarning, match=r"only as 0.78 \+- 0.0065.* exceed 0.0001"):
        files = job_files(scene)
    assert "# Doubt: the reference engine finds eta" in files["in.chain"]
    loose = job_files(scene.replace(tolerance=0.05))
    assert "Doubt" not in loose["in.chain"]
    # Pieces separate at about v0 = 0.18. They may be followed for two more durations of the
    # collision, of 100 each.
    assert longest_bond(files["bond.table"]) > longest_bond(loose["bond.table"]) + 10.0


def test_the_command_prints_the_doubt(chaincor, tmp_path):
    options = [f"--{name}={value}" for name, value in OPEN.items()]
    status, out, err = chaincor("inputs", *options, "--tolerance", "1e-4", "-o", str(tmp_path))
    assert status == 0
    assert err.startswith("chaincor: note: the reference engine finds eta")
    assert err.count("\n") == 1
    assert len(out.split()) == 4


def test_a_job_of_an_error_that_says_nothing_is_refused(monkeypatch):
    right = scripted.error_bar
    monkeypatch.setattr(scripted, "error_bar", lambda *given: right(*given[:2], 57.0))
    with pytest.raises(ToleranceError, match="eta is unknown"):
        job_files(Scene(particles=3, tolerance=1e-4))


@pytest.mark.slow
@pytest.mark.parametrize(("particles", "speed"), [(30, 1.4), (65, 1.4228)])
def test_a_job_of_unknown_restitution_runs_to_its_end(particles, speed, tmp_path):
    scene = Scene(potential="lj", particles=particles, speed=speed, tolerance=1e-4)
    with pytest.warns(UnsureJobWarning):
        write_job(scene, tmp_path)
    done = run_lmp(tmp_path)
    assert done.returncode == 0, done.stdout[-2000:]
    assert number(done.stdout, "restitution_error") > 1e-3
