"""Test results on both bodies: balances, modes and labels, which plain results lack."""

import json
import math

import numpy as np
import pytest

from chaincor.analysis.modes import anharmonic_remainder
from chaincor.analysis.observables import OF_RUNS
from chaincor.analysis.run_record import impulse_residual
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import CostError, RunError
from chaincor.workflows.result import TARGET_ARRAYS
from chaincor.workflows.showing.text import describe_result

IN_HOUSE = {"engine": "reference", "tolerance": 1e-8}
SCENES = {
    "masses": Scene(particles=6, masses=[1, 3], speed=0.4, **IN_HOUSE),
    "target": Scene(
        potential="toda",
        particles=6,
        masses=[2, 1],
        target_particles=4,
        target_masses=[1, 0.5],
        speed=0.4,
        **IN_HOUSE,
    ),
    "one heavy particle": Scene(
        potential="harmonic",
        particles=5,
        velocity=0.1,
        target_particles=1,
        target_masses=[7],
        **IN_HOUSE,
    ),
    "soft": Scene(particles=5, target_particles=5, contact="power", speed=0.3, **IN_HOUSE),
    "compressed": Scene(particles=5, compression=0.02, speed=0.4, **IN_HOUSE),
}


@pytest.fixture(scope="module", params=SCENES)
def both(request):
    scene = SCENES[request.param]
    return scene, collide(scene)


def test_eta_is_the_ratio_of_relative_translational_energies(both):
    scene, result = both
    line, v0 = scene.line, scene.impact_velocity
    apart = result.velocity_after - (result.target_velocity_after or 0.0)
    assert result.restitution == pytest.approx((apart / v0) ** 2, rel=1e-12)
    assert result.kinematic_restitution == math.sqrt(result.restitution)
    # In the frame of the common centre of mass, the energy is mu (relative speed)^2 / 2.
    total = line.chain_masses @ result.velocities
    mass = float(np.sum(line.chain_masses))
    energy = result.translational_energy
    if not line.rigid:
        total += line.target_masses @ result.target_velocities
        mass += float(np.sum(line.target_masses))
        energy += result.target_translational_energy - 0.5 * total**2 / mass
    assert energy == pytest.approx(0.5 * line.reduced_mass * apart**2, rel=1e-10)


def test_momentum_and_energy_are_balanced(both):
    scene, result = both
    line, v0 = scene.line, scene.impact_velocity
    momentum = -float(np.sum(line.chain_masses)) * v0
    energy = 0.5 * float(line.chain_masses @ line.velocities[line.first :] ** 2)
    energy += float(np.sum(scene.bond.energy(np.delete(line.strains, line.gap))))
    after = result.translational_energy + result.vibrational_energy
    if not line.rigid:
        after += result.target_translational_energy + result.target_vibrational_energy
        # The tolerance covers rounding of N additions.
        found = line.chain_masses @ result.velocities + line.target_masses @ (
            result.target_velocities
        )
        assert found == pytest.approx(momentum, rel=1e-13)
    # The tolerance of eta is 1e-8, and energy errors are of this size.
    assert after == pytest.approx(energy, rel=1e-7)
    assert result.momentum_residual < 1e-12


@pytest.mark.parametrize("engine", ["reference", "lammps"])
@pytest.mark.parametrize("contact", ["hard", "power"])
def test_which_body_is_called_the_target_decides_nothing(engine, contact):
    # By reflection and Galilean invariance, the two scenes are the same collision with the roles of
    # chain and target exchanged.
    bodies = {"particles": 6, "masses": (1.0, 2.0), "target_particles": 3, "target_masses": (1.5,)}
    turned = {"particles": 3, "masses": (1.5,), "target_particles": 6, "target_masses": (1.0, 2.0)}
    shared = {"potential": "lj", "contact": contact, "engine": engine, "tolerance": 1e-8}
    seen = collide(Scene(**shared, **bodies, speed=0.5))
    by_target = collide(Scene(**shared, **turned, velocity=seen.velocity))
    bar = seen.restitution_error + by_target.restitution_error
    assert abs(seen.restitution - by_target.restitution) <= bar
    assert seen.contacts == by_target.contacts
    # eta is relative to the energy of the relative motion, 1/2 mu v0^2, with the bodies' reduced
    # mass mu.
    chain, target = 3 * (1.0 + 2.0), 3 * 1.5
    relative = 0.5 * chain * target / (chain + target) * seen.velocity**2
    vibrating = [seen.vibrational_energy, seen.target_vibrational_energy]
    other = [by_target.target_vibrational_energy, by_target.vibrational_energy]
    assert vibrating == pytest.approx(other, abs=bar * relative)


