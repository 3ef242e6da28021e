"""Test a whole study of a chain so short that it takes seconds."""

import csv
import json
import math

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.tradeoff import study as study_module
from chaincor.workflows.tradeoff.front import describe_setting
from chaincor.workflows.tradeoff.shown import describe_study, to_dict, write_study
from chaincor.workflows.tradeoff.study import bare_scene, tradeoff
from tests.page_checks import check_file_list, read_page, words_of


@pytest.fixture(scope="module")
def heard():
    return []


@pytest.fixture(scope="module")
def study(heard):
    scene = Scene(particles=5, tolerance=1e-7, engine="reference")
    # A study leaves out settings for which it has no time. An idle machine needs two seconds. The
    # study here gets ten minutes, so that a busy machine leaves out nothing.
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_module, "QUICK", (600.0, 600.0))
        return tradeoff(scene, quick=True, progress=lambda *said: heard.append(said))


@pytest.mark.slow
def test_the_truth_has_a_bar_far_below_what_is_measured(study):
    assert study.reference.restitution_error < 1e-12
    assert study.reference.last_contact_time_error < 1e-9
    best = min(m.rms_error for m in study.measurements if not m.failure)
    assert study.reference.restitution_error < best


@pytest.mark.slow
def test_progress_goes_from_nothing_to_all(study, heard):
    assert study.measurements
    done = [fraction for _, fraction in heard]
    assert done == sorted(done)
    assert (done[0], done[-1]) == (0.0, 1.0)
    assert len(done) > 20


@pytest.mark.slow
def test_the_stock_wall_is_shown_with_its_phases_and_loses(study):
    stock = [m for m in study.measurements if m.setting.wall == "reflect"]
    assert all(len(m.errors) == 8 for m in stock)
    assert all(m.median_error <= m.worst_error and m.rms_error <= m.worst_error for m in stock)
    verlet = [
        m for m in study.measurements if m.setting.scheme == "verlet" and m.setting.wall == "event"
    ]
    finest = min(verlet, key=lambda m: m.setting.timestep)
    assert min(m.worst_error for m in stock) > 10.0 * finest.worst_error


@pytest.mark.slow
def test_steps_of_order_eight_converge_as_they_should(study):
    errors = {
        m.setting.timestep: m.median_error
        for m in study.measurements
        if m.setting.engine == "reference" and m.setting.scheme == "order8"
    }
    steps = sorted(errors, reverse=True)
    slope = math.log2(errors[steps[1]] / errors[steps[2]])
    # Contacts have other phases at each step, so that the slope gives the order within two.
    assert 6.0 < slope < 10.5


@pytest.mark.slow
def test_the_advice_is_for_the_scenes_tolerance(study):
    assert study.advice.startswith("1e-07 costs ")
    text = describe_study(study)
    assert f"advice: {study.advice}" in text
    assert max(map(len, text.splitlines())) <= 100
    # The study chooses engine and numerics, so that its scene has none.
    assert study.scene == bare_scene(Scene(particles=5))


@pytest.mark.slow
def test_files_hold_what_was_measured(study, tmp_path):
    write_study(study, tmp_path / "out")
    plain = json.loads((tmp_path / "out" / "tradeoff.json").read_text())
    measured = json.loads(json.dumps(to_dict(study), allow_nan=False))
    # Only the file has the keys that every object has.
    assert {key: plain[key] for key in measured} == measured
    assert set(plain) - set(measured) == {"schema", "processor", "scene"}
    assert plain["versions"]["lammps"]
    with (tmp_path / "out" / "work_precision.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(study.measurements)
    front = [row for row in rows if row["on_front"] == "True"]
    assert front
    for column in ("rms_error", "worst_error", "contact_time_error", "mode_energy_error"):
        assert all(float(row[column]) >= 0.0 for row in front)
    for name in ("work_precision", "error_budget", "tables"):
        for ending in ("png", "svg"):
            assert (tmp_path / "out" / f"{name}.{ending}").stat().st_size > 5000
    page = read_page(tmp_path / "out" / "tradeoff.html")
    check_file_list(page, tmp_path / "out", beside={"tradeoff.html"})
    with pytest.warns(DeprecationWarning, match="reference"):
        assert study.truth is study.reference
    printed = words_of(page)
    assert f"{study.reference.restitution_error:.0e}".replace("e-", "e−") in printed
    assert all(
        describe_setting(row.setting) in printed for rows in study.cheapest.values() for row in rows
    )
    assert study.scene.sha256 in page


def test_the_command_prints_the_advice_and_writes_the_files(tmp_path, chaincor, monkeypatch):
    monkeypatch.setattr(study_module, "QUICK", (0.5, 1.0))
    words = ("--quick", "--particles", "3", "-o", tmp_path / "out", "--json")
    status, out, err = chaincor("tradeoff", *words)
    assert status == 0, err
    # A busy machine measures too few settings in these seconds to reach the tolerance.
    advice = json.loads(out)["advice"]
    assert " costs " in advice or "no measured setting has an error of" in advice
    assert (tmp_path / "out" / "work_precision.png").exists()


@pytest.mark.slow
def test_calibration_goes_to_the_users_settings(tmp_path, chaincor, monkeypatch):
    from chaincor.workflows.accuracy import cost_model

    path = tmp_path / "settings" / "cost_model.json"
    monkeypatch.setattr(cost_model, "user_cost_model_path", lambda: path)
    status, out, err = chaincor("tradeoff", "--calibrate")
    assert status == 0, err
    assert str(path) in out + err
    assert json.loads(path.read_text())["stage"] > 0.0
