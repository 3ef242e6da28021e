"""Test the judge of two bodies against published values, exact modes, and closed forms."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.scenes.lines import draw_line_scene
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference import modal
from tests.judge.bodies import KINDS, Bodies, Bonds, Unsure, judge, run_once
from tests.judge.lines import bodies_of, bonds_of, draw, judge_scene

ROOT = Path(__file__).parents[2]
CASES = json.loads((ROOT / "tests" / "reference_general.json").read_text())["cases"]
# The values are printed with ten digits.
PRINTED = 1e-10
# With this fraction of its usual steps, the judge is accurate to ``PRINTED``.
CLOSE = 0.36


def test_it_shares_no_code_with_the_package():
    imported = set()
    for name in ("bodies", "bodies_steps"):
        source = (ROOT / "tests" / "judge" / f"{name}.py").read_text()
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.Import):
                imported |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                imported.add(node.module)
    own = {"tests.judge.bodies_steps"}
    assert imported >= own
    others = {name.split(".")[0] for name in imported - own}
    assert others == {"dataclasses", "numba", "numpy", "scipy"}


@pytest.mark.parametrize("case", CASES, ids=lambda c: f"{c['potential']}-{c['particles']}")
@pytest.mark.slow
def test_published_values(case):
    fields = {key: case[key] for key in ("potential", "particles", "velocity", "masses")}
    if case["target_particles"]:
        fields |= {key: case[key] for key in ("target_particles", "target_masses")}
    scene = Scene(**fields)
    found = judge(bonds_of(scene), bodies_of(scene), closer=CLOSE)
    assert found.seen.restitution == pytest.approx(case["restitution"], abs=PRINTED)
    assert found.seen.contacts == case["contacts"]
    last = found.seen.last_contact - found.seen.first_contact
    assert last == pytest.approx(case["last_contact_time"], abs=PRINTED)
    assert found.error < PRINTED


@pytest.mark.slow
def test_exact_modes():
    random = np.random.default_rng(5)
    for _ in range(12):
        count, targets = int(random.integers(1, 14)), int(random.integers(1, 10))
        scene = Scene(
            potential="harmonic",
            particles=count,
            velocity=0.1,
            masses=10 ** random.uniform(-1.0, 1.0, count),
            target_particles=targets,
            target_masses=10 ** random.uniform(-1.0, 1.0, targets),
            compression=float(random.uniform(0.0, 0.03)),
        )
        exact = modal.run(scene.problem)
        found = judge(bonds_of(scene), bodies_of(scene), closer=CLOSE)
        assert abs(found.seen.restitution - exact.eta) < 3.0 * found.error < 1e-10
        assert found.seen.contacts == len(exact.contact_times)
        assert found.seen.contact_times == pytest.approx(exact.contact_times, abs=1e-9)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.3])
def test_soft_single_particles_keep_their_energy(exponent):
    for target in (np.inf, 3.0):
        bodies = Bodies(
            np.array([target, 2.0]), np.array([0.0, -0.1]), np.array([0.5]), 1, 7.0, exponent
        )
        found = judge(Bonds("lj"), bodies, closer=CLOSE)
        assert found.seen.restitution == pytest.approx(1.0, abs=1e-11)
        assert found.seen.first_contact == pytest.approx(5.0, rel=1e-13)
        assert found.seen.contacts == 1


@pytest.mark.parametrize("potential", ["lj", "toda", "log", "morse"])
def test_laws_keep_the_energy_that_the_package_counts(potential):
    scene = Scene(potential=potential, particles=8, speed=0.5, masses=[1, 3], target_particles=2)
    seen = judge(bonds_of(scene), bodies_of(scene), closer=CLOSE).seen
    energy = 0.5 * scene.line.masses @ seen.velocities**2
    energy += float(np.sum(scene.bond.energy(np.delete(seen.strains, scene.line.gap))))
    arriving = 0.5 * scene.line.masses @ scene.line.velocities**2
    assert energy == pytest.approx(arriving, rel=1e-11)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0])
def test_soft_chains_agree_over_steps_and_keep_their_energy(exponent):
    scene = Scene(
        particles=8, speed=0.5, masses=[1, 3], target_particles=3,
        contact="power", contact_stiffness=20.0, contact_exponent=exponent,
    )  # fmt: skip
    rough = judge(bonds_of(scene), bodies_of(scene), closer=1.0)
    close = judge(bonds_of(scene), bodies_of(scene), closer=CLOSE)
    assert abs(rough.seen.restitution - close.seen.restitution) < rough.error < 1e-8
    assert abs(close.seen.energy_drift) < 1e-12
    assert abs(close.seen.momentum_drift) < 1e-13
    assert close.error < 1e-11


def test_runs_that_err_alike_are_distinguished_by_their_energy(tmp_path):
    # eta is 102. Both runs have an error of 1e-8, a hundred times the difference between them.
    scene = draw(94, 15, "lammps", tmp_path)
    rough = judge(bonds_of(scene), bodies_of(scene), closer=1.0)
    close = judge(bonds_of(scene), bodies_of(scene), closer=CLOSE)
    assert abs(rough.seen.restitution - close.seen.restitution) < rough.error < 1e-6
    assert close.error < 1e-10


def test_it_says_where_a_bond_runs_away():
    scene = Scene(
        potential="power", power_order=3, power_c=-1.0, particles=5, speed=0.28,
        target_particles=1, target_masses=[3.67],
    )  # fmt: skip
    with pytest.raises(Unsure, match="barrier"):
        run_once(bonds_of(scene), bodies_of(scene), 0.5)


def test_draws_are_valid_and_of_all_kinds(tmp_path):
    scenes = [draw(1, index, None, tmp_path) for index in range(80)]
    assert all(not scene.line.is_standard for scene in scenes)
    assert {scene.engine for scene in scenes} == {"lammps", "reference"}
    assert {scene.potential for scene in scenes} == set(KINDS)
    for key in ("masses", "target_particles", "contact", "initial", "compression"):
        assert 5 < sum(getattr(scene, key) is not None for scene in scenes) < 75
    again = draw_line_scene(np.random.default_rng([1, 0, 0]), tmp_path)
    assert again.sha256 == draw_line_scene(np.random.default_rng([1, 0, 0]), tmp_path).sha256


def test_steps_follow_the_bar():
    scene = Scene(potential="harmonic", particles=6, velocity=0.1, masses=[1, 3])
    loose, sharp = judge_scene(scene, 1e-4), judge_scene(scene, 1e-11)
    assert sharp.error < loose.error
    assert sharp.seen.steps > loose.seen.steps


def test_warm_scenes_are_of_every_kind(tmp_path):
    scenes = [draw(7, index, None, tmp_path, "warm") for index in range(60)]
    assert {scene.potential for scene in scenes} == set(KINDS)
    assert all(scene.temperature is not None for scene in scenes)
    ratios = [scene.impact_velocity / scene.temperature**0.5 for scene in scenes]
    assert min(ratios) < 0.5
    assert max(ratios) > 10.0
    assert {scene.engine for scene in scenes} == {"lammps", "reference"}
    assert any(scene.masses and scene.target_particles for scene in scenes)


def test_a_warm_chain_of_springs_is_judged_as_its_exact_modes_say():
    scene = Scene(potential="harmonic", particles=5, velocity=0.05, temperature=1e-3, seed=4)
    found = judge_scene(scene, 1e-10)
    exact = modal.run(scene.problem).eta
    assert abs(found.seen.restitution - exact) <= found.error + 1e-12
