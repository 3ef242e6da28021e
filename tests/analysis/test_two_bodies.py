"""Test that dumps of two bodies are analysed, for each way to distinguish the bodies."""

import json
from dataclasses import replace

import numpy as np
import pytest

from chaincor.analysis.dumps.other_trajectories import open_trajectory
from chaincor.analysis.job_analysis import analyze_job, target_particles_of
from chaincor.analysis.job_folder import Job
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide

SCENE = Scene(
    potential="toda",
    particles=5,
    masses=[1, 2],
    target_particles=4,
    target_masses=[3, 1],
    speed=0.4,
    engine="reference",
    tolerance=1e-8,
)


@pytest.fixture(scope="module")
def result():
    return collide(SCENE)


@pytest.fixture(scope="module")
def states(result):
    # The reference engine's first frame is after the first contact, and LAMMPS's is before it.
    frames = result.replay.record(0.5)
    frames.velocities[0] = -SCENE.impact_velocity
    frames.target_velocities[0] = 0.0
    return frames


def write_dump(path, frames, columns, *, shift=0.0, order=None, masses=None):
    """Write frames as LAMMPS does; `order` lists the ids of the particles, the chain first."""
    n, targets = frames.displacements.shape[1], frames.targets
    ids = np.arange(1, n + targets + 1) if order is None else np.asarray(order)
    text = []
    for k, time in enumerate(frames.times):
        state = frames.state(k)
        values = {
            "id": ids,
            "mol": np.where(np.arange(n + targets) < n, 1, 2),
            "x": state.all_positions + np.where(np.arange(n + targets) < n, shift, 0.0),
            "vx": state.all_velocities,
            "v_displacement": state.all_displacements,
            "v_time": np.full(n + targets, time),
            "mass": masses,
        }
        text.append(
            f"ITEM: TIMESTEP\n{k}\nITEM: NUMBER OF ATOMS\n{n + targets}\n"
            "ITEM: BOX BOUNDS ff ff ff\n-100 100\n-0.5 0.5\n-0.5 0.5\n"
            f"ITEM: ATOMS {' '.join(columns)}\n"
        )
        rows = zip(*(values[name].tolist() for name in columns), strict=True)
        text.append("".join(" ".join(f"{v:.17g}" for v in row) + "\n" for row in rows))
    path.write_text("".join(text))
    return Job(path)


FULL = ("id", "mol", "x", "vx", "v_displacement", "v_time", "mass")
MASSES = np.concatenate((SCENE.line.chain_masses, SCENE.line.target_masses))


def reported(job, given=None):
    return target_particles_of(job, open_trajectory(job.dump).first(), given)


def check(found, result):
    assert found.restitution == pytest.approx(result.restitution, rel=1e-10)
    assert found.kinematic_restitution == pytest.approx(result.kinematic_restitution, rel=1e-10)
    assert found.velocity_after == pytest.approx(result.velocity_after, rel=1e-10)
    assert found.target.velocity_after == pytest.approx(result.target_velocity_after, rel=1e-10)
    assert found.target.masses.tolist() == SCENE.line.target_masses.tolist()
    assert found.momentum_residual < 1e-13
    # Seventeen digits are printed; trailing zeros leave at least 15 digits in the first frame.
    assert found.data_error < 1e-11
    # In a Toda chain, harmonic modes exchange energy with each other, but not with the translation.
    assert found.mode_energies[0] == pytest.approx(result.translational_energy, rel=1e-9)
    assert found.target.mode_energies[0] == pytest.approx(
        result.target_translational_energy, rel=1e-9
    )


def test_our_own_dump(result, states, tmp_path):
    job = write_dump(tmp_path / "d", states, FULL, masses=MASSES)
    assert reported(job) == 4
    found = analyze_job(job, target_particles=4, bond=SCENE.bond)
    check(found, result)
    assert abs(found.energy_drift) < 1e-7
    assert found.energy_end.vibration == pytest.approx(result.vibrational_energy, rel=1e-6)
    assert found.target.energy_end.vibration == pytest.approx(
        result.target_vibrational_energy, rel=1e-6
    )


def test_a_dump_of_bodies_that_differ_by_position_alone(result, states, tmp_path):
    # Ids may have any order. In the first frame, the bodies are apart.
    order = [7, 2, 9, 4, 1, 6, 3, 8, 5]
    job = write_dump(
        tmp_path / "d", states, ("id", "x", "vx", "mass"), shift=0.5, order=order, masses=MASSES
    )
    assert reported(job) == 0
    assert reported(job, 4) == 4
    found = analyze_job(job, target_particles=4)
    check(found, result)
    assert found.energy_end is None
    assert any("the bond is unknown" in caveat for caveat in found.caveats)
    # The dump has no time. The time step follows from the flight of the chain's last particle. Its
    # flight is free until sound has changed its velocity by a relative 1e-5.
    assert found.timestep == pytest.approx(0.5, rel=1e-6)


