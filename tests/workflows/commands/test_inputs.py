"""Test that ``chaincor inputs`` writes the requested files, or prints an error in one line."""

import pytest

from chaincor.lammps_inputs.scene import Scene


def test_a_job_is_written_and_listed(chaincor, tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text('potential = "lj"\nparticles = 6\nspeed = 0.3\nwall = "reflect"\n')
    status, out, _ = chaincor("inputs", str(scene), "-o", str(tmp_path / "job"))
    assert status == 0
    assert out.split() == [
        str(tmp_path / "job" / name)
        for name in ("in.chain", "chain.data", "bond.table", "scene.toml")
    ]
    text = (tmp_path / "job" / "in.chain").read_text()
    assert "wall/reflect xlo 0.0" in text
    assert Scene.from_file(tmp_path / "job" / "scene.toml").particles == 6


def test_frames_on_request(chaincor, tmp_path):
    chaincor("inputs", "--particles", "4", "--frames", "-o", str(tmp_path))
    assert "write_dump" in (tmp_path / "in.chain").read_text()


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--scheme", "order6", "--tolerance", "1e-8"], "tolerance and scheme are both given"),
        (["--particles", "0"], "particles is 0"),
        (["--engine", "reference"], "No such option"),
        (["absent.toml"], "cannot read the scene file"),
    ],
)
def test_bad_input_is_status_2_and_one_line(chaincor, tmp_path, options, line):
    status, out, err = chaincor("inputs", *options, "-o", str(tmp_path / "job"))
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert line in err
    assert not (tmp_path / "job").exists()


def test_a_folder_is_needed(chaincor):
    status, _, err = chaincor("inputs")
    assert status == 2
    assert "-o" in err


def test_a_job_in_the_way_is_kept_unless_forced(chaincor, tmp_path):
    arguments = ["inputs", "--potential", "harmonic", "-o", str(tmp_path)]
    assert chaincor(*arguments, "--particles", "4")[0] == 0
    status, _, err = chaincor(*arguments, "--particles", "5")
    assert status == 2
    assert "--force" in err
    assert chaincor(*arguments, "--particles", "5", "--force")[0] == 0
    assert "5 atoms" in (tmp_path / "chain.data").read_text()
