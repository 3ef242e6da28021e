"""Test ``chaincor run``: the JSON contract, options that override files, one line per error."""

import contextlib
import json
import re
from pathlib import Path

import numpy as np
import pytest

QUICK = ["run", "--potential", "harmonic", "--particles", "5", "--velocity", "0.1"]
CONTRACT = {
    "restitution": float,
    "restitution_error": float,
    "contacts": int,
    "last_contact_time": float,
    "engine": str,
    "wall": str,
    "scheme": str,
    "timestep": float,
    "potential": str,
    "particles": int,
    "velocity": float,
    "v_star": float,
    "bond_min": float,
    "bond_max": float,
    "energy_drift": float,
    "seconds": float,
    "seconds_total": float,
    "versions": dict,
}


def run_json(chaincor, *arguments):
    status, out, err = chaincor(*arguments, "--json")
    assert status == 0, err
    assert out.count("\n") == 1, "one object, on one line"
    return json.loads(out)


def test_a_bare_run(chaincor):
    found = run_json(chaincor, "run")
    assert {name: type(found[name]) for name in CONTRACT} == CONTRACT
    assert (found["potential"], found["particles"], found["engine"]) == ("lj", 100, "lammps")
    assert found["speed"] == pytest.approx(0.4, rel=1e-14)
    assert (found["tolerance"], found["tolerance_met"]) == (1e-6, True)
    # The published value is within the error bar.
    assert found["restitution_error"] <= 1e-6
    assert abs(found["restitution"] - 0.77079983275) <= found["restitution_error"]
    assert found["contacts"] == 84
    assert found["seconds"] < found["seconds_total"]
    assert found["versions"]["lammps"] != "absent"


def test_harmonic_has_no_speed_scale(chaincor):
    found = run_json(chaincor, *QUICK, "--scheme", "order8", "--timestep", "0.1")
    assert found["v_star"] is None
    assert found["speed"] is None
    assert (found["wall"], found["scheme"], found["timestep"]) == ("event", "order8", 0.1)
    assert found["table"] is None


def test_no_error_gives_null(chaincor):
    found = run_json(chaincor, *QUICK, "--timestep", "0.1", "--no-error")
    assert found["restitution_error"] is None
    assert found["error_parts"]["step"] is None


def test_the_error_bar_comes_from_half_the_step(chaincor):
    found = run_json(chaincor, *QUICK, "--scheme", "verlet", "--timestep", "0.05")
    finer = run_json(chaincor, *QUICK, "--scheme", "verlet", "--timestep", "0.025", "--no-error")
    difference = abs(found["restitution"] - finer["restitution"])
    assert found["restitution_error"] >= difference > 0.0


def test_the_reference_engine(chaincor):
    found = run_json(
        chaincor, "run", "--engine", "reference", "--particles", "10", "--speed", "0.4"
    )
    assert found["engine"] == "reference"
    assert found["wall"] == "event"