def test_modes_of_each_body_have_its_energy(both):
    scene, result = both
    bodies = [
        (
            result.mode_energies,
            result.translational_energy,
            result.vibrational_energy,
            result.displacements,
        )
    ]
    if result.target_particles:
        bodies.append(
            (
                result.target_mode_energies,
                result.target_translational_energy,
                result.target_vibrational_energy,
                -result.target_displacements,
            )
        )
    for modes, translation, vibration, displacements in bodies:
        assert modes[0] == pytest.approx(translation, rel=1e-12)
        rest = vibration - float(anharmonic_remainder(displacements, scene.bond))
        assert float(np.sum(modes[1:])) == pytest.approx(rest, rel=1e-10, abs=1e-18)


def test_json_and_arrays(both, tmp_path):
    scene, result = both
    plain = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    free = scene.target_particles is not None
    assert {name for name in plain if name.startswith("target")} == (
        {
            "target_particles",
            "target_velocity_after",
            "target_translational_energy",
            "target_vibrational_energy",
        }
        | ({"target_masses"} if scene.target_masses else set())
        if free
        else set()
    )
    assert plain.get("masses") == (None if scene.masses is None else list(scene.masses))
    assert ("contact" in plain) == (scene.contact == "power")
    result.save_arrays(tmp_path / "a.npz")
    with np.load(tmp_path / "a.npz") as file:
        assert ("target_mode_energies" in file.files) == free
        if free:
            assert file["target_velocities"].shape == (scene.target_particles,)


def test_a_soft_contact_says_its_law():
    result = collide(SCENES["soft"])
    assert (result.contact_stiffness, result.contact_exponent) == (1.0, 1.5)


def test_a_plain_result_says_nothing_of_bodies():
    result = collide(Scene(particles=4, masses=[1, 1], **IN_HOUSE))
    of_bonds = ("energy", "parameters", "stiffness", "natural_length")
    of_runs = ("contacts_range", "last_contact_error", "reference_restitution", "reference_error")
    others = (*of_bonds, *of_runs)
    of_bodies = [each.name for each in OF_RUNS if each.rare and each.name not in others]
    assert set(TARGET_ARRAYS) < set(of_bodies)
    assert all(getattr(result, name) is None for name in of_bodies)
    assert not set(of_bodies) & set(result.to_dict())
    assert not {name for name in result.arrays() if "target" in name}


def test_masses_of_a_state_are_in_the_result(tmp_path):
    (tmp_path / "s.csv").write_text("strain,velocity,mass\n0,-0.1,2\n0.01,-0.2,1\n")
    scene = Scene(potential="harmonic", particles=2, initial=tmp_path / "s.csv", **IN_HOUSE)
    plain = collide(scene).to_dict()
    assert plain["masses"] == [2.0, 1.0]
    assert plain["initial"] == str(tmp_path / "s.csv")
    assert plain["velocity"] == pytest.approx(0.4 / 3.0, rel=1e-15)


def test_an_impulse_that_one_body_did_not_get_is_seen():
    scene = SCENES["target"]
    line, outcome = scene.line, _Outcome(scene)
    assert impulse_residual(line, outcome, scene.impact_velocity) < 1e-15
    outcome.target_velocities[0] += 0.01
    mass = float(np.sum(line.chain_masses))
    wrong = 0.01 * line.target_masses[0] / (mass * scene.impact_velocity)
    assert impulse_residual(line, outcome, scene.impact_velocity) == pytest.approx(wrong, rel=1e-9)


