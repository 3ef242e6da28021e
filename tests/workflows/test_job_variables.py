"""Test jobs at other velocities, with wider tables, after a resume, and on several processes."""

import re
from pathlib import Path

import pytest

from chaincor.analysis.dumps.dump import Dump
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.job import write_job
from tests.lmp import LMP, number, run_lmp

KINDS = [
    {"tolerance": 1e-8},
    {"scheme": "verlet", "dump_frames": 8},
    {"wall": "reflect"},
    {"contact": "power", "contact_exponent": 2, "target_particles": 20, "scheme": "order4"},
    {"target_particles": 3, "scheme": "order6", "dump_frames": "contacts"},
]
EVERY = {"restartable": True, "guards": True, "contacts": True}
GO_ON = "screen no\njump            SELF flight"


@pytest.mark.slow_cases
@pytest.mark.parametrize("in_run", [1, 2], ids=["first", "second"])
@pytest.mark.parametrize("kind", KINDS, ids=lambda k: "-".join(map(str, k)))
def test_a_job_goes_on_in_mid_collision(kind, in_run, tmp_path):
    scene = Scene(particles=6, speed=0.4, **kind)
    write_job(scene, tmp_path / "job", dump="dump_frames" in kind, **EVERY)
    whole = run_lmp(tmp_path / "job")
    every = "2" if number(whole.stdout, "contacts") > 2 else "1"
    script = tmp_path / "job" / "in.chain"
    text = script.read_text()
    assert text.count(GO_ON) == 1
    # The job is killed just after it wrote its state, in the main run or in a run for the error.
    end = "quit" if in_run == 1 else f'if "${{multiple}} != 1.0" then quit\n{GO_ON[10:]}'
    script.write_text(text.replace(GO_ON, f"screen no\n{end}"))
    killed = run_lmp(tmp_path / "job", "-var", "restart", every)
    assert "restitution" not in killed.stdout
    script.write_text(text)
    resumed = run_lmp(tmp_path / "job", "-var", "resume", "1")
    assert resumed.returncode == 0, resumed.stdout[-2000:]
    names = ["restitution", "restitution_error", "contacts", "last_contact_time"]
    names += ["momentum_change", "wall_impulse"]
    ends = [re.search("^ending = .*$", done.stdout, re.MULTILINE)[0] for done in (whole, resumed)]
    assert ends[0] == ends[1]
    if in_run == 1:
        written = (tmp_path / "job" / "contacts.txt").read_text().splitlines()
        assert len(written) == 1 + number(whole.stdout, "contacts")
    for name in names:
        # Forces after the contact are computed again, at positions that differ by rounding.
        expected = number(whole.stdout, name)
        assert number(resumed.stdout, name) == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_a_dump_goes_on_in_a_resumed_job(tmp_path):
    scene = Scene(particles=6, speed=0.4, scheme="verlet", error=False, dump_frames=8)
    write_job(scene, tmp_path, dump=True, restartable=True)
    run_lmp(tmp_path)
    whole = {frame.step for frame in Dump(tmp_path / "dump.lammpstrj")}
    script = tmp_path / "in.chain"
    text = script.read_text()
    script.write_text(text.replace(GO_ON, "screen no\nquit"))
    run_lmp(tmp_path, "-var", "restart", "3")
    script.write_text(text)
    run_lmp(tmp_path, "-var", "resume", "1")
    resumed = {frame.step for frame in Dump(tmp_path / "dump.lammpstrj")}
    assert min(resumed) == min(whole) == 0
    assert max(resumed) == max(whole)


def test_a_resumed_job_has_the_velocity_it_was_begun_with(tmp_path):
    scene = Scene(particles=6, speed=0.4, scheme="order6", error=False)
    write_job(scene, tmp_path, restartable=True)
    slow = ("-var", "velocity", "0.03", "-var", "timestep", "0.07")
    whole = run_lmp(tmp_path, *slow, "-var", "restart", "3")
    resumed = run_lmp(tmp_path, "-var", "resume", "1")
    for name in ("restitution", "contacts", "last_contact_time"):
        expected = number(whole.stdout, name)
        assert number(resumed.stdout, name) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", ["velocity", "timestep"])
def test_a_resumed_job_refuses_another_velocity_and_step(name, tmp_path):
    write_job(Scene(particles=3, speed=0.4, scheme="order4", error=False), tmp_path, **EVERY)
    begun = ("-var", "velocity", "0.03", "-var", "timestep", "0.07")
    whole = run_lmp(tmp_path, *begun, "-var", "restart", "1")
    refused = run_lmp(tmp_path, "-var", "resume", "1", "-var", name, "0.02")
    assert refused.returncode == 1
    begun_with = {"velocity": "0.03", "timestep": "0.07"}[name]
    said = f"BEGUN OTHERWISE: this job goes on with {name} {begun_with}, not with 0.02: leave"
    assert said in refused.stdout
    assert "restitution =" not in refused.stdout
    # The files are unchanged, and the original value may be given again.
    resumed = run_lmp(tmp_path, "-var", "resume", "1", *begun)
    assert number(resumed.stdout, "restitution") == pytest.approx(
        number(whole.stdout, "restitution"), rel=1e-12
    )