def test_options_win_over_the_file(chaincor, tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(
        'potential = "toda"\ntoda_b = 5.0\nparticles = 5\nspeed = 0.3\nscheme = "verlet"\n'
    )
    found = run_json(chaincor, "run", str(scene), "--no-error")
    assert (found["potential"], found["particles"]) == ("toda", 5)
    assert found["speed"] == pytest.approx(0.3)
    found = run_json(chaincor, "run", str(scene), "--particles", "4", "--velocity", "0.05")
    assert (found["particles"], found["velocity"]) == (4, 0.05)
    # The potential lj ignores toda_b.
    found = run_json(chaincor, "run", str(scene), "--potential", "lj", "--no-error")
    assert found["potential"] == "lj"


def test_output_for_people(chaincor):
    status, out, _ = chaincor(*QUICK, "--timestep", "0.1")
    assert status == 0
    assert "restitution (energy)   eta = " in out
    assert "+-" in out
    assert "run by lammps: event wall, order6, H = 0.1" in out


def test_arrays_dump_and_save(chaincor, tmp_path):
    arrays, dump, job = tmp_path / "a.npz", tmp_path / "m.dump", tmp_path / "job"
    found = run_json(
        chaincor,
        *QUICK,
        *["--arrays", str(arrays), "--dump", str(dump), "--save", str(job), "--timestep", "0.05"],
    )
    with np.load(arrays) as file:
        assert len(file["contact_times"]) == found["contacts"]
    assert dump.read_text().startswith("ITEM: TIMESTEP")
    assert (job / "chain.data").exists()


def test_a_saved_job_is_analysed_by_the_dump_that_was_asked_for(chaincor, tmp_path):
    saved = [*QUICK, "--scheme", "verlet", "--timestep", "0.05", "--no-error", "--save", "job"]
    with contextlib.chdir(tmp_path):
        found = run_json(chaincor, *saved)
        status, _, err = chaincor("analyze", "job")
        assert status == 2
        hint = re.search(r"'chaincor (run job/scene\.toml --dump job/chain\.dump)'", err)
        assert "its script writes none" in err
        chaincor(*hint[1].split())
        assert json.loads(chaincor("analyze", "job", "--json")[1])["contacts"] == found["contacts"]
        # The dump is written only under the given name.
        chaincor(*saved[:-1], "again", "--dump", "again/x")
        assert [path.name for path in Path("again").glob("*dump*")] == []
        assert json.loads(chaincor("analyze", "again", "--json")[1])["finished"]
        # A job with a dump must be run before `analyze`.
        chaincor("inputs", *QUICK[1:], "--frames", "-o", "unrun")
        err = chaincor("analyze", "unrun")[2]
        assert "in.chain writes one: run it, (cd unrun && lmp -in in.chain)" in err


BAD = [
    (["--particles", "0"], "particles is 0"),
    (["--particles", "ten"], "Invalid value for '--particles'"),
    (["--velocity", "nan"], "velocity is nan"),
    (["--velocity", "-1"], "velocity is -1.0"),
    (["--potential", "mie"], "Invalid value for '--potential'"),
    (["--potential", "formula"], "needs energy"),
    (["--energy", "s^2"], "energy goes with potential 'formula'"),
    (
        ["--potential", "formula", "--energy", "a*s^2", "--parameters", "a=x"],
        "does not give each name one number",
    ),
    (
        ["--potential", "formula", "--energy", "a*s^2", "--parameters", "a=1,a=2"],
        "does not give each name one number",
    ),
    (
        ["--potential", "formula", "--energy", "__import__('os')", "--velocity", "0.1"],
        "has the character",
    ),
    (
        ["--potential", "formula", "--energy", "s^2\nrun 1", "--velocity", "0.1"],
        "has the character '\\n'",
    ),
    (["--potential", "harmonic", "--speed", "0.4"], "give velocity"),
    (["--speed", "0.4", "--velocity", "0.1"], "both given"),
    (["--tolerance", "1e-6", "--timestep", "0.1"], "tolerance and timestep are both given"),
    (["--potential", "power", "--power-order", "3", "--power-c", "1"], "power_c is 1.0"),
    (["--timestep", "5"], "timestep is 5"),
    (["--wall", "reflect", "--scheme", "order8"], "goes with scheme 'verlet'"),
    (["absent.toml"], "cannot read the scene file 'absent.toml'"),
    (["--colour", "red"], "No such option"),
    (["one.toml", "two.toml"], "unexpected extra argument"),
    (["--engine", "reference", "--table", "spline"], "the reference has no tables"),
]


@pytest.mark.parametrize(("options", "line"), BAD, ids=[" ".join(o) for o, _ in BAD])
def test_bad_input_is_status_2_and_one_line(chaincor, options, line):
    status, out, err = chaincor("run", *options)
    assert status == 2
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith("chaincor: ")
    assert line in err


@pytest.mark.parametrize(
    "text", ["particles = ", "particles = -3", "colour = 1", "velocity = inf", '"a.b" = 2']
)
def test_a_bad_scene_file_is_status_2_and_one_line(chaincor, tmp_path, text):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    status, out, err = chaincor("run", str(path))
    assert (status, out, err.count("\n")) == (2, "", 1)


def test_a_failed_run_is_status_1_and_one_line(chaincor):
    arguments = ["--potential", "harmonic", "--velocity", "0.8", "--timestep", "0.05"]
    status, out, err = chaincor("run", *arguments)
    assert (status, out, err.count("\n")) == (1, "", 1)
    assert "pass through each other" in err


def test_a_tolerance_that_rounding_forbids_is_status_1_with_the_number(chaincor):
    # At 1e-8 v*, rounding of LAMMPS's coordinates gives eta an error of about 1e-6.
    arguments = ["--particles", "20", "--speed", "1e-8", "--tolerance", "1e-12", "--json"]
    status, out, err = chaincor("run", *arguments)
    assert status == 1
    found = json.loads(out)
    assert found["tolerance_met"] is False
    assert found["restitution_error"] > 1e-12
    assert err.count("\n") == 1
    assert "rounding" in err
    assert "engine 'reference'" in err


def test_what_would_take_days_is_refused_with_the_estimate(chaincor):
    status, out, err = chaincor("run", "--particles", "1000000")
    assert (status, out) == (2, "")
    assert "1000000 particles would take about" in err
    assert "days on one core, but 24.0 h are allowed" in err
    assert err.rstrip().endswith("(see: chaincor explain CostError)")


def test_a_file_of_another_command_is_named_as_such(chaincor, tmp_path):
    path = tmp_path / "s.toml"
    for text, hint in [
        ("[scene]\nparticles = 3\n", "chaincor sweep FILE"),
        ("[units]\nstyle = 'metal'\n", "chaincor inputs FILE"),
    ]:
        path.write_text(text)
        status, out, err = chaincor("run", str(path))
        assert (status, out, err.count("\n")) == (2, "", 1)
        assert hint in err


def test_a_soft_contact_that_lasts_for_hours_is_foreseen(chaincor):
    soft = ("--engine", "reference", "--particles", "6", "--contact", "power")
    status, _, err = chaincor("run", *soft, "--contact-stiffness", "1e-20", "--most-hours", "0.01")
    assert (status, "CostError" in err) == (2, True)


def test_how_long_a_run_may_take_can_be_said(chaincor):
    status, _, err = chaincor(*QUICK, "--most-hours", "nan")
    assert (status, "nan" in err) == (2, True)
    status, _, err = chaincor(*QUICK, "--most-hours", "1e-9")
    assert (status, "CostError" in err) == (2, True)
    assert chaincor(*QUICK, "--most-hours", "1")[0] == 0
