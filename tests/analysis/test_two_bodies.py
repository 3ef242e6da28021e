"""Dumps of two bodies: what both do is read from the frames, by any way to tell them apart."""

import json

import numpy as np
import pytest

from chaincor.analysis.job_folder import Job
from chaincor.analysis.two_bodies.job import analyze_two_bodies, count_targets, find_two_bodies
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.cli import main
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
    # The first frame of the in-house engine is that after the first contact; LAMMPS's one before.
    frames = result.replay.record(0.5)
    frames.velocities[0] = -SCENE.impact_velocity
    frames.target_velocities[0] = 0.0
    return frames


def write_dump(path, frames, columns, *, shift=0.0, order=None, masses=None):
    """Write frames as LAMMPS does; `order` are the ids of the particles, the chain's first."""
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


def check(found, result):
    assert found.restitution == pytest.approx(result.restitution, rel=1e-10)
    assert found.kinematic_restitution == pytest.approx(result.kinematic_restitution, rel=1e-10)
    assert found.velocity_after == pytest.approx(result.velocity_after, rel=1e-10)
    assert found.target_velocity_after == pytest.approx(result.target_velocity_after, rel=1e-10)
    assert found.target_masses.tolist() == SCENE.line.target_masses.tolist()
    assert found.momentum_residual < 1e-13
    # 17 digits are printed, of which the first frame shows 15 or more.
    assert found.data_error < 1e-11
    # Modes of harmonic frequency exchange energy in a Toda chain, but not the translation.
    assert found.mode_energies[0] == pytest.approx(result.translational_energy, rel=1e-9)
    assert found.target_mode_energies[0] == pytest.approx(
        result.target_translational_energy, rel=1e-9
    )


def test_our_own_dump(result, states, tmp_path):
    job = write_dump(tmp_path / "d", states, FULL, masses=MASSES)
    assert count_targets(job) == 4
    found = analyze_two_bodies(job, 4, bond=SCENE.bond)
    check(found, result)
    assert abs(found.energy_drift) < 1e-7
    assert found.energy.vibration == pytest.approx(result.vibrational_energy, rel=1e-6)
    assert found.target_energy.vibration == pytest.approx(
        result.target_vibrational_energy, rel=1e-6
    )


def test_a_dump_of_bodies_told_by_their_places_alone(result, states, tmp_path):
    # Ids in any order; at first the bodies are apart.
    order = [7, 2, 9, 4, 1, 6, 3, 8, 5]
    job = write_dump(
        tmp_path / "d", states, ("id", "x", "vx", "mass"), shift=0.5, order=order, masses=MASSES
    )
    assert count_targets(job) is None
    assert count_targets(job, 4) == 4
    found = analyze_two_bodies(job, 4)
    check(found, result)
    assert found.energy is None
    assert any("potential is not known" in caveat for caveat in found.caveats)
    # No time is carried: whether the collision is over is not told.
    assert not found.finished
    assert found.quiet is None


def test_what_cannot_be_told_is_refused(states, tmp_path):
    job = write_dump(tmp_path / "d", states, ("id", "x", "vx", "mass"), masses=MASSES)
    with pytest.raises(InputError, match=r"both bodies are at x = 0 in the first frame"):
        analyze_two_bodies(job, 4)
    with pytest.raises(InputError, match="has 9 particles and the dump 9; expected fewer"):
        analyze_two_bodies(job, 9)
    job = write_dump(tmp_path / "d", states, FULL, masses=MASSES)
    with pytest.raises(InputError, match=r"--target-particles 3, column mol of the dump 4"):
        count_targets(job, 3)
    backwards = states.until(np.inf)
    last = write_dump(
        tmp_path / "e",
        type(states)(*(getattr(backwards, f)[-1:] for f in states.__dataclass_fields__)),
        FULL,
        masses=MASSES,
    )
    with pytest.raises(InputError, match=r"move apart with .* in the first frame"):
        analyze_two_bodies(last, 4)


def test_a_dump_that_begins_after_the_first_contact_is_not_that_of_the_scene(states, tmp_path):
    late = type(states)(*(getattr(states, f)[1:] for f in states.__dataclass_fields__))
    job = write_dump(tmp_path / "d", late, FULL, masses=MASSES)
    (tmp_path / "scene.toml").write_text(SCENE.to_toml())
    with pytest.raises(InputError, match=r"come together with .* in the first frame, .* with"):
        analyze_two_bodies(Job(job.dump, scene=tmp_path / "scene.toml"), 4)


def test_a_run_cut_short_says_so(states, tmp_path):
    job = write_dump(tmp_path / "d", states.until(3.0), FULL, masses=MASSES)
    found = analyze_two_bodies(job, 4)
    assert not found.finished
    assert any("another contact may follow" in caveat for caveat in found.caveats)


def test_the_command(result, states, tmp_path, capsys):
    write_dump(tmp_path / "d.lammpstrj", states, FULL, masses=MASSES)
    words = ["analyze", str(tmp_path), "--potential", "toda"]
    for extra, status in (([], 0), (["--json"], 0), (["-o", "out"], 2), (["--masses", "1"], 2)):
        with pytest.raises(SystemExit) as left:
            main([*words, *extra])
        out, err = capsys.readouterr()
        assert left.value.code == status, err
        if extra == ["--json"]:
            found = json.loads(out)
            assert found["restitution"] == pytest.approx(result.restitution, rel=1e-10)
            assert len(found["target_mode_energies"]) == 4
            assert found["contacts"] is None
        elif status == 0:
            assert "target                 velocity -" in out
            assert "contacts               not told" in out
        else:
            assert err.count("\n") == 1
            assert "expected none of them" in err


def test_a_chain_and_a_wall_are_none_of_this(tmp_path):
    assert find_two_bodies(tmp_path, None, None, None) is None
