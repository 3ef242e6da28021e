"""Test derivatives of eta against the tangent motion and against differences."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from chaincor import Scene, UserBond, collide
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.errors import SensitivityError
from chaincor.workflows.sensitivity import trace as tracing
from chaincor.workflows.sensitivity.sensitivity import gradient, sensitivity_of, variants_of
from chaincor.workflows.sensitivity.trace import trace
from tests.workflows.sensitivity.tangent import changed

STEP = 0.05
SCENES = {
    "cold": {"potential": "lj", "particles": 20, "speed": 0.5},
    "masses": {"potential": "toda", "particles": 6, "masses": (1.0, 2.0, 0.7), "speed": 0.4},
    "target": {
        "potential": "log",
        "particles": 8,
        "target_particles": 3,
        "target_masses": (2.0,),
        "speed": 0.2,
    },
    "warm": {"potential": "morse", "particles": 7, "temperature": 1e-4, "seed": 3, "speed": 0.5},
    "soft": {
        "potential": "power",
        "power_order": 4,
        "power_c": 2.0,
        "particles": 6,
        "contact": "power",
        "contact_stiffness": 2.0,
        "contact_exponent": 2.0,
        "speed": 0.3,
    },
    "rough": {
        "potential": "lj",
        "particles": 5,
        "contact": "power",
        "contact_stiffness": 1.0,
        "contact_exponent": 1.5,
        "speed": 0.3,
    },
    "soft target": {
        "potential": "formula",
        "energy": "a*(r-1)^2+c*(r-1)^4",
        "parameters": {"a": 0.5, "c": 2.0},
        "velocity": 0.1,
        "particles": 5,
        "target_particles": 4,
        "contact": "power",
        "contact_exponent": 1.0,
    },
}
# The loops of a formula take longest to compile.
NAMES = [*list(SCENES)[:-1], pytest.param("soft target", marks=pytest.mark.slow)]


def run(scene):
    return stepping.run(scene.problem, Numerics(scheme=tracing.SCHEME, timestep=STEP))


def traced(name):
    scene = Scene(engine="reference", **SCENES[name])
    outcome = run(scene)
    return scene, trace(scene, STEP, len(outcome.contact_times), outcome.duration)


def central(function, width):
    """Return a derivative by central differences, with an error of fourth order in the width."""
    far, near = (function(k * width) - function(-k * width) for k in (2.0, 1.0))
    return (8.0 * near - far) / (12.0 * width)


@pytest.mark.parametrize("name", NAMES)
def test_backward_is_the_transposed_of_forward(name):
    scene, collision = traced(name)
    line, rng = collision.line, np.random.default_rng(7)
    found = gradient(collision, [])
    strain, velocity = rng.standard_normal(len(line.strains)), rng.standard_normal(len(line.masses))
    velocity[: 1 if line.rigid else 0] = 0.0
    _, after = changed(collision, scene.bond, strain, velocity)
    end = next(iter(collision.backward()))[3]
    before, parted = line.separation(line.velocities), line.separation(end)
    forward = (
        2.0
        * found.restitution
        * (line.separation(after) / parted - line.separation(velocity) / before)
    )
    backward = found.strains @ strain + found.velocities @ velocity
    size = np.linalg.norm(found.strains) * np.linalg.norm(strain)
    size += np.linalg.norm(found.velocities) * np.linalg.norm(velocity)
    # The tolerance covers rounding in sums of some hundred products, in some ten steps of seventeen
    # stages.
    assert forward == pytest.approx(backward, abs=1e-12 * size)


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_are_those_of_whole_collisions(name):
    scene, collision = traced(name)
    found, v0 = gradient(collision, variants_of(scene)), scene.impact_velocity
    first, line = scene.line.first, scene.line

    def by_speed(change):
        changed = scene.without("speed").replace(velocity=v0 + change)
        return run(changed).eta

    # Differences of 5e-5, which a warm chain amplifies to 1e-2, have an error of fourth order, plus
    # rounding of eta divided by the difference. All runs have the same steps, whose error is in
    # each of the two derivatives.
    expected = central(by_speed, 5e-5 * v0)
    assert -np.sum(found.velocities[first:]) == pytest.approx(expected, rel=1e-6)
    assert found.residual < 1e-7
    parameters = zip(variants_of(scene), found.parameters, strict=True)
    if scene.temperature is not None:  # the random state depends on masses and bonds
        parameters = zip((), (), strict=True)
    else:
        chain, at = line.chain_masses, np.cos(np.arange(scene.particles))

        def by_mass(change):
            changed = scene.without("speed").replace(
                velocity=v0, masses=tuple((chain + change * at).tolist())
            )
            return run(changed).eta

        assert found.masses[first:] @ at == pytest.approx(central(by_mass, 3e-4), rel=1e-6)
    for variant, slope in parameters:

        def by_parameter(change, name=variant.name):
            fixed = scene.without("speed").replace(velocity=v0)
            if scene.parameters:
                given = scene.parameters | {name: scene.parameters[name] + change}
                changed = fixed.replace(parameters=given)
            else:
                changed = fixed.replace(**{name: scene.bond.as_keys()[name] + change})
            return run(changed).eta

        assert slope == pytest.approx(central(by_parameter, 1e-3), rel=1e-6)
    if line.soft:

        def by_stiffness(change):
            changed = scene.replace(contact_stiffness=line.contact.strength + change)
            return run(changed).eta

        assert found.strength == pytest.approx(central(by_stiffness, 1e-3), rel=1e-6)


def test_exact_cases():
    # The eta of a cold harmonic chain does not depend on speed or on the position of the wall.
    found = collide(Scene(potential="harmonic", particles=9, engine="reference")).sensitivity
    size = np.linalg.norm(found.velocities)
    assert abs(found.velocity) < 1e-10 * size
    assert abs(found.wall_place) < 1e-10 * size
    # Toda: U(s; b) = U(b s; 1)/b^2, so that eta depends on the product of b and speed alone. The
    # derivative by b comes from differences of 1e-5 b, with a relative error of the square of 1e-5.
    scene = Scene(potential="toda", toda_b=7.0, particles=9, masses=(1, 2), engine="reference")
    found = collide(scene).sensitivity
    by_speed = scene.impact_velocity * found.velocity
    assert 7.0 * found.parameters["toda_b"] == pytest.approx(by_speed, rel=1e-7)


def test_a_small_change_of_the_state_grows_as_it_is_pushed_forward(tmp_path):
    scene, collision = traced("cold")
    found, n = gradient(collision, []), scene.particles
    # The gap stays closed, because a chain cannot start inside the wall.
    size = math.hypot(np.linalg.norm(found.strains[1:]), np.linalg.norm(found.velocities))
    strain = np.concatenate(([0.0], found.strains[1:] / size))
    velocity = found.velocities / size
    velocity[0] = 0.0
    grown = np.concatenate(changed(collision, scene.bond, strain, velocity))
    # The amplification is that of eta, in the direction of its derivative.
    result = collide(scene)
    amplified = scene.impact_velocity * size / result.restitution
    assert result.sensitivity.amplification == pytest.approx(amplified, rel=1e-6)

    def after(change):
        at = scene.line.strains + change * strain
        v = (scene.line.velocities + change * velocity)[1:]
        rows = "\n".join(f"{s!r},{w!r}" for s, w in zip(at.tolist(), v.tolist(), strict=True))
        (tmp_path / "state.csv").write_text(f"strain,velocity\n{rows}\n")
        end = run(scene.without("speed").replace(initial=tmp_path / "state.csv"))
        strains = np.concatenate(([0.0], np.diff(end.displacements)))
        return np.concatenate((strains, [0.0], end.velocities))

    assert len(grown) == 2 * n + 1
    # As above, changes of 1e-5 have an error of fourth order, plus rounding divided by the change.
    assert central(after, 1e-5) == pytest.approx(grown, abs=1e-6 * np.linalg.norm(grown))


def test_rounding_is_what_runs_that_differ_in_the_last_digit_scatter_by():
    scene, collision = traced("cold")
    speeds = scene.impact_velocity * (1.0 + np.finfo(float).eps * np.arange(-12, 13))
    scenes = [scene.without("speed").replace(velocity=float(v)) for v in speeds]
    scatter = np.std([run(each).eta for each in scenes])
    # A standard deviation of 25 draws has an error of a seventh. The estimate assumes random
    # rounding.
    assert scatter / 3.0 < gradient(collision, []).rounding < 3.0 * scatter


def test_refusals_have_names(monkeypatch):
    scene = Scene(engine="reference", **SCENES["cold"])
    result = collide(scene)
    known = scene, result.contacts, result.duration, result.bond_min - 1.0
    with pytest.raises(SensitivityError, match="contacts by t"):
        trace(scene, STEP, result.contacts + 1, result.duration)
    with pytest.raises(SensitivityError, match="amplifies rounding"):
        sensitivity_of(*known, result.restitution + 1e-3, 1e-9)
    with pytest.raises(SensitivityError, match="Choose a collision that is over"):
        _ = collide(scene.replace(scheme="order8", timestep=0.1, error=False)).sensitivity
    monkeypatch.setattr(tracing, "GRAZING", 10.0)
    with pytest.raises(SensitivityError, match="a contact is grazing"):
        sensitivity_of(*known, result.restitution, 1e-9)
    names = iter(["once"])

    def unheard_of(strain):
        next(names, None)
        return -strain

    bond = UserBond(lambda s: 0.5 * s * s, unheard_of, name="odd")
    odd = collide(Scene(potential=bond, particles=3, velocity=0.1, engine="reference"))
    with pytest.raises(SensitivityError, match="cannot be compiled"):
        _ = odd.sensitivity


def test_the_command_prints_it(chaincor):
    asked = ["run", "--potential", "toda", "--particles", "4", "--engine", "reference"]
    asked += ["--target-particles", "2", "--contact", "power", "--contact-exponent", "2"]
    for extra in (["--json"], []):
        status, out, _ = chaincor(*asked, "--sensitivity", *extra)
        assert status == 0
        if extra:
            found = json.loads(out)["sensitivity"]
            assert len(found["masses"]) == 4
            assert len(found["target_masses"]) == 2
            assert set(found["parameters"]) == {"toda_b"}
            assert found["amplification"] > 0.1
            assert 0.0 < found["rounding"] < 1e-13
    assert f"d eta/d v0 = {found['velocity']:+.6g}" in out
    assert "digits are lost" in out
    assert f"gives eta a standard deviation of {found['rounding']:.0e}" in out


def test_no_derivative_is_given_where_the_last_digits_decide():
    # The rounding error is like that of lj chains of 3000 at 0.39 v*, whose last contacts differ
    # between neighbouring speeds.
    found = collide(Scene(potential="lj", particles=5, speed=0.4, engine="reference"))
    hinging = replace(found, error_parts=replace(found.error_parts, rounding=1e-2))
    with pytest.raises(SensitivityError, match="they decide which contacts occur"):
        _ = hinging.sensitivity