class _Outcome:
    """Two bodies that exchanged one impulse of 0.1 between their first particles."""

    def __init__(self, scene):
        line = scene.line
        self.impulses = np.array([0.1])
        self.velocities = np.full(scene.particles, -scene.impact_velocity)
        self.velocities[0] += 0.1 / line.chain_masses[0]
        self.target_velocities = np.zeros(scene.target_particles)
        self.target_velocities[0] -= 0.1 / line.target_masses[0]


def test_what_is_printed_names_what_was_hit():
    text = {name: describe_result(collide(scene)) for name, scene in SCENES.items()}
    assert "masses 1, 3 from the contact outward" in text["masses"]
    assert "event wall" in text["masses"]
    assert "\nchain                  velocity 0." in text["masses"]
    for name in ("target", "one heavy particle", "soft"):
        assert "wall" not in text[name]
        assert text[name].count("of the relative motion") == 2
        assert "\ntarget                 velocity -0." in text[name]
    assert "onto a free target: 1 particle, masses 7" in text["one heavy particle"]
    assert "soft contact: force K d^q of the overlap d, K = 1, q = 1.5" in text["soft"]
    assert ", the last begins at t = " in text["soft"]
    assert "up to the end of the last contact" in text["soft"]
    assert ", the last at t = " in text["one heavy particle"]
    assert "bonds shorter by 0.02 at first" in text["compressed"]
    plain = describe_result(collide(Scene(particles=4, **IN_HOUSE)))
    assert "of the initial momentum" in plain
    assert "chain  " not in plain


@pytest.mark.parametrize("name", ["target", "one heavy particle"])
def test_the_motion_has_both_bodies(name):
    scene = SCENES[name]
    result = collide(scene)
    states = result.trajectory(60)
    masses = np.concatenate((scene.line.chain_masses, scene.line.target_masses))
    n, targets = scene.particles, scene.target_particles
    assert states[0].all_positions.tolist() == [*range(n), *range(0, -targets, -1)]
    start = 0.5 * float(np.sum(masses[:n])) * scene.impact_velocity**2
    for state, atoms in zip(states, result.to_ase(60), strict=True):
        assert np.array_equal(atoms.positions[:, 0], state.all_positions)
        assert np.array_equal(atoms.get_masses(), masses)
        # The total energy includes the bonds of both bodies; the tolerance of eta is 1e-8.
        assert atoms.get_total_energy() == pytest.approx(start, rel=1e-6)
        assert abs(atoms.get_forces()[n:].sum()) < 1e-13
    assert list(atoms.arrays["bonds"]).count("_") == 2
    universe = result.to_universe(60)
    assert np.array_equal(universe.atoms.masses, masses)
    assert len(universe.bonds) == n + targets - 2
    assert np.array_equal(universe.trajectory[-1].data["vx"], states[-1].all_velocities)


def test_forces_on_a_target_are_the_slope_of_the_energy():
    scene = SCENES["target"]
    atoms = collide(scene).to_ase(60)[30]
    n, h = scene.particles, 1e-6
    x = atoms.positions[n:, 0]
    for i in range(scene.target_particles):
        low, high = x.copy(), x.copy()
        low[i] -= h
        high[i] += h
        slope = [float(np.sum(scene.bond.energy(-np.diff(each) - 1.0))) for each in (low, high)]
        # Central differences have errors of h^2 U''''/6 = 2e-11 with b = 10, and rounding of
        # 1e-17/h.
        assert atoms.get_forces()[n + i, 0] == pytest.approx(
            -(slope[1] - slope[0]) / (2.0 * h), abs=1e-8
        )


def test_contacts_too_stiff_for_lammps_are_named():
    scene = Scene(particles=4, contact="power", contact_stiffness=1e90)
    with pytest.raises(RunError, match=r"with contact_stiffness 1e\+90 the contact would vibrate"):
        collide(scene)
    # For such long times, one digit is enough.
    with pytest.raises(CostError, match=r"about \de\+\d+ days .* a smaller contact_stiffness"):
        collide(scene.replace(engine="reference"))
