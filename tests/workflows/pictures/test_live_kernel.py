"""Test the kernel of the live page under Node against the program."""

import json
import math
import shutil
import subprocess

import numpy as np
import pytest

from chaincor.analysis.modes import mode_frequencies
from chaincor.lammps_inputs.bonds.equilibrium import bond_distribution
from chaincor.lammps_inputs.bonds.potentials import CHAIN_POTENTIALS
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import COMPOSITIONS
from chaincor.workflows.collision import collide
from chaincor.workflows.pictures.live_page import kernel_source
from tests.workflows.pictures.live_scenes import PROMISE, SCENES, page_scene, reference

NODE = shutil.which("node")
EPSILON = np.finfo(float).eps

pytestmark = pytest.mark.skipif(NODE is None, reason="no node on this machine")


def run(expression, **given):
    """Return the value of an expression after the kernel; `given` are constants for it."""
    constants = "".join(f"const {name} = {json.dumps(value)};\n" for name, value in given.items())
    # JSON has no infinite numbers, which arrive as text.
    show = 'JSON.stringify(RESULT, (_, x) => typeof x === "number" && !isFinite(x) ? String(x) : x)'
    program = f"{kernel_source()}\n{constants}const RESULT = {expression};\nconsole.log({show});"
    done = subprocess.run(
        [NODE], input=program, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


BONDS = {name: {} for name in CHAIN_POTENTIALS} | {
    "toda": {"toda_b": 7.0},
    "morse": {"morse_a": 3.0},
    "power": {"power_order": 5, "power_c": -2.0},
}
STRAINS = [-0.3, -0.1, -0.0999, -1e-2, -1e-5, -1e-12, 0.0, 1e-12, 1e-5, 1e-2, 0.0999, 0.1, 0.2]


def test_every_named_potential_is_there():
    assert set(run("Object.keys(BONDS)")) == set(CHAIN_POTENTIALS)


@pytest.mark.parametrize("name", BONDS)
def test_bonds_are_the_programs(name):
    bond = Scene(potential=name, **BONDS[name]).bond
    found = run(
        """(() => {
          const bond = bondOf(scene), force = new Float64Array(strains.length);
          bond.forces(Float64Array.from(strains), force);
          return { energy: strains.map(bond.energy), force: [...force],
                   curvature: strains.map(bond.curvature), unit: naturalSpeed(bond),
                   depth: bond.depth, convex: bond.convex, barrier: bond.barrier };
        })()""",
        scene={"potential": name, **BONDS[name]},
        strains=STRAINS,
    )
    for what in ("energy", "force", "curvature"):
        expected = getattr(bond, what)(np.array(STRAINS))
        # Each result has a few rounding errors of terms up to ten times the value. Beyond |s| =
        # 0.1, cancellation loses a factor of 20.
        assert found[what] == pytest.approx(expected, rel=100 * EPSILON, abs=0.0), what
    assert found["unit"] == bond.natural_speed
    limits = (bond.dissociation, bond.convex_strain, bond.barrier_strain)
    for what, limit in zip(("depth", "convex", "barrier"), limits, strict=True):
        assert float(found[what]) == pytest.approx(limit, rel=4 * EPSILON), what


def test_steps_are_made_of_the_weights_of_order_8():
    weights = run("KICKS")
    assert tuple(weights) == COMPOSITIONS["order8"].weights
    assert run("DRIFTS.length") == len(weights) + 1


def test_errors_fall_with_the_eighth_power_of_the_step():
    etas = run(
        "[0.4, 0.2, 0.05].map((step) => follow(prepare(scene), step, "
        "{ most: 1e9, patience: 6 }).restitution)",
        scene={"potential": "toda", "particles": 3, "toda_b": 2.0, "speed": 0.3},
    )
    first, second = (abs(eta - etas[2]) for eta in etas[:2])
    assert second > 1e3 * EPSILON
    # The next term of the series has order 10, which changes the order at these steps by about one.
    assert 7.0 < math.log2(first / second) < 10.0


@pytest.mark.parametrize("name", ["harmonic-2", "harmonic-100", "rods", "lj-20", "warm-harmonic"])
def test_restitution_is_that_of_collide(name):
    found = run("collide(scene, { film: false })", scene=page_scene(SCENES[name]))
    expected = reference(name)
    difference = abs(found["restitution"] - expected.restitution)
    assert difference <= PROMISE
    assert difference <= found["error"] + expected.restitution_error
    assert len(found["contacts"]) == expected.contacts
    times, speeds = np.transpose(found["contacts"])
    # Errors of eta come from errors of velocities, which a chain of n particles amplifies by about
    # n.
    assert times == pytest.approx(expected.contact_times, abs=1e-6)
    assert speeds * expected.velocity == pytest.approx(expected.contact_speeds, abs=1e-6)


def test_one_particle_just_turns_round():
    # Exercise 1.1 uses one particle. It has no bond that could determine the step.
    scenes = [{"potential": name, "particles": 1, **BONDS[name]} for name in BONDS]
    scenes += [{"potential": "lj", "particles": 1, "target_particles": 1, "masses": [1e-3]}]
    found = run(
        "scenes.map((scene) => { const r = collide({ ...scene, velocity: 0.1 });"
        "return [r.restitution, r.contacts.length, r.ending, r.spectrum.length]; })",
        scenes=scenes,
    )
    for eta, *others in found:
        assert eta == pytest.approx(1.0, abs=4 * EPSILON)
        assert others == [1, "proved", 1]


@pytest.mark.parametrize("name", ["lj-10", "masses-2"])
def test_energies_and_modes_are_those_of_collide(name):
    found = run(
        "(({ energies, spectrum }) => ({ energies, spectrum: [...spectrum] }))(collide(scene))",
        scene=SCENES[name],
    )
    expected = reference(name)
    # A cold chain has only translational energy, so that the fractions add up to one.
    assert sum(found["energies"]) == pytest.approx(1.0, abs=1e-9)
    unit = (
        0.5
        * expected.velocity**2
        * np.sum(np.resize(SCENES[name].get("masses", 1.0), expected.particles))
    )
    assert found["energies"][0] == pytest.approx(expected.restitution, abs=PROMISE)
    modes = np.array(found["spectrum"]) * unit
    assert modes == pytest.approx(expected.mode_energies, abs=10 * PROMISE * unit)


def test_frequencies_of_unequal_masses():
    masses = np.array([1.0, 3.0, 0.2, 1.0, 7.0, 1.0, 0.5])
    found = run("[...modesOf(Float64Array.from(masses)).omega]", masses=masses.tolist())
    stiffness = 2.0 * np.eye(7) - np.eye(7, k=1) - np.eye(7, k=-1)
    stiffness[0, 0] = stiffness[-1, -1] = 1.0
    squares = np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(masses, masses)))
    assert np.square(found[1:]) == pytest.approx(squares[1:], abs=50 * EPSILON * squares[-1])
    equal = run("[...modesOf(new Float64Array(6).fill(2)).omega]")
    assert equal == pytest.approx(mode_frequencies(6) / math.sqrt(2.0), abs=8 * EPSILON)


