"""Test that the Python function and the command analyse a job's dump equally."""

import json

import numpy as np
import pytest

from chaincor.analysis.analysis_files import to_json_object
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.job_analysis.analyze import analyze

HARMONIC = Scene(potential="harmonic", particles=6, scheme="verlet", timestep=0.02, error=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("job")
    collide(HARMONIC.replace(dump=folder / "chain.dump"))
    (folder / "scene.toml").write_text(HARMONIC.to_toml())
    return folder


def test_it_is_what_the_command_prints(chaincor, folder):
    found = analyze(folder)
    status, out, _ = chaincor("analyze", str(folder), "--json")
    assert status == 0
    printed, analysed = json.loads(out), json.loads(json.dumps(to_json_object(found)))
    # Only the command adds the keys that every object has.
    assert {key: printed[key] for key in analysed} == analysed
    assert set(printed) - set(analysed) == {"schema", "versions", "processor", "scene"}


def test_an_analysis_shows_itself_in_three_lines(folder):
    found = analyze(str(folder), dump=str(folder / "chain.dump"), velocity=0.1)
    first, second, third = repr(found).splitlines()
    assert first.startswith("6 particles, harmonic bonds, v0 = 0.1, ")
    # The tolerance is the dump's own error, or 1e-12.
    shown = second.split()[2]
    assert float(shown) == pytest.approx(found.restitution, abs=max(found.data_error, 1e-12))
    assert len(shown) <= len("0.1234567890123")
    assert third.startswith("e = ")


def test_a_dump_that_begins_right_after_two_bodies_met(tmp_path):
    scene = HARMONIC.replace(target_particles=3)
    run = collide(scene.replace(dump=tmp_path / "chain.dump"))
    # The first frame of the reference engine is after the first contact.
    for beside in (False, True):
        if beside:
            (tmp_path / "scene.toml").write_text(scene.to_toml())
        found = analyze(tmp_path, bond=scene.bond)
        assert found.velocity == pytest.approx(scene.impact_velocity, rel=1e-12)
        assert found.restitution == pytest.approx(run.restitution, rel=1e-10)
        assert found.contacts == run.contacts
    with pytest.raises(InputError, match=r"^masses are given for a chain with a free target"):
        analyze(tmp_path, masses=np.ones(6))
    with pytest.raises(InputError, match=r"approach each other with 0\.05 in the first frame"):
        analyze(tmp_path, velocity=0.2)


def test_a_folder_that_is_none_is_refused(tmp_path):
    with pytest.raises(InputError, match="is not a folder"):
        analyze(tmp_path / "nowhere")
    with pytest.raises(InputError, match=r"^None is not a folder"):
        analyze(None)
