"""Test the output of jobs with composed steps or a tolerance, run by `lmp` alone."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.job_analysis import analyze_job
from chaincor.analysis.job_folder import find_job
from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script_plan import ScriptPlan
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps.kept_script import job_script
from chaincor.workflows.job import write_job
from chaincor.workflows.scripted import interpolated_force_error, plan_script
from tests.lmp import number, run_lmp, unexpected_warnings

SCENES = [
    {"potential": "harmonic", "particles": 10, "velocity": 0.1, "scheme": "order4"},
    {"potential": "lj", "particles": 10, "speed": 0.4, "scheme": "order8"},
    {"potential": "toda", "particles": 2, "speed": 0.5, "scheme": "order6"},
    {"potential": "lj", "particles": 20, "speed": 1.5, "timestep": 0.06, "scheme": "order8"},
    {"potential": "lj", "particles": 1, "speed": 0.4, "scheme": "order4"},
    {"potential": "lj", "particles": 6, "masses": (2, 1), "target_particles": 8, "velocity": 0.05},
    {"potential": "lj", "particles": 6, "compression": 0.02, "velocity": 0.05},
    {"potential": "lj", "particles": 8, "contact": "power", "velocity": 0.05},
    {"potential": "lj", "particles": 5, "contact": "power", "contact_exponent": 2, "speed": 0.4},
    {"potential": "lj", "particles": 5, "contact": "power", "target_particles": 3, "speed": 0.2},
]


def from_python(scene, monkeypatch):
    """Run the numerics of the job with its own table in the engine."""
    plan = plan_script(scene)
    monkeypatch.setattr(lammps, "tabulate_near_and_far", lambda *_: plan.table)
    monkeypatch.setattr(lammps, "_unsure_end", lambda *_: 0.0)
    return lammps.run(scene.problem, plan.numerics)


@pytest.mark.slow_cases
@pytest.mark.parametrize("fields", SCENES, ids=lambda f: "-".join(map(str, f.values())))
def test_lmp_alone_gives_what_the_engine_gives(fields, tmp_path, monkeypatch):
    scene = Scene(**({"scheme": "order6"} | fields))
    write_job(scene, tmp_path, contacts=True)
    done = run_lmp(tmp_path)
    assert done.returncode == 0, done.stdout[-2000:]
    assert unexpected_warnings(done.stdout) == []
    outcome = from_python(scene, monkeypatch)
    # The steps have the same size but end at other places before a contact. Each result has its own
    # error.
    error = number(done.stdout, "restitution_error")
    assert number(done.stdout, "restitution") == pytest.approx(outcome.eta, abs=2.0 * error)
    assert error < 1e-3
    contacts = np.loadtxt(tmp_path / "contacts.txt", skiprows=1, ndmin=2)
    assert contacts[:, 1] == pytest.approx(outcome.contact_times, abs=1e-3)
    assert contacts[:, 2] == pytest.approx(outcome.contact_speeds, abs=1e-4)


TOLERANCES = [
    ({"potential": "lj", "particles": 10, "speed": 0.4}, 1e-8),
    ({"potential": "harmonic", "particles": 20, "velocity": 0.1}, 1e-9),
    ({"potential": "toda", "particles": 5, "speed": 0.8}, 1e-4),  # Verlet steps
    ({"potential": "log", "particles": 8, "speed": 0.5}, None),  # the default scheme
]


@pytest.mark.slow_cases
@pytest.mark.parametrize(("fields", "tolerance"), TOLERANCES, ids=str)
def test_a_job_proves_its_number(fields, tolerance, tmp_path, monkeypatch):
    scene = Scene(**fields, tolerance=tolerance)
    write_job(scene, tmp_path)
    done = run_lmp(tmp_path)
    assert done.returncode == 0, done.stdout[-2000:]
    eta, error = number(done.stdout, "restitution"), number(done.stdout, "restitution_error")
    exact = collide(Scene(**fields, engine="reference", tolerance=1e-11))
    assert abs(eta - exact.restitution) <= error + exact.restitution_error
    assert 0.05 * (tolerance or 1e-6) < error <= (tolerance or 1e-6)
    assert eta == pytest.approx(from_python(scene, monkeypatch).eta, abs=2.0 * error)
    # The scene beside the script has the same steps and the same number of rows.
    again, plan = Scene.from_file(tmp_path / "scene.toml"), plan_script(scene)
    numerics = Numerics.from_scene(again)
    assert (numerics.scheme, numerics.timestep) == (plan.numerics.scheme, plan.numerics.timestep)
    assert numerics.table_points == (None if plan.table is None else plan.table.rows)


@pytest.mark.slow_cases
@pytest.mark.parametrize(
    "given", [{"scheme": "order6"}, {"wall": "reflect"}, {"scheme": "verlet", "timestep": 0.02}]
)
def test_explicit_numerics_are_proved_as_the_engine_proves_them(given, tmp_path):
    scene = Scene(particles=8, speed=0.4, **given)
    write_job(scene, tmp_path)
    printed = number(run_lmp(tmp_path).stdout, "restitution_error")
    # The tables differ slightly, because the script's table must cover the flight after the
    # collision. Verlet steps are those of the engine, but composed steps end at other places before
    # a contact.
    close = 1e-3 if given.get("scheme") != "order6" else 1.0
    assert printed == pytest.approx(collide(scene).restitution_error, rel=close)


@pytest.mark.parametrize("style", ["spline", "linear"])
def test_the_error_of_a_table_is_printed_without_lammps(style):
    scene = Scene(particles=3, speed=0.4)
    numerics = Numerics(
        scheme="order6", timestep=0.1, table=style, table_points=300, bond_range=(0.9, 1.1)
    )
    reported = interpolated_force_error(tabulate(scene.bond, (0.9, 1.1), style, 300), scene.bond)
    certified = lammps.run(scene.problem, numerics).details["table"]["force_error"]
    # The two errors are evaluated at different lengths. Near the steep end, a part of a row
    # matters.
    assert 0.99 * certified <= reported <= 2.0 * certified


def test_another_velocity_has_an_error_of_its_own(tmp_path):
    scene = Scene(particles=8, speed=0.4, tolerance=1e-8)
    write_job(scene, tmp_path)
    velocity = 0.6 * scene.impact_velocity
    done = run_lmp(tmp_path, "-var", "velocity", repr(velocity))
    exact = collide(Scene(particles=8, velocity=velocity, engine="reference", tolerance=1e-11))
    error = number(done.stdout, "restitution_error")
    off = abs(number(done.stdout, "restitution") - exact.restitution)
    assert off <= error + exact.restitution_error
    assert error < 1e-7


def test_another_step_has_an_error_of_its_own(tmp_path):
    write_job(Scene(particles=8, speed=0.4, tolerance=1e-8), tmp_path)
    done = run_lmp(tmp_path, "-var", "timestep", "0.4")
    exact = collide(Scene(particles=8, speed=0.4, engine="reference", tolerance=1e-11))
    off = abs(number(done.stdout, "restitution") - exact.restitution)
    assert 1e-8 < off <= number(done.stdout, "restitution_error")


@pytest.mark.slow
def test_a_late_contact_interrupts_the_silence(tmp_path):
    """Without the reference run, require that Verlet steps during the silence find the contact."""
    scene = Scene(particles=28, speed=1.47, tolerance=1e-6)
    plan = plan_script(scene)
    write_job(scene, tmp_path)
    whole = run_lmp(tmp_path).stdout
    (tmp_path / "in.chain").write_text(
        job_script(scene.problem, ScriptPlan(plan.numerics, plan.table))
    )
    alone = run_lmp(tmp_path).stdout
    assert number(alone, "contacts") == number(whole, "contacts") == 27
    for name in ("restitution", "last_contact_time"):
        assert number(alone, name) == pytest.approx(number(whole, name), abs=1e-9)


def test_composed_steps_are_dumped_at_their_ends(tmp_path):
    scene = Scene(particles=5, speed=0.4, scheme="order8", timestep=0.1, dump_frames=8)
    write_job(scene, tmp_path, dump=True)
    done = run_lmp(tmp_path)
    assert done.returncode == 0
    frames = list(Dump(tmp_path / "dump.lammpstrj"))
    times = [float(f.raw_column(f.columns.index("v_time"))[0]) for f in frames]
    # The frames extend to the last check, and come from a single run.
    assert np.all(np.diff(times) > 0.0)
    assert times[-1] > number(done.stdout, "last_contact_time")
    assert max(np.diff(times)[:-1]) < 5 / 8 + 0.2
    # The log has the restitution of the last frame; each is printed with all digits.
    velocities = frames[-1].raw_column(frames[-1].columns.index("vx")).astype(float)
    eta = (velocities.mean() / scene.impact_velocity) ** 2
    assert eta == pytest.approx(number(done.stdout, "restitution"), rel=1e-14 * len(velocities))


def test_the_dump_of_the_default_job_holds_the_whole_collision(tmp_path):
    # The last contact is in the last composed step but one. The dump must have a frame after this
    # contact.
    write_job(Scene(), tmp_path, dump=True)
    done = run_lmp(tmp_path)
    found = analyze_job(find_job(tmp_path), bond=Scene().bond)
    assert len(found.contact_times) == number(done.stdout, "contacts") == 84
    assert found.restitution == pytest.approx(number(done.stdout, "restitution"), rel=1e-10)


def test_what_else_acts_on_the_chain_is_seen(tmp_path):
    write_job(Scene(particles=5, speed=0.4, scheme="order6"), tmp_path, guards=True)
    script = tmp_path / "in.chain"
    drag = "fix             drag all addforce -1e-5 0.0 0.0\nfix             motion"
    script.write_text(script.read_text().replace("fix             motion", drag, 1))
    done = run_lmp(tmp_path)
    assert done.returncode == 1
    assert "UNBALANCED: the wall gave" in done.stdout
    assert "restitution =" not in done.stdout


def test_the_log_has_the_result_and_not_the_thousands_of_runs(tmp_path):
    write_job(Scene(particles=5, speed=0.4, scheme="order6"), tmp_path)
    done = run_lmp(tmp_path)
    log = (tmp_path / "log.lammps").read_text()
    assert number(log, "restitution") == number(done.stdout, "restitution")
    assert len(log) < 0.2 * len(done.stdout)
    assert re.search(r"^restitution_error = \S+$", log, re.MULTILINE)


def test_extrapolated_steps_are_refused_in_one_line():
    numerics = Numerics(scheme="extrapolated12", timestep=0.5)
    with pytest.raises(SceneError, match=r"steps of verlet, order4, order6, order8\. Give"):
        job_script(Scene(particles=5).problem, ScriptPlan(numerics, None))


def test_steps_that_are_unstable_at_twice_their_length_are_refused(tmp_path):
    write_job(Scene(particles=5, speed=0.4, tolerance=1e-8), tmp_path, guards=True)
    text = (tmp_path / "in.chain").read_text()
    limit = float(re.search(r"\$\{timestep\} >= ([0-9.]+)\)", text)[1])
    heaviest = max(map(abs, map(float, re.findall(r"timestep +\$\(([-0-9.]+)\*v_reach:", text))))
    # The fastest frequency of a chain is 2, for which Verlet steps must be below 1.
    assert limit == pytest.approx(1.0 / (2.0 * heaviest), rel=1e-12)
    done = run_lmp(tmp_path, "-var", "timestep", str(math.nextafter(limit, 1.0)))
    assert done.returncode == 1
    assert "NO STEP" in done.stdout


def test_the_kept_script_of_a_run_takes_its_steps(tmp_path):
    scene = Scene(particles=8, speed=0.4, save=tmp_path / "kept")
    numerics = replace(Numerics(), scheme="order8", timestep=0.1)
    outcome = lammps.run(scene.problem, numerics, files=scene.run_files)
    done = run_lmp(tmp_path / "kept")
    assert number(done.stdout, "restitution") == pytest.approx(outcome.eta, abs=1e-10)