@pytest.mark.slow
def test_an_end_that_is_proved_has_no_later_contact():
    # The chains include those that break, with late contacts, and those that stay whole.
    scenes = [
        {"potential": name, "particles": n, "speed": speed}
        for name in ("lj", "morse")
        for n in (4, 7, 11, 18)
        for speed in (0.3, 0.75, 1.05, 1.4, 2.0)
    ]
    found = run(
        "scenes.map((scene) => { const r = collide(scene, { goal: 1e-7, film: false });"
        "return [r.ending, r.contacts.length, r.restitution, r.error]; })",
        scenes=scenes,
    )
    proved = 0
    for scene, (ending, contacts, eta, error) in zip(scenes, found, strict=True):
        if ending != "proved":
            continue
        proved += 1
        result = collide(Scene(engine="reference", **scene), tolerance=1e-7)
        assert result.contacts == contacts, scene
        assert abs(result.restitution - eta) <= error + result.restitution_error, scene
    assert proved >= 10


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        ({"potential": "harmonic", "particles": 10, "velocity": 0.9}, "pass through each other"),
        (
            {"potential": "power", "power_order": 3, "power_c": -1, "particles": 40, "speed": 0.3},
            "beyond its barrier",
        ),
        ({"potential": "log", "particles": 10, "speed": 9}, "too short"),
        ({"potential": "lj", "particles": 10, "speed": 0.3, "temperature": 0.1}, "too high"),
        ({"potential": "lj", "particles": 10, "speed": 1e-5, "temperature": 1e-3}, "Too slow"),
    ],
)
def test_what_the_page_cannot_do_is_refused_by_name(scene, words):
    message = run(
        "(() => { try { collide(scene, { film: false }); return 'none'; } "
        "catch (problem) { return problem instanceof Refusal ? problem.message : problem.stack; } "
        "})()",
        scene=scene,
    )
    assert words in message


DRAW = """(() => {
  const all = [];
  for (let seed = 1; seed <= seeds; seed++) {
    const { line, state } = prepare({ ...scene, seed });
    all.push([[...state.strains], [...state.velocities], [...line.masses].slice(1)]);
  }
  return all;
})()"""


@pytest.mark.slow
def test_warm_states_are_of_equilibrium():
    scene = {"potential": "lj", "particles": 40, "velocity": 0.05, "temperature": 1e-3}
    drawn = run(DRAW, scene=scene, seeds=250)
    bonds = bond_distribution(Scene(potential="lj").bond, 1e-3)
    strains = np.array([row[0][1:] for row in drawn])
    velocities = np.array([row[1][1:] for row in drawn])
    shares = np.sort(bonds.share_below(strains.ravel()))
    # In Kolmogorov's test, a distribution differs by more than 1.95/sqrt(N) once in a thousand
    # draws.
    distance = np.max(np.abs(shares - (np.arange(len(shares)) + 0.5) / len(shares)))
    assert distance < 1.95 / math.sqrt(len(shares))
    assert velocities.mean(axis=1) == pytest.approx(-0.05, abs=100 * EPSILON)
    # The variance is (1 - 1/n) T, within four standard errors.
    variance = np.sum((velocities + 0.05) ** 2) / (250 * 39)
    assert variance == pytest.approx(1e-3, rel=4.0 * math.sqrt(2.0 / 9750))
    # The centre of mass starts at the same distance in every draw.
    places = np.cumsum(np.array([row[0] for row in drawn]), axis=1).mean(axis=1)
    assert places == pytest.approx(places[0], rel=1e-12)
    assert len({tuple(row) for row in strains.tolist()}) == 250