def test_a_report_that_was_printed_before_a_job_was_stopped_is_named(tmp_path):
    base = '{% extends "job.in.j2" %}'
    report = '{% block report %}\nprint "mine = 1"\n{% endblock %}'
    scene = Scene(particles=3, speed=0.4, tolerance=1e-4)
    write_job(scene, tmp_path, template=OwnTemplate(f"{base}\n{report}\n"), restartable=True)
    whole = run_lmp(tmp_path, "-var", "restart", "1")
    assert "mine = 1" in whole.stdout
    resumed = run_lmp(tmp_path, "-var", "resume", "1")  # in the last run of the job
    assert resumed.returncode == 0
    assert "mine = 1" not in resumed.stdout
    assert re.search("^NO REPORT: the lines of the template were", resumed.stdout, re.MULTILINE)


def test_files_of_different_contacts_are_refused(tmp_path):
    write_job(
        Scene(particles=6, speed=0.4, scheme="order6", error=False), tmp_path, restartable=True
    )
    run_lmp(tmp_path, "-var", "restart", "3")
    state = tmp_path / "chain.state"
    state.write_text(re.sub(r"saved_at string \S+", "saved_at string 1.5", state.read_text()))
    done = run_lmp(tmp_path, "-var", "resume", "1")
    assert done.returncode == 1
    assert "MISMATCHED: chain.restart and chain.state" in done.stdout
    assert "restitution =" not in done.stdout


@pytest.mark.slow
def test_one_job_serves_ten_velocities(tmp_path):
    """Require valid error bars, also at higher velocities, within the range of the job's table."""
    scene = Scene(particles=4, speed=0.3, tolerance=1e-7)
    write_job(scene, tmp_path, table_range=(0.9, 1.2), guards=True)
    fastest = float(re.search(r'velocity\} > (\S+)" then', (tmp_path / "in.chain").read_text())[1])
    assert fastest > 1.5 * scene.impact_velocity
    for k in range(1, 11):
        velocity = 0.1 * k * fastest
        done = run_lmp(tmp_path, "-var", "velocity", repr(velocity))
        assert done.returncode == 0, done.stdout[-2000:]
        exact = collide(Scene(particles=4, velocity=velocity, engine="reference", tolerance=1e-10))
        off = abs(number(done.stdout, "restitution") - exact.restitution)
        error = number(done.stdout, "restitution_error")
        assert off <= error + exact.restitution_error
        assert error < 1e-4
    done = run_lmp(tmp_path, "-var", "velocity", repr(1.01 * fastest))
    assert done.returncode == 1
    assert "TOO FAST" in done.stdout
    assert "--table-range" in done.stdout


@pytest.mark.parametrize(
    ("fields", "table_range", "line"),
    [
        ({"potential": "harmonic"}, (0.9, 1.1), "table_range has no effect on harmonic bonds"),
        ({}, (1.1, 1.2), "table_range is 1.1 to 1.2. Give a length below and a length above 1"),
        ({}, (-0.5, 1.2), "between 0 and inf for lj bonds"),
        ({}, (0.9, float("inf")), "table_range is 0.9 to inf"),
        ({}, (float("nan"), 1.2), "table_range is nan to 1.2"),
    ],
)
def test_a_range_without_sense_is_refused(fields, table_range, line, tmp_path):
    with pytest.raises(SceneError, match=line):
        write_job(Scene(particles=3, **fields), tmp_path / "job", table_range=table_range)
    assert not (tmp_path / "job").exists()


@pytest.mark.slow
def test_two_processes_give_the_same(tmp_path):
    mpiexec = Path(LMP).with_name("mpiexec")
    if not mpiexec.exists():
        pytest.skip("no mpiexec beside lmp")
    # The job has few steps, because waiting processes keep cores busy.
    scene = Scene(particles=4, speed=0.4, scheme="verlet", timestep=0.2, error=False)
    write_job(scene, tmp_path)
    alone = run_lmp(tmp_path)
    done = run_lmp(tmp_path, starter=(mpiexec, "-n", "2"))
    assert done.returncode == 0, done.stdout[-2000:]
    for name in ("restitution", "contacts", "last_contact_time"):
        # Two processes add up forces in another order.
        expected = number(alone.stdout, name)
        assert number(done.stdout, name) == pytest.approx(expected, rel=1e-12)
