"""Test the LAMMPS engine against published values and the identities of a collision."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from chaincor.analysis.restitution import momentum_residual, restitution
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps import lammps_collision
from chaincor.workflows.errors import BondRangeError, LostAtomsError, TimestepError
from tests.reference_cases import CASES, case_name, case_scene

# Coarsest composed steps of order 8 with errors within ERROR_LIMITS. Faster collisions compress
# bonds to larger stiffness and need finer steps.
TIMESTEPS = {
    "harmonic": {0.1: 0.15},
    "lj": {0.01: 0.2, 0.1: 0.2, 0.4: 0.15, 0.78: 0.1, 1.0: 0.1, 2.0: 0.05, 5.0: 0.018},
    "toda": {0.01: 0.2, 0.1: 0.2, 0.4: 0.15, 0.78: 0.1, 1.0: 0.1, 2.0: 0.05, 5.0: 0.018},
    "log": {0.01: 0.2, 0.1: 0.2, 0.4: 0.15, 0.78: 0.07, 1.0: 0.05},
    "power": {0.1: 0.2},
}
FAST = 2.0  # in units of v*
ERROR_LIMITS = {"slow": 1e-8, "fast": 2e-8}


def momentum_error(scene, outcome):
    return momentum_residual(outcome.velocities, scene.impact_velocity, 0.5 * outcome.impulses)


# Each case takes more than a second.
LONG = ("lj-100-2.0", "log-100-1.0", "harmonic-500-0.1")


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(case, id=name, marks=pytest.mark.slow if name in LONG else ())
        for name, case in zip(map(case_name, CASES), CASES, strict=True)
    ],
)
@pytest.mark.slow_cases
def test_reference_values(case):
    scene = case_scene(case)
    speed = case.get("speed_over_vstar", case.get("velocity"))
    step = TIMESTEPS[case["potential"]][speed]
    outcome = lammps.run(scene.problem, Numerics(scheme="order8", timestep=step))
    eta = restitution(outcome.velocities, scene.impact_velocity)
    limit = ERROR_LIMITS["fast" if case.get("speed_over_vstar", 0.0) >= FAST else "slow"]
    assert abs(eta - case["restitution"]) <= limit
    assert len(outcome.contact_times) == case["contacts"]
    # The times are published to 1e-7. The error of a time is about that of eta divided by the rate
    # of change of eta.
    assert outcome.contact_times[-1] == pytest.approx(case["last_contact_time"], abs=1e-6)
    assert abs(momentum_error(scene, outcome)) <= 1e-12
    # The relative energy error is of the size of the error of eta.
    assert outcome.energy_end == pytest.approx(outcome.energy_start, rel=1e-6)


@pytest.mark.parametrize("case", CASES[1:3], ids=map(case_name, CASES[1:3]))
def test_reference_values_are_not_met_by_a_coarse_step(case):
    # The test above can fail, because Verlet has an error of 1e-5 at this step.
    scene = case_scene(case)
    outcome = lammps.run(scene.problem, Numerics(scheme="verlet", timestep=0.05))
    eta = restitution(outcome.velocities, scene.impact_velocity)
    assert abs(eta - case["restitution"]) > 1e-7


@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize("potential", ["harmonic", "lj"])
def test_momentum_comes_from_the_wall_alone(wall, potential):
    scene = Scene(potential=potential, particles=30, velocity=0.05)
    outcome = lammps.run(scene.problem, Numerics(wall=wall, scheme="verlet", timestep=0.01))
    assert np.array_equal(outcome.impulses, 2.0 * outcome.contact_speeds)
    assert abs(momentum_error(scene, outcome)) <= 1e-12


def test_one_particle_bounces_once():
    outcome = lammps.run(Scene(particles=1, velocity=0.3).problem, Numerics())
    assert outcome.velocities.tolist() == [0.3]
    assert outcome.contact_times.tolist() == [0.0]
    assert (outcome.bond_min, outcome.bond_max, outcome.fragments) == (1.0, 1.0, 1)


def test_two_harmonic_particles_return_everything():
    # The relative motion of two particles has omega = sqrt(2); the second contact comes half a
    # period after the first.
    outcome = lammps.run(
        Scene(potential="harmonic", particles=2, velocity=0.1).problem,
        Numerics(scheme="order8", timestep=0.1),
    )
    assert outcome.contact_times == pytest.approx([0.0, np.pi / np.sqrt(2.0)], abs=1e-12)
    assert outcome.velocities == pytest.approx([0.1, 0.1], abs=1e-13)


def test_harmonic_collisions_scale_with_the_velocity():
    # Times and eta of a harmonic chain do not depend on speed. Coordinates are rounded to n eps,
    # and displacements are about v0.
    slow, fast = (
        lammps.run(
            Scene(potential="harmonic", particles=20, velocity=v).problem,
            Numerics(scheme="order6", timestep=0.1),
        )
        for v in (1e-4, 0.1)
    )
    rounding = 20 * sys.float_info.epsilon / 1e-4
    assert slow.contact_times == pytest.approx(fast.contact_times, abs=200 * rounding)
    assert slow.velocities / 1e-4 == pytest.approx(fast.velocities / 0.1, abs=200 * rounding)


def test_the_final_state_is_that_after_the_last_contact():
    scene = Scene(potential="harmonic", particles=10, velocity=0.1)
    outcome = lammps.run(scene.problem, Numerics(), frame_interval=0.1)
    assert outcome.displacements[0] == 0.0
    assert outcome.velocities[0] == outcome.contact_speeds[-1]
    assert outcome.duration > outcome.contact_times[-1]
    frames = outcome.frames
    assert frames.displacements.shape == frames.velocities.shape == (len(frames.times), 10)
    assert np.all(np.diff(frames.times) > 0.0)
    # Free flight after the last contact keeps the momentum.
    late = frames.velocities[frames.times > outcome.contact_times[-1]]
    assert late.mean(axis=1) == pytest.approx(outcome.velocities.mean(), abs=1e-15)


def test_more_frames_than_steps_are_one_a_step():
    """Give at most one frame per step, even for intervals below the resolution of time."""
    scene = Scene(potential="harmonic", particles=4, velocity=0.1)
    few = lammps.run(scene.problem, Numerics(), frame_interval=1e-3).frames.times
    assert few.size > 20
    for interval in (1e-12, 1e-300):
        frames = lammps.run(scene.problem, Numerics(), frame_interval=interval).frames
        assert np.array_equal(frames.times, few)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wall", "scheme"), [("event", "verlet"), ("event", "order6"), ("reflect", "verlet")]
)
@pytest.mark.parametrize(
    "fields",
    [
        {"potential": "harmonic", "particles": 10, "velocity": 0.1},
        {"potential": "harmonic", "particles": 40, "velocity": 0.1},
        {"potential": "lj", "particles": 30, "speed": 0.4},
        {"potential": "lj", "particles": 30, "speed": 1.0},
        {"potential": "toda", "particles": 30, "speed": 2.0},
    ],
    ids=lambda f: f"{f['potential']}-{f['particles']}-{f.get('speed')}",
)
def test_looking_ahead_for_the_end_changes_no_contact(fields, wall, scheme):
    # A run with frames takes exact steps to the end. Every bit must be equal.
    scene = Scene(**fields)
    numerics = Numerics(wall=wall, scheme=scheme, timestep=0.0125, bond_range=(0.4, 40.0))
    ahead = lammps.run(scene.problem, numerics)
    exact = lammps.run(scene.problem, numerics, frame_interval=1e6)
    for name in ("contact_times", "contact_speeds", "velocities", "displacements"):
        assert np.array_equal(getattr(ahead, name), getattr(exact, name))


def test_a_narrow_range_is_widened_to_the_same_answer():
    scene = Scene(potential="lj", particles=10, speed=0.4)
    numerics = Numerics(scheme="order8", timestep=0.1)
    etas = []
    for bond_range in ((0.99, 1.01), (0.85, 1.4)):
        found = lammps.run(
            scene.problem,
            Numerics(scheme="order8", timestep=numerics.timestep, bond_range=bond_range),
        )
        assert found.details["table"]["shortest"] < found.bond_min
        assert found.details["table"]["longest"] > found.bond_max
        etas.append(restitution(found.velocities, scene.impact_velocity))
    # Each table is exact to about 1e-12 times the force.
    assert etas[0] == pytest.approx(etas[1], abs=1e-10)


def test_a_users_bond_runs_like_the_named_one():
    lj = LennardJones()
    named = Scene(potential="lj", particles=10, velocity=0.05)
    mine = Scene(potential=UserBond(lj.energy, lj.force), particles=10, velocity=0.05)
    numerics = Numerics(scheme="order6", timestep=0.05, bond_range=(0.9, 1.2))
    one, two = lammps.run(named.problem, numerics), lammps.run(mine.problem, numerics)
    # Only the end slopes of the spline differ: a central difference gives them to 1e-9.
    assert two.velocities == pytest.approx(one.velocities, abs=1e-11)


def test_files_are_kept_on_request_only(tmp_path):
    scene = Scene(
        potential="lj",
        particles=5,
        save=tmp_path / "job",
        dump=tmp_path / "deep" / "motion.dump",
    )
    lammps.run(scene.problem, Numerics(scheme="verlet", timestep=0.02), files=scene.run_files)
    kept = {file.name for file in (tmp_path / "job").iterdir()}
    assert {"chain.data", "bond.table", "log.lammps"} <= kept
    warnings = [
        line
        for line in (tmp_path / "job" / "log.lammps").read_text().splitlines()
        if "WARNING" in line
        # LAMMPS itself calls its warning of a force extremum harmless.
        and "inconsistent with -dE/dr" not in line
        and "inflection points" not in line
    ]
    assert not warnings
    lines = (tmp_path / "deep" / "motion.dump").read_text().splitlines()
    assert lines[8] == "ITEM: ATOMS id type x y z vx vy vz v_displacement v_time"


def test_bonds_seen_at_the_end_of_a_table_widen_it(monkeypatch):
    """Require a wider table: within a bin beyond the last row, LAMMPS reads arbitrary memory."""
    scene = Scene(particles=5, speed=0.4)
    given = Numerics(scheme="verlet", timestep=0.02, bond_range=(0.9, 1.2))
    for numerics, near in ((given, 1e-6), (replace(given, bond_range=None), 0.02)):
        plain, tables, collide = lammps.run(scene.problem, numerics), [], lammps._collide

        def seen_near_the_end(*arguments, near=near, tables=tables, collide=collide):
            runs = collide(*arguments)
            tables.append(arguments[3])
            if len(tables) > 1:
                return runs
            return replace(runs, longest_seen=tables[0].longest - near)

        with monkeypatch.context() as patch:
            patch.setattr(lammps, "_collide", seen_near_the_end)
            outcome = lammps.run(scene.problem, numerics)
        assert len(tables) == 2
        assert tables[1].longest - 1.0 > 1.4 * (tables[0].longest - 1.0)
        assert np.abs(outcome.velocities - plain.velocities).max() < 1e-9 * scene.impact_velocity


@pytest.mark.parametrize("error", [BondRangeError("1e+40 long"), LostAtomsError("lost")])
def test_an_impossible_length_is_excused_once(monkeypatch, error):
    scene, numerics = Scene(particles=5, speed=0.4), Numerics(scheme="verlet", timestep=0.02)
    plain = lammps.run(scene.problem, numerics)
    if isinstance(error, BondRangeError):
        error.length = 1e40
    failures, collide = [], lammps._collide

    def kicked(*arguments):
        if len(failures) < times:
            failures.append(error)
            return replace(collide(*arguments), outcomes=[], longest_seen=0.0, stopped=error)
        return collide(*arguments)

    monkeypatch.setattr(lammps, "_collide", kicked)
    times = 1
    outcome = lammps.run(scene.problem, numerics)
    assert np.abs(outcome.velocities - plain.velocities).max() < 1e-9 * scene.impact_velocity
    failures.clear()
    times = 2
    with pytest.raises(TimestepError, match="allows no such bond"):
        lammps.run(scene.problem, numerics)


def test_a_proof_whose_bonds_leave_the_table_has_a_wider_one():
    scene = Scene(particles=10, speed=0.4)
    # The longest Verlet steps in this extrapolated step are so coarse that bonds leave the range.
    numerics = Numerics(scheme="extrapolated12", timestep=0.3, bond_range=(0.93, 1.15))
    fine, coarse = lammps.run_at_steps(scene.problem, numerics, (0.3, 0.9))
    assert coarse.details["table"]["shortest"] < fine.details["table"]["shortest"]
    alone = lammps.run(scene.problem, numerics)
    assert np.array_equal(fine.velocities, alone.velocities)
    assert np.abs(coarse.velocities - fine.velocities).max() < 1e-2 * scene.impact_velocity


def test_a_late_contact_is_waited_for():
    """Require that LAMMPS waits for contact 27, which the reference engine predicts."""
    scene = Scene(particles=28, speed=1.47)
    outcome = lammps.run(scene.problem, Numerics(scheme="order8", timestep=0.05))
    assert len(outcome.contact_times) == 27
    # Two integrators of another kind gave this time. Errors grow by a factor of 1e4 in this
    # collision.
    assert outcome.contact_times[-1] == pytest.approx(38.808724, abs=1e-4)
    assert outcome.ending.kind in ("proved", "argued")


@pytest.mark.slow
def test_impatience_changes_nothing(monkeypatch):
    """Require that the time of the request to the reference engine affects only the cost."""
    scene, numerics = Scene(particles=12, speed=1.5), Numerics(scheme="order6", timestep=0.05)
    plain = lammps.run(scene.problem, numerics)
    for patience in (1.0, 10.0):
        monkeypatch.setattr(lammps_collision, "PATIENCE", patience)
        outcome = lammps.run(scene.problem, numerics)
        # A run that continues for longer has longer bonds and a wider table. Force errors of 1e-12
        # grow some hundred times in a chain that breaks.
        assert np.abs(outcome.velocities - plain.velocities).max() < 1e-9 * scene.impact_velocity
        assert np.abs(outcome.contact_times - plain.contact_times).max() < 1e-8
