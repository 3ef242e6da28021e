"""Test two bodies in LAMMPS: unequal masses, free targets, soft contacts, initial states."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.errors import LostAtomsError, RunError, TimestepError

SHARP = Numerics(scheme="order8", timestep=0.1)
# An integration that shares no code with the engine gave these values to 1e-9.
CASES = [
    (
        {"potential": "harmonic", "particles": 20, "velocity": 0.1, "masses": (1, 3)},
        (0.9118983725, 30, 57.00675361988322),
    ),
    (
        {"potential": "lj", "particles": 16, "velocity": 0.038546717968500004, "masses": (1, 2)},
        (0.7908363727, 19, 30.88497562170206),
    ),
    (
        {"potential": "harmonic", "particles": 12, "velocity": 0.1, "target_particles": 12},
        (0.7849105988, 10, 20.63855204009182),
    ),
    (
        {"potential": "lj", "particles": 10, "velocity": 0.0642445299475, "target_particles": 20},
        (0.2451775652, 9, 15.8448102021144),
    ),
    (
        {
            "potential": "toda",
            "particles": 10,
            "velocity": 0.1014433565404,
            "target_particles": 1,
            "target_masses": (5,),
        },
        (0.169426581, 6, 14.123170998344252),
    ),
    (
        {
            "potential": "log",
            "particles": 12,
            "velocity": 0.2901128833491,
            "masses": (2, 1),
            "target_particles": 6,
        },
        (0.2332762292, 5, 9.359987368860892),
    ),
]


def momenta(scene, outcome):
    """Return the momenta gained by chain and target, divided by the incoming one, and this one."""
    line = scene.line
    came = float(np.sum(line.chain_masses)) * scene.impact_velocity
    chain = line.chain_masses @ (outcome.velocities - line.velocities[line.first :])
    return chain / came, float(line.target_masses @ outcome.target_velocities) / came, came


@pytest.mark.parametrize(("fields", "expected"), CASES, ids=lambda c: str(c)[:40])
def test_reference_values(fields, expected):
    scene = Scene(**fields)
    outcome = lammps.run(scene.problem, SHARP)
    eta, contacts, last = expected
    assert abs(outcome.eta - eta) <= 1.5e-10
    assert len(outcome.contact_times) == contacts
    assert outcome.contact_times[-1] == pytest.approx(last, abs=1e-8)
    assert outcome.energy_end == pytest.approx(outcome.energy_start, rel=1e-11)
    chain, target, came = momenta(scene, outcome)
    assert np.sum(outcome.impulses) / came == pytest.approx(chain, abs=1e-12)
    if scene.target_particles is not None:
        assert chain + target == pytest.approx(0.0, abs=1e-12)
        assert outcome.target_displacements.shape == (scene.target_particles,)


def test_verlet_steps_converge_to_the_same_value_at_second_order():
    fields, (eta, *_) = CASES[3]
    scene = Scene(**fields)
    errors = [
        abs(lammps.run(scene.problem, Numerics(scheme="verlet", timestep=h)).eta - eta)
        for h in (0.02, 0.01)
    ]
    assert 3.0 < errors[0] / errors[1] < 5.0


def test_a_heavy_first_particle_takes_nearly_all_energy():
    # For n = 2, this ratio of masses gives the least e, published as 0.178.
    scene = Scene(potential="harmonic", particles=2, masses=(1.43447, 1.0), velocity=0.1)
    assert math.sqrt(lammps.run(scene.problem, SHARP).eta) == pytest.approx(0.178465, abs=1e-6)


def test_identical_chains_meet_like_one_at_a_wall():
    # A mirror image acts as a wall, and eta of a harmonic chain does not depend on speed.
    pair = Scene(potential="harmonic", particles=50, target_particles=50, velocity=0.1)
    alone = Scene(potential="harmonic", particles=50, velocity=0.1)
    eta = restitution(lammps.run(alone.problem, SHARP).velocities, 0.1)
    assert lammps.run(pair.problem, SHARP).eta == pytest.approx(float(eta), abs=1e-10)


def test_a_chain_on_one_of_twice_its_length():
    scene = Scene(potential="harmonic", particles=10, target_particles=20, velocity=0.1)
    assert math.sqrt(lammps.run(scene.problem, SHARP).eta) == pytest.approx(0.50721, abs=1e-5)


def test_a_heavy_target_is_the_wall():
    wall = Scene(potential="lj", particles=10, velocity=0.05)
    heavy = wall.replace(target_particles=1, target_masses=(1e9,))
    eta = float(restitution(lammps.run(wall.problem, SHARP).velocities, 0.05))
    # The target takes relative amounts of 10/1e9 of the momentum and of the energy.
    assert lammps.run(heavy.problem, SHARP).eta == pytest.approx(eta, abs=1e-7)


BODIES = [
    {},
    {"contact": "power", "contact_stiffness": 0.5},
    {"contact": "power", "contact_stiffness": 20.0, "contact_exponent": 2.0},
]


@pytest.mark.parametrize("contact", BODIES, ids=["hard", "hertz", "square"])
def test_bodies_can_be_exchanged(contact):
    one, other = {"particles": 6, "masses": (1, 2, 1.5)}, {"particles": 4, "masses": (3,)}
    etas = []
    for chain, target in ((one, other), (other, one)):
        struck = {f"target_{key}": value for key, value in target.items()}
        scene = Scene(potential="lj", velocity=0.05, **chain, **struck, **contact)
        outcome = lammps.run(scene.problem, SHARP)
        etas.append((outcome.eta, len(outcome.contact_times)))
    # The motion is the same, seen from the other body. Coordinates are rounded to 1e-15; v0 is
    # 0.05.
    assert etas[0][0] == pytest.approx(etas[1][0], abs=1e-11)
    assert etas[0][1] == etas[1][1]


@pytest.mark.parametrize("contact", BODIES[:2], ids=["hard", "hertz"])
def test_four_times_the_masses_are_half_as_fast(contact):
    fields = {"potential": "toda", "particles": 7, "target_particles": 3, **contact}
    light = Scene(masses=(1, 2), target_masses=(1.5,), velocity=0.1, **fields)
    heavy = Scene(masses=(4, 8), target_masses=(6.0,), velocity=0.05, **fields)
    fast, slow = (
        lammps.run(scene.problem, replace(SHARP, timestep=h))
        for scene, h in ((light, 0.1), (heavy, 0.2))
    )
    assert slow.eta == pytest.approx(fast.eta, abs=1e-12)
    assert slow.contact_times == pytest.approx(2.0 * fast.contact_times, abs=1e-10)


def write_state(path, positions, velocities):
    rows = [f"{x!r},{v!r}" for x, v in zip(positions.tolist(), velocities.tolist(), strict=True)]
    path.write_text("\n".join(["position,velocity", *rows]))


@pytest.mark.parametrize("contact", BODIES, ids=["hard", "hertz", "square"])
def test_time_reversal(contact, tmp_path):
    scene = Scene(potential="lj", particles=8, masses=(2, 1), velocity=0.05, **contact)
    forth = lammps.run(scene.problem, SHARP)
    places = np.arange(8.0) + forth.displacements
    write_state(tmp_path / "end.csv", places - places[0], -forth.velocities)
    back_scene = Scene(
        potential="lj", particles=8, masses=(2, 1), initial=tmp_path / "end.csv", **contact
    )
    back = lammps.run(back_scene.problem, SHARP)
    # The last contact of the reversed motion was the first contact, before which the chain was
    # cold. At this step, each motion has an error of 1e-10.
    assert len(back.contact_times) == len(forth.contact_times)
    assert back.velocities == pytest.approx(np.full(8, 0.05), abs=1e-9)
    assert np.diff(back.displacements) == pytest.approx(np.zeros(7), abs=1e-9)
    assert back.eta == pytest.approx(1.0 / forth.eta, rel=1e-8)


def test_a_chain_that_comes_from_afar_counts_from_its_first_contact(tmp_path):
    rng = np.random.default_rng(5)
    path = tmp_path / "state.csv"
    places = np.cumsum([0.7, *(1.0 + 0.03 * rng.normal(size=7))])
    write_state(path, places, -0.05 + 0.02 * rng.normal(size=8))
    scene = Scene(potential="lj", particles=8, initial=path, target_particles=3)
    outcome = lammps.run(scene.problem, SHARP, frame_interval=0.5)
    assert outcome.contact_times[0] == 0.0
    frames = outcome.frames
    # The first frame is the initial state, from which the contact takes at least the gap divided by
    # the speed.
    assert frames.times[0] < -0.7 / 0.15
    assert frames.displacements[0] == pytest.approx(places - np.arange(8.0), abs=1e-14)
    # At natural length, the force of the table is 0 up to rounding.
    assert np.max(np.abs(frames.target_velocities[frames.times < 0.0])) < 1e-12
    assert frames.target_displacements.shape == frames.target_velocities.shape
    assert outcome.energy_end == pytest.approx(outcome.energy_start, rel=1e-9)
    # Without frames, results are equal to the last bit.
    assert np.array_equal(lammps.run(scene.problem, SHARP).velocities, outcome.velocities)


def test_a_chain_at_rest_in_itself_starts_at_its_first_contact(tmp_path):
    write_state(tmp_path / "far.csv", 1e6 + np.arange(5.0), np.full(5, -0.05))
    far = Scene(potential="lj", particles=5, initial=tmp_path / "far.csv")
    near = Scene(potential="lj", particles=5, velocity=0.05)
    outcome = lammps.run(far.problem, SHARP)
    assert outcome.velocities.tolist() == lammps.run(near.problem, SHARP).velocities.tolist()


def test_compressed_bonds_give_their_energy():
    scene = Scene(potential="harmonic", particles=2, velocity=0.1, compression=0.05)
    outcome = lammps.run(scene.problem, SHARP)
    assert outcome.energy_start == pytest.approx(0.01 + 0.5 * 0.05**2)
    assert outcome.energy_end == pytest.approx(outcome.energy_start, rel=1e-12)
    assert outcome.bond_min <= 0.95


def test_the_stock_wall_reflects_unequal_masses():
    scene = Scene(potential="lj", particles=10, masses=(1, 3), velocity=0.05)
    exact = lammps.run(scene.problem, SHARP).eta
    outcome = lammps.run(scene.problem, Numerics(wall="reflect", scheme="verlet", timestep=0.002))
    chain, _, came = momenta(scene, outcome)
    assert np.sum(outcome.impulses) / came == pytest.approx(chain, abs=1e-12)
    # Each of some ten contacts has an error of first order.
    assert outcome.eta == pytest.approx(exact, abs=10 * 0.002)


# A contact of two particles with the force K d^q begins at relative speed w. It lasts T = 2 (D/w)
# sqrt(pi) G(1 + 1/p)/G(1/2 + 1/p), with D^p = p mu w^2/(2 K) and p = q + 1.
@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0, 3.7])
@pytest.mark.parametrize("scheme", ["verlet", "order4", "order8"])
def test_two_soft_particles(exponent, scheme):
    stiffness, speed, p = 2.0, 0.05, exponent + 1.0
    scene = Scene(
        particles=1,
        masses=(2,),
        target_particles=1,
        target_masses=(3,),
        velocity=speed,
        contact="power",
        contact_stiffness=stiffness,
        contact_exponent=exponent,
    )
    step = 0.002 if scheme == "verlet" else 0.1
    outcome = lammps.run(scene.problem, Numerics(scheme=scheme, timestep=step))
    error = 1e-5 if scheme == "verlet" else 1e-6 if scheme == "order4" else 1e-9
    deepest = (p * 1.2 * speed**2 / (2.0 * stiffness)) ** (1.0 / p)
    duration = 2.0 * deepest / speed * math.sqrt(math.pi)
    duration *= math.gamma(1.0 + 1.0 / p) / math.gamma(0.5 + 1.0 / p)
    centre = -2.0 * speed / 5.0
    assert outcome.velocities == pytest.approx([speed + 2.0 * centre], rel=error)
    assert outcome.target_velocities == pytest.approx([2.0 * centre], rel=error)
    assert outcome.displacements == pytest.approx([centre * duration], rel=error)
    assert outcome.target_displacements[0] == outcome.displacements[0]
    assert outcome.impulses == pytest.approx([2.0 * 1.2 * speed], rel=error)
    assert (outcome.contact_times[0], outcome.contact_speeds[0]) == (0.0, speed)


def plain_soft_eta(scene, longest):
    """Integrate the equations of motion of a soft contact from event to event."""
    line, bond = scene.line, scene.bond
    (stiffness, exponent), gap = line.contact.parameters, line.gap
    count = len(line.masses)

    def rates(touching):
        def function(_, state):
            strains, velocities = state[: count - 1], state[count - 1 :]
            force = np.array(bond.force(strains))
            force[gap] = stiffness * max(-strains[gap], 0.0) ** exponent if touching else 0.0
            pushes = np.concatenate(([0.0], force)) - np.concatenate((force, [0.0]))
            return np.concatenate((np.diff(velocities), pushes * line.inverse_masses))

        return function

    def gap_of(_, state):
        return state[gap]

    gap_of.terminal = True
    state, time, touching, after = np.concatenate((line.strains, line.velocities)), 0.0, True, None
    exact = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}
    while time < longest:
        # The first step leaves the event at which the interval begins.
        start = solve_ivp(rates(touching), (time, time + 1e-3), state, **exact)
        found = solve_ivp(
            rates(touching), (time + 1e-3, longest), start.y[:, -1], events=gap_of, **exact
        )
        time, state = found.t[-1], found.y[:, -1]
        if found.status == 1:
            after = state if touching else after
            touching = not touching
    return (line.separation(after[count - 1 :]) / scene.impact_velocity) ** 2


def soft_scene(exponent, **fields):
    return Scene(
        potential="lj",
        velocity=0.05,
        contact="power",
        contact_exponent=exponent,
        **fields,
    )


@pytest.mark.slow_cases
@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0, 3.0])
def test_steps_keep_their_order_in_a_soft_contact(exponent):
    """Require the full order, which steps across the kink of the force would reduce."""
    scene = soft_scene(
        exponent, particles=6, masses=(1, 2), target_particles=4, contact_stiffness=0.5
    )
    reference_value = plain_soft_eta(scene, 60.0)
    for scheme, order, steps in (
        ("verlet", 2, (0.04, 0.02)),
        ("order4", 4, (0.2, 0.05)),
        ("order6", 6, (0.4, 0.1)),
        ("order8", 8, (0.8, 0.4)),
    ):
        coarse, fine = (
            abs(
                lammps.run(scene.problem, Numerics(scheme=scheme, timestep=h)).eta - reference_value
            )
            for h in steps
        )
        assert math.log2(coarse / fine) / math.log2(steps[0] / steps[1]) > order - 0.7


def test_a_stiff_wall_is_hit_many_times():
    scene = soft_scene(1.5, particles=12, contact_stiffness=100.0)
    reference_value = plain_soft_eta(scene, 60.0)
    outcome = lammps.run(scene.problem, Numerics(scheme="order8", timestep=0.1))
    assert len(outcome.contact_times) > 5
    assert outcome.eta == pytest.approx(reference_value, abs=1e-9)
    chain, _, came = momenta(scene, outcome)
    assert np.sum(outcome.impulses) / came == pytest.approx(chain, abs=1e-12)


def test_runs_at_several_steps_are_those_of_their_own():
    scene = soft_scene(1.5, particles=4, target_particles=2, contact_stiffness=3.0)
    numerics = Numerics(scheme="order6", bond_range=(0.8, 1.4))
    for outcome, h in zip(
        lammps.run_at_steps(scene.problem, numerics, (0.2, 0.1)), (0.2, 0.1), strict=True
    ):
        alone = lammps.run(scene.problem, replace(numerics, timestep=h))
        assert np.array_equal(outcome.velocities, alone.velocities)
        assert np.array_equal(outcome.target_displacements, alone.target_displacements)


# With the first target, its last bonds break; with the second, its first bond.
TARGETS = [
    pytest.param({"target_particles": 20}, marks=pytest.mark.slow),
    {"target_particles": 3, "target_masses": (4, 1, 1)},
]


@pytest.mark.parametrize("target", TARGETS)
def test_broken_bonds_of_the_target_change_to_the_far_table(target):
    scene = Scene(potential="lj", particles=10, speed=4.0, masses=(3,), **target)
    numerics = Numerics(scheme="order8", timestep=0.02)
    outcome = lammps.run(scene.problem, numerics, frame_interval=1.0)
    frames = outcome.frames
    lengths = (
        1.0 + np.diff(frames.displacements[-1]),
        1.0 - np.diff(frames.target_displacements[-1]),
    )
    assert np.max(lengths[1]) > 2.5
    kinetic = 0.5 * (3.0 * frames.velocities[-1] @ frames.velocities[-1])
    kinetic += 0.5 * scene.line.target_masses @ np.square(frames.target_velocities[-1])
    bonds = np.sum(scene.bond.energy(np.concatenate(lengths) - 1.0))
    assert kinetic + bonds == pytest.approx(outcome.energy_start, rel=1e-9)
    # The flight after the last contact does not change eta.
    assert lammps.run(scene.problem, numerics).eta == pytest.approx(outcome.eta, abs=1e-10)


def test_a_dump_has_both_bodies(tmp_path):
    scene = Scene(
        potential="harmonic",
        particles=3,
        target_particles=2,
        velocity=0.1,
        dump=tmp_path / "motion.lammpstrj",
        dump_frames="contacts",
    )
    outcome = lammps.run(scene.problem, SHARP, files=scene.run_files)
    frames = list(Dump(tmp_path / "motion.lammpstrj"))
    assert len(frames) == len(outcome.contact_times) + 1
    first = frames[-2]
    assert first.column("mol").tolist() == [1, 1, 1, 2, 2]
    both = np.concatenate((outcome.displacements, outcome.target_displacements))
    assert first.column("v_displacement") == pytest.approx(both, abs=1e-15)


@pytest.mark.parametrize("contact", BODIES[:2], ids=["hard", "soft"])
@pytest.mark.slow_cases
def test_steps_that_explode_are_refused_by_name(contact):
    scene = Scene(potential="lj", particles=6, masses=(1e-4, 1), velocity=0.1, **contact)
    with pytest.raises((LostAtomsError, TimestepError, RunError)):
        lammps.run(scene.problem, Numerics(scheme="verlet", timestep=0.1))