def test_undetermined_bodies_are_refused(states, tmp_path):
    job = write_dump(tmp_path / "d", states, ("id", "x", "vx", "mass"), masses=MASSES)
    with pytest.raises(InputError, match=r"both bodies are at x = 0 in the first frame"):
        analyze_job(job, target_particles=4)
    for count in (9, -1):
        line = f"has {count} particles, but the dump has 9. Give at least one"
        with pytest.raises(InputError, match=line):
            analyze_job(job, target_particles=count)
    job = write_dump(tmp_path / "d", states, FULL, masses=MASSES)
    with pytest.raises(InputError, match=r"--target-particles 3, column mol of the dump 4"):
        reported(job, 3)
    (tmp_path / "scene.toml").write_text('potential = "toda"\nparticles = 9\nvelocity = 0.1\n')
    for columns, given in ((FULL, None), (("id", "x", "vx"), 4)):
        job = write_dump(tmp_path / "d", states, columns, shift=0.5, masses=MASSES)
        with pytest.raises(InputError, match=r"scene\.toml 0.*\. Give one number"):
            analyze_job(replace(job, scene=tmp_path / "scene.toml"), target_particles=given)
    backwards = states.until(np.inf)
    last = write_dump(
        tmp_path / "e",
        type(states)(*(getattr(backwards, f)[-1:] for f in states.__dataclass_fields__)),
        FULL,
        masses=MASSES,
    )
    with pytest.raises(InputError, match=r"move apart with .* in the first frame"):
        analyze_job(last, target_particles=4)


def test_a_dump_that_begins_after_the_first_contact_is_not_that_of_the_scene(states, tmp_path):
    late = type(states)(*(getattr(states, f)[1:] for f in states.__dataclass_fields__))
    job = write_dump(tmp_path / "d", late, FULL, masses=MASSES)
    (tmp_path / "scene.toml").write_text(SCENE.to_toml())
    with pytest.raises(
        InputError, match=r"approach each other with .* in the first frame, but with"
    ):
        analyze_job(Job(job.dump, scene=tmp_path / "scene.toml"), target_particles=4)


def test_a_run_cut_short_says_so(states, tmp_path):
    job = write_dump(tmp_path / "d", states.until(3.0), FULL, masses=MASSES)
    found = analyze_job(job, target_particles=4)
    assert not found.finished
    assert any("the collision is not over" in caveat for caveat in found.caveats)


@pytest.mark.parametrize("bond", [SCENE.bond, None], ids=["known", "not known"])
def test_contacts_are_those_of_the_run(result, states, tmp_path, bond):
    job = write_dump(tmp_path / "d", states, FULL, masses=MASSES)
    found = analyze_job(job, bond=bond)
    if bond is None:
        # With frames half a time unit apart, some pairs of frames show only that a contact
        # occurred.
        assert found.contact_statistics.count <= result.contacts
        return
    assert found.contacts == result.contacts
    assert found.detection.method == "reintegration"
    # The analysis integrates to 1e-12 from states with the run's tolerance of 1e-8.
    assert found.contact_times == pytest.approx(result.contact_times, abs=1e-6)
    assert found.contact_speeds == pytest.approx(result.contact_speeds, rel=1e-5, abs=1e-7)


def test_the_command_tells_and_draws_both_bodies(result, states, tmp_path, chaincor):
    write_dump(tmp_path / "d.lammpstrj", states, FULL, masses=MASSES)
    out, xyz = tmp_path / "out", tmp_path / "motion.xyz"
    words = ["analyze", str(tmp_path), "--potential", "toda"]
    written = ["-o", str(out), "--xyz", str(xyz)]
    for extra, status in ((written, 0), (["--json"], 0), (["--masses", "1"], 2)):
        ended, said, err = chaincor(*words, *extra)
        assert ended == status, err
        if extra == ["--json"]:
            found = json.loads(said)
            assert found["restitution"] == pytest.approx(result.restitution, rel=1e-10)
            assert len(found["target_mode_energies"]) == 4
            assert found["contacts"] == result.contacts
        elif status == 0:
            assert "target                 velocity -" in said
            assert f"contacts               {result.contacts}, the last" in said
        else:
            assert err.count("\n") == 1
            assert "give the masses of both bodies" in err
    drawn = {path.stem for path in out.glob("*.png")}
    assert {"trajectories", "contacts", "energy", "target_spectrum"} <= drawn
    assert "a free target of 4" in (out / "analysis.html").read_text(encoding="utf-8")
    # Restitution is the relative translational energy after the last contact divided by that at
    # impact.
    rows = np.genfromtxt(out / "history.csv", delimiter=",", names=True)
    before = 0.5 * SCENE.line.reduced_mass * SCENE.impact_velocity**2
    assert rows["translation"][-1] == pytest.approx(result.restitution * before, rel=1e-9)
    assert xyz.read_text().startswith("9\n")


@pytest.mark.parametrize("targets", [None, 3])
def test_soft_bodies_have_no_contacts_to_count(tmp_path, chaincor, targets):
    scene = Scene(
        potential="toda",
        particles=4,
        target_particles=targets,
        contact="power",
        speed=0.3,
        engine="reference",
        tolerance=1e-8,
    )
    run = collide(scene)
    write_dump(tmp_path / "d.lammpstrj", run.replay.record(0.5), FULL[:-1])
    (tmp_path / "scene.toml").write_text(scene.to_toml())
    out = tmp_path / "out"
    status, said, err = chaincor("analyze", tmp_path, "-o", out, "--json")
    assert status == 0, err
    found = json.loads(said)
    assert found["restitution"] == pytest.approx(run.restitution, rel=1e-10)
    assert found["velocity_after"] == pytest.approx(run.velocity_after, rel=1e-10)
    assert found["target_particles"] == (targets or 0)
    assert found["contacts"] is None
    assert found["contact_times"] == []
    assert not any("momentum falls" in caveat for caveat in found["caveats"])
    drawn = {path.stem for path in out.glob("*.png")}
    assert "trajectories" in drawn
    assert "contacts" not in drawn
