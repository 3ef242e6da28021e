"""Test that jobs for `lmp -in` are complete and equal the run from Python."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chaincor.analysis.collision_frames import Known
from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.frame_analysis import analyze_frames
from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows import scripted as plan
from chaincor.workflows.accuracy.pilot_run import usual_pilot_run
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.ending import argue_end
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps.kept_script import time_after_last_contact
from chaincor.workflows.errors import RunError
from chaincor.workflows.grids.grid import write_grid
from chaincor.workflows.job import write_job
from tests.lmp import number, run_lmp, unexpected_warnings


def from_python(scene):
    """Run the numerics of the job with its table in the engine."""
    numerics = Numerics.from_scene(scene)
    scouting = usual_pilot_run(scene.problem, time_after_last_contact(scene.problem))
    if scouting is not None:
        numerics = replace(numerics, bond_range=scouting.table_range())
    return lammps.run(scene.problem, numerics)


SCENES = [
    {"potential": "harmonic", "particles": 10, "velocity": 0.1},
    {"potential": "lj", "particles": 10, "speed": 0.4},
    {"potential": "lj", "particles": 20, "speed": 1.5},  # breaks apart
    {"potential": "toda", "particles": 12, "speed": 0.5, "table": "linear"},
    {"potential": "log", "particles": 8, "speed": 0.6},
    {"potential": "power", "power_order": 3, "power_c": -1.0, "particles": 9, "speed": 0.1},
    {"potential": "lj", "particles": 2, "speed": 0.2},
]


@pytest.mark.slow_cases
@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize("fields", SCENES, ids=lambda f: f"{f['potential']}-{f['particles']}")
def test_lmp_alone_gives_what_python_gives(fields, wall, tmp_path):
    scene = Scene(wall=wall, scheme="verlet", timestep=0.0125, **fields)
    write_job(scene, tmp_path, guards=True, contacts=True)
    done = run_lmp(tmp_path)
    assert done.returncode == 0, done.stdout[-2000:]
    assert unexpected_warnings(done.stdout) == []
    outcome = from_python(scene)
    eta = restitution(outcome.velocities, scene.impact_velocity)
    assert number(done.stdout, "restitution") == pytest.approx(eta, abs=1e-12)
    assert number(done.stdout, "contacts") == len(outcome.contact_times)
    # LAMMPS adds up its time step by step, with 1e4 rounding errors of 1e-16 times 50.
    last = outcome.contact_times[-1]
    assert number(done.stdout, "last_contact_time") == pytest.approx(last, abs=1e-10)
    contacts = np.loadtxt(tmp_path / "contacts.txt", skiprows=1, ndmin=2)
    assert contacts[:, 1] == pytest.approx(outcome.contact_times, abs=1e-10)
    assert contacts[:, 2] == pytest.approx(outcome.contact_speeds, abs=1e-11)
    # The impulse of the wall equals the change of the chain's momentum.
    given, got = number(done.stdout, "wall_impulse"), number(done.stdout, "momentum_change")
    scale = scene.particles * scene.impact_velocity
    assert abs(given - got) <= 1e-12 * scale


LINES = [
    {"potential": "harmonic", "particles": 10, "masses": (1, 3)},
    {"potential": "lj", "particles": 6, "target_particles": 8, "masses": (2, 1)},
    {"potential": "toda", "particles": 5, "target_particles": 1, "target_masses": (5,)},
    {"potential": "lj", "particles": 8, "contact": "power", "contact_stiffness": 20.0},
    {"potential": "lj", "particles": 5, "target_particles": 3, "contact": "power"},
    {"potential": "lj", "particles": 6, "contact": "power", "contact_exponent": 2.0},
    {"potential": "lj", "particles": 6, "compression": 0.02},
    {"potential": "lj", "particles": 6, "initial": True, "target_particles": 2},
    {"potential": "lj", "particles": 6, "initial": True},
    {"potential": "lj", "particles": 6, "initial": True, "wall": "reflect"},
    {"potential": "lj", "particles": 6, "masses": (1, 3), "wall": "reflect"},
]


def line_scene(fields, folder):
    """Return a scene; one with an initial state has a gap and unequal velocities."""
    fields = dict(fields)
    if fields.pop("initial", False):
        path = folder / "state.csv"
        rows = [f"{0.3 if i == 0 else 0.01 * (i % 3)},{-0.05 - 0.01 * (i % 2)}" for i in range(6)]
        path.write_text("\n".join(["strain,velocity", *rows]))
        return Scene(initial=path, scheme="verlet", timestep=0.0125, **fields)
    return Scene(velocity=0.05, scheme="verlet", timestep=0.0125, **fields)


@pytest.mark.slow_cases
@pytest.mark.parametrize("fields", LINES, ids=lambda f: "-".join(map(str, f.values())))
def test_lmp_alone_gives_what_python_gives_for_two_bodies(fields, tmp_path):
    scene = line_scene(fields, tmp_path)
    write_job(scene, tmp_path / "job", dump=True, explain=True, guards=True, contacts=True)
    done = run_lmp(tmp_path / "job")
    assert done.returncode == 0, done.stdout[-2000:]
    assert unexpected_warnings(done.stdout) == []
    outcome = from_python(scene)
    assert number(done.stdout, "restitution") == pytest.approx(outcome.eta, abs=1e-12)
    contacts = np.loadtxt(tmp_path / "job" / "contacts.txt", skiprows=1, ndmin=2)
    assert contacts[:, 1] == pytest.approx(outcome.contact_times, abs=1e-10)
    assert contacts[:, 2] == pytest.approx(outcome.contact_speeds, abs=1e-11)
    assert number(done.stdout, "last_contact_time") == pytest.approx(contacts[-1, 1], rel=1e-15)
    given, got = number(done.stdout, "wall_impulse"), number(done.stdout, "momentum_change")
    assert given == pytest.approx(got, rel=1e-12)
    assert np.sum(outcome.impulses) == pytest.approx(given, rel=1e-10)


def test_a_job_with_a_target_runs_slower_chains_on_request(tmp_path):
    scene = line_scene(LINES[1], tmp_path)
    write_job(scene, tmp_path / "job")
    done = run_lmp(tmp_path / "job", "-var", "velocity", "0.03")
    slower = scene.replace(velocity=0.03)
    table = usual_pilot_run(scene.problem, time_after_last_contact(scene.problem)).table_range()
    outcome = lammps.run(slower.problem, replace(Numerics.from_scene(slower), bond_range=table))
    # The job follows bonds for slightly longer, and its table covers this time.
    eta = outcome.eta
    assert number(done.stdout, "restitution") == pytest.approx(eta, abs=1e-10)


def test_a_job_whose_chain_has_its_own_velocities_takes_no_other(tmp_path):
    write_job(line_scene(LINES[7], tmp_path), tmp_path / "job", guards=True)
    done = run_lmp(tmp_path / "job", "-var", "velocity", "0.03")
    assert done.returncode == 1
    assert "OTHER VELOCITY" in done.stdout
    write_job(line_scene(LINES[7], tmp_path), tmp_path / "bare")
    done = run_lmp(tmp_path / "bare", "-var", "velocity", "0.03")
    assert done.returncode == 1
    assert "restitution =" not in done.stdout


def test_a_job_sees_what_else_acts_on_its_target(tmp_path):
    write_job(line_scene(LINES[1], tmp_path), tmp_path / "job", guards=True)
    script = tmp_path / "job" / "in.chain"
    push = "fix             other target addforce 1e-5 0.0 0.0\nfix             motion"
    script.write_text(script.read_text().replace("fix             motion", push, 1))
    done = run_lmp(tmp_path / "job")
    assert done.returncode == 1
    assert "UNBALANCED: the target gave" in done.stdout


def test_a_kept_run_of_two_bodies_is_a_job(tmp_path):
    scene = line_scene(LINES[4], tmp_path).replace(save=tmp_path / "kept")
    outcome = lammps.run(scene.problem, Numerics.from_scene(scene), files=scene.run_files)
    done = run_lmp(tmp_path / "kept")
    assert done.returncode == 0, done.stdout[-2000:]
    # The saved script has its own table.
    assert number(done.stdout, "restitution") == pytest.approx(outcome.eta, abs=1e-10)


@pytest.mark.slow
def test_a_late_contact_is_waited_for(tmp_path):
    # Contact 27 comes at t = 38.809, after a silence in which a piece of nine particles vibrates.
    scene = Scene(particles=28, speed=1.47, scheme="verlet", timestep=0.002)
    write_job(scene, tmp_path)
    done = run_lmp(tmp_path)
    assert done.returncode == 0, done.stdout[-2000:]
    assert number(done.stdout, "contacts") == 27
    # Errors of Verlet grow in the collision, here from 1e-6 to 1e-4.
    assert number(done.stdout, "restitution") == pytest.approx(0.80498439256, abs=1e-3)
    assert number(done.stdout, "last_contact_time") == pytest.approx(38.808724, abs=1e-2)
    assert re.search(
        r"^ending = silence; the reference run had 27 contacts, the last at 38\.80\d*, "
        r"end (proved|argued)$",
        done.stdout,
        re.MULTILINE,
    )


def test_no_end_is_seen_before_the_scouted_one(tmp_path):
    scene = Scene(potential="harmonic", particles=5, velocity=0.1, scheme="verlet")
    write_job(scene, tmp_path, dump=True)
    script = tmp_path / "in.chain"
    early, late = re.search(r"\(time-([0-9.]+)\*", script.read_text())[1], "123.0"
    script.write_text(script.read_text().replace(f"(time-{early}*", f"(time-{late}*"))
    assert run_lmp(tmp_path).returncode == 0
    *_, last = Dump(tmp_path / "dump.lammpstrj")
    assert last.step * Numerics.from_scene(scene).timestep > 123.0


def test_a_job_that_was_not_scouted_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(plan, "usual_pilot_run", lambda *_: None)
    write_job(Scene(particles=10, speed=0.4, scheme="verlet"), tmp_path)
    done = run_lmp(tmp_path)
    assert done.returncode == 0
    assert re.search("^ending = silence alone: no reference run could tell", done.stdout, re.M)
    assert "# No reference run could tell" in (tmp_path / "in.chain").read_text()


@pytest.mark.slow
@pytest.mark.parametrize("wall", ["event", "reflect"])
def test_lmp_alone_with_a_hundred_particles(wall, tmp_path):
    test_lmp_alone_gives_what_python_gives(
        {"potential": "lj", "particles": 100, "speed": 0.4}, wall, tmp_path
    )


def test_the_job_is_complete(tmp_path):
    files = write_job(Scene(particles=5), tmp_path / "new" / "job")
    assert [file.name for file in files] == ["in.chain", "chain.data", "bond.table", "scene.toml"]
    assert sorted(tmp_path.joinpath("new", "job").iterdir()) == sorted(files)
    again = Scene.from_file(files[-1])
    assert (again.particles, again.scheme, again.tolerance) == (5, "order8", None)


def test_jobs_before_a_hard_wall_use_no_function_that_releases_of_2022_lack(tmp_path):
    write_job(Scene(particles=5), tmp_path / "job")
    assert "ternary(" not in (tmp_path / "job" / "in.chain").read_text()


def test_a_harmonic_job_needs_no_table(tmp_path):
    files = write_job(Scene(potential="harmonic", particles=5), tmp_path)
    assert "bond.table" not in [file.name for file in files]


def test_the_motion_is_dumped_on_request(tmp_path):
    write_job(Scene(potential="harmonic", particles=5, velocity=0.1), tmp_path, dump=True)
    assert run_lmp(tmp_path).returncode == 0
    text = (tmp_path / "dump.lammpstrj").read_text()
    assert "ITEM: ATOMS id type x y z vx vy vz v_displacement v_time" in text
    assert text.count("ITEM: TIMESTEP") > 20


@pytest.mark.parametrize("wall", ["event", "reflect"])
def test_the_motion_is_dumped_at_contacts_on_request(wall, tmp_path):
    scene = Scene(potential="lj", particles=10, wall=wall, scheme="verlet", dump_frames="contacts")
    write_job(scene, tmp_path, dump=True, contacts=True)
    done = run_lmp(tmp_path)
    assert done.returncode == 0
    frames = Dump(tmp_path / "dump.lammpstrj")
    found = analyze_frames(frames, Known(bond=scene.bond, end_argument=argue_end))
    times, speeds = np.loadtxt(tmp_path / "contacts.txt", usecols=(1, 2), skiprows=1, unpack=True)
    if wall == "event":
        # LAMMPS wrote each with 17 digits.
        np.testing.assert_allclose(found.contact_times, times, rtol=1e-15)
        np.testing.assert_allclose(found.contact_speeds, speeds, rtol=1e-12)
    assert found.frames == times.size + 2
    assert found.ending is not None
    eta = float(re.search(r"^restitution = (\S+)", done.stdout, re.MULTILINE)[1])
    assert found.restitution == pytest.approx(eta, rel=1e-12)


def test_a_users_table_is_found_from_the_job(tmp_path, monkeypatch):
    rows = "\n".join(f"{k} {0.5 + 0.01 * k} 0 {0.5 - 0.01 * k}" for k in range(101))
    (tmp_path / "own.table").write_text(f"OWN\nN 101\n\n{rows}\n")
    monkeypatch.chdir(tmp_path)
    write_job(
        Scene(potential="table", bond_file="own.table", particles=4, velocity=0.05), Path("job")
    )
    assert Scene.from_file("job/scene.toml").bond.stiffness == pytest.approx(1.0)


def test_a_users_state_is_found_from_the_job_from_a_grid_and_from_a_kept_run(tmp_path, monkeypatch):
    (tmp_path / "state.csv").write_text("strain,velocity\n0.3,-0.1\n0.01,-0.12\n-0.02,-0.08\n")
    monkeypatch.chdir(tmp_path)
    scene = Scene(potential="toda", particles=3, initial="state.csv")
    write_job(scene, Path("job"))
    write_grid([scene], ["particles"], Path("grid"))
    lammps.run(scene.problem, Numerics(), files=scene.replace(save=Path("kept")).run_files)
    written = [path for name in ("job", "grid", "kept") for path in Path(name).rglob("*.toml")]
    assert len(written) == 4
    for path in written:
        np.testing.assert_array_equal(Scene.from_file(path).line.strains, scene.line.strains)


def test_an_unfinished_job_fails(tmp_path):
    write_job(Scene(potential="harmonic", particles=10, velocity=0.1), tmp_path)
    script = tmp_path / "in.chain"
    late, early = re.search(r"if \"\$\(time\) > (\S+)\"", script.read_text())[1], "5.0"
    script.write_text(script.read_text().replace(f"$(time) > {late}", f"$(time) > {early}"))
    done = run_lmp(tmp_path)
    assert done.returncode == 1
    assert "UNFINISHED" in done.stdout


@pytest.mark.slow_cases
@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize("fields", [SCENES[0], SCENES[1]], ids=["harmonic", "lj"])
def test_a_job_runs_slower_chains_on_request(fields, wall, tmp_path):
    scene = Scene(wall=wall, scheme="verlet", timestep=0.0125, **fields)
    write_job(scene, tmp_path)
    slower = scene.replace(speed=None, velocity=0.6 * scene.impact_velocity)
    done = run_lmp(tmp_path, "-var", "velocity", repr(slower.impact_velocity))
    assert done.returncode == 0, done.stdout[-2000:]
    assert "ending = silence alone: no reference run was made at this velocity" in done.stdout
    # The table is that of the job.
    scouting = usual_pilot_run(scene.problem, time_after_last_contact(scene.problem))
    numerics = replace(Numerics.from_scene(slower), bond_range=scouting.table_range())
    outcome = lammps.run(slower.problem, numerics)
    eta = restitution(outcome.velocities, slower.impact_velocity)
    # The steps are the same. The job's table differs, because it covers a slightly longer time.
    assert number(done.stdout, "restitution") == pytest.approx(eta, abs=1e-10)
    assert number(done.stdout, "contacts") == len(outcome.contact_times)


@pytest.mark.slow_cases
@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize("fields", [SCENES[0], SCENES[1]], ids=["harmonic", "lj"])
@pytest.mark.slow
def test_a_job_takes_other_steps_on_request(fields, wall, tmp_path):
    """Require the results of a job that was made with this step, up to rounding, and its dump."""
    scene = Scene(wall=wall, scheme="verlet", timestep=0.0125, **fields)
    other = 1.0 / 150.0  # a step of 17 digits, none of which may be lost
    write_job(scene, tmp_path / "asked", dump=True)
    write_job(scene.replace(timestep=other), tmp_path / "made", dump=True)
    asked = run_lmp(tmp_path / "asked", "-var", "timestep", repr(other))
    made = run_lmp(tmp_path / "made")
    assert asked.returncode == 0, asked.stdout[-2000:]
    for name in ("restitution", "contacts", "last_contact_time"):
        assert number(asked.stdout, name) == pytest.approx(number(made.stdout, name), rel=1e-12)
    dumps = [Dump(tmp_path / name / "dump.lammpstrj") for name in ("asked", "made")]
    steps = [[frame.step for frame in dump] for dump in dumps]
    assert steps[0] == steps[1]
    # A job at another step gives another result, so that the option has an effect.
    usual = number(run_lmp(tmp_path / "made", "-var", "timestep", "0.0125").stdout, "restitution")
    assert abs(usual - number(made.stdout, "restitution")) > 1e-9


@pytest.mark.parametrize("step", ["1.0", "7", "0", "-0.01", "1e-10"])
def test_a_job_refuses_senseless_steps_by_name(step, tmp_path):
    write_job(Scene(particles=5, velocity=0.05, scheme="verlet"), tmp_path, guards=True)
    done = run_lmp(tmp_path, "-var", "timestep", step)
    assert done.returncode == 1
    assert f"NO STEP: the timestep is {step}; give one from 1e-09 to below 1.0" in done.stdout
    assert "restitution =" not in done.stdout


def test_a_job_refuses_faster_chains_by_name(tmp_path):
    write_job(Scene(particles=5, velocity=0.05, scheme="verlet"), tmp_path, guards=True)
    done = run_lmp(tmp_path, "-var", "velocity", "0.0500001")
    assert done.returncode == 1
    assert "TOO FAST: this job is made for velocities up to 0.05:" in done.stdout
    assert "restitution =" not in done.stdout


@pytest.mark.parametrize("name", ["speed", "dt"])
def test_a_guarded_job_refuses_names_that_it_does_not_know(name, tmp_path):
    write_job(Scene(particles=3, velocity=0.05, scheme="verlet"), tmp_path, guards=True)
    done = run_lmp(tmp_path, "-var", name, "0.01")
    assert done.returncode == 1
    assert "UNKNOWN NAME" in done.stdout
    assert "restitution =" not in done.stdout


@pytest.mark.parametrize("name", ["velocity", "timestep"])
def test_a_job_refuses_text_by_the_name_of_what_it_stands_for(name, tmp_path):
    write_job(Scene(particles=5, velocity=0.05, scheme="verlet"), tmp_path, guards=True)
    done = run_lmp(tmp_path, "-var", name, "abc")
    assert done.returncode == 1
    assert re.search(f"ERROR: Variable {name}_must_be_a_number: ", done.stdout)
    assert "restitution =" not in done.stdout


@pytest.mark.parametrize("scheme", ["verlet", "order6"])
def test_no_job_has_a_restitution_for_a_chain_that_flies_away(scheme, tmp_path):
    scene = Scene(potential="harmonic", particles=3, velocity=0.05, scheme=scheme, error=False)
    for guards, said in ((True, "NO VELOCITY: the velocity is -0.05; give one"), (False, ":")):
        write_job(scene, tmp_path, guards=guards, replace_existing=True)
        done = run_lmp(tmp_path, "-var", "velocity", "-0.05")
        assert done.returncode == 1
        assert said in done.stdout
        assert "restitution =" not in done.stdout


def test_a_faster_harmonic_chain_is_refused_without_guards_too(tmp_path):
    # Particles of a harmonic chain may pass through each other, which LAMMPS does not report.
    scene = Scene(potential="harmonic", particles=5, velocity=0.1, scheme="verlet")
    write_job(scene, tmp_path)
    done = run_lmp(tmp_path, "-var", "velocity", "0.9")
    assert done.returncode == 1
    assert "TOO FAST" in done.stdout
    assert "restitution =" not in done.stdout


MEDDLING = {
    # This changes the velocity by which the result is divided, but not the velocity of the chain.
    "velocity": (
        "run             0 post no",
        "variable velocity delete\nvariable velocity equal 0.03\n{}",
    ),
    "langevin": ("fix             motion", "fix heat all langevin 1e-6 1e-6 1000.0 4711\n{}"),
    "drag": ("fix             motion", "fix drag all langevin 0.0 0.0 100.0 4711\n{}"),
    "gravity": ("fix             motion", "fix fall all addforce -1e-5 0.0 0.0\n{}"),
}


@pytest.mark.parametrize("where", MEDDLING)
def test_what_the_wall_does_not_explain_has_no_restitution(where, tmp_path):
    # With the event wall, LAMMPS itself refuses Langevin forces, which are nan for a step of 0.
    wall = "reflect" if "langevin" in MEDDLING[where][1] else "event"
    scene = Scene(potential="harmonic", particles=10, velocity=0.1, wall=wall, scheme="verlet")
    write_job(scene, tmp_path, guards=True)
    script = tmp_path / "in.chain"
    line, meddled = MEDDLING[where]
    text = script.read_text()
    assert text.count(line) == 1
    script.write_text(text.replace(line, meddled.format(line)))
    done = run_lmp(tmp_path)
    assert done.returncode == 1
    assert "restitution =" not in done.stdout
    assert re.search("^UNBALANCED: the wall gave [0-9.]+, the chain got", done.stdout, re.MULTILINE)


KEPT = [
    {"potential": "harmonic", "particles": 10, "velocity": 0.1},
    {"potential": "lj", "particles": 10, "speed": 0.4},
    {"potential": "lj", "particles": 20, "speed": 1.5},  # breaks apart: two tables in the engine
    {"potential": "lj", "particles": 12, "speed": 0.4, "scheme": "verlet", "timestep": 0.01},
    {"potential": "lj", "particles": 12, "speed": 0.4, "wall": "reflect", "timestep": 0.01},
    {"potential": "lj", "particles": 1, "speed": 0.4},
]


@pytest.mark.slow
@pytest.mark.parametrize("fields", KEPT, ids=str)
def test_what_is_kept_of_a_run_is_a_job(fields, tmp_path):
    folder = tmp_path / "job"
    result = collide(Scene(**fields, save=folder, arrays=tmp_path / "a.npz"))
    names = {file.name for file in folder.iterdir()}
    table = set() if result.table is None else {"bond.table"}
    assert names == {"in.chain", "chain.data", "scene.toml", "log.lammps"} | table
    done = run_lmp(folder)
    assert done.returncode == 0, done.stdout[-2000:]
    # For Verlet, steps and table are the same. For other schemes, the number of force evaluations
    # is the same. The error is then that of Verlet, below 1e-3 at steps of up to 0.0125 (see
    # numerics.md).
    close = 1e-11 if fields.get("timestep") else 1e-3
    assert number(done.stdout, "restitution") == pytest.approx(result.restitution, abs=close)
    again = Scene.from_file(folder / "scene.toml")
    assert again == Scene(**fields)


def test_what_is_kept_of_a_failed_run_can_be_looked_into(tmp_path):
    scene = Scene(particles=10, speed=1.5, scheme="verlet", timestep=0.9, save=tmp_path / "job")
    with pytest.raises(RunError):
        collide(scene)
    assert (tmp_path / "job" / "scene.toml").exists()
    assert "LAMMPS" in (done := run_lmp(tmp_path / "job")).stdout
    assert done.returncode != 0
    assert "ERROR" in done.stdout


def test_a_job_is_not_overwritten_unasked(tmp_path):
    write_job(Scene(potential="harmonic", particles=5), tmp_path)
    with pytest.raises(InputError, match=r"has in\.chain, chain\.data, .*replace_existing=True"):
        write_job(Scene(potential="harmonic", particles=6), tmp_path)
    assert "chain of 5 particles" in (tmp_path / "in.chain").read_text()
    write_job(Scene(potential="harmonic", particles=6), tmp_path, replace_existing=True)
    assert "chain of 6 particles" in (tmp_path / "in.chain").read_text()


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InputError, match="cannot write the job into"):
        write_job(Scene(potential="harmonic", particles=5), tmp_path / "file" / "job")


def test_a_full_disk_leaves_no_half_of_a_job_or_grid(small_disk):
    # The table takes more than the 300 kB of the disk.
    scene = Scene(particles=3, scheme="verlet", timestep=0.01, table_points=20_001)
    with pytest.raises(InputError, match=r"cannot write the job into .*No space left"):
        write_job(scene, small_disk / "jobs" / "one")
    with pytest.raises(InputError, match=r"cannot write the job.*No space left"):
        write_grid([Scene(particles=2), scene], ["particles"], small_disk / "grid")
    assert list(small_disk.iterdir()) == []


def test_write_job_names_arguments_of_python(tmp_path):
    scene = Scene(particles=5, dump_frames=9)
    with pytest.raises(InputError, match="Add dump=True") as refused:
        write_job(scene, tmp_path / "a")
    assert "--" not in str(refused.value)
    with pytest.raises(InputError, match="Leave plain=True out"):
        write_job(Scene(particles=5, target_particles=5), tmp_path / "a", plain=True)
    with pytest.raises(InputError, match=r"no argument 'guard'. Use one of plain, .*guards"):
        write_job(Scene(particles=5), tmp_path / "a", guard=True)
