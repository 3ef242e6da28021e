"""Test beads, which only repel: known losses, scaling law, proved end, other integrators."""

import numpy as np
import pytest

from chaincor import Scene, collide
from chaincor.lammps_inputs.errors import ChaincorError, SceneError
from chaincor.workflows.engines.reference import finish
from tests.judge.beads import judge_column

# 1 - eta of beads of mass 1 that initially just touch, by exponent and contact. Another program
# gave these digits.
LOSSES = {
    (1.5, None): {2: 0.0294146, 10: 0.1282082, 100: 0.1902158},
    (1.5, "hard"): {2: 0.0, 10: 0.1304840, 100: 0.1823426},
    (2.0, "hard"): {2: 0.0, 10: 0.0832251, 100: 0.1468125},
    (1.25, None): {2: 0.0375349, 10: 0.0788908, 100: 0.1287698},
}
PRINTED = 1e-7
ROWS = [(*law, n, loss) for law, losses in LOSSES.items() for n, loss in losses.items()]


def beads(**fields):
    return Scene(**{"potential": "hertz", "velocity": 0.1, "engine": "reference"} | fields)


@pytest.mark.parametrize(("exponent", "contact", "particles", "loss"), ROWS)
def test_losses_are_the_known_ones(exponent, contact, particles, loss):
    scene = beads(hertz_exponent=exponent, contact=contact, particles=particles)
    result = collide(scene, tolerance=1e-9)
    assert result.restitution_error < 1e-8
    assert abs(1.0 - result.restitution - loss) <= PRINTED + result.restitution_error
    assert result.ending == "proved"


@pytest.mark.parametrize("exponent", [1.25, 1.5, 2.0, 3.0])
def test_two_beads_at_a_hard_wall_lose_nothing(exponent):
    # The first bead returns to the wall just when the beads separate, after a single collision
    # between them.
    result = collide(beads(hertz_exponent=exponent, contact="hard", particles=2), tolerance=1e-9)
    assert abs(1.0 - result.restitution) <= result.restitution_error


@pytest.mark.parametrize("contact", [None, "hard"])
@pytest.mark.parametrize("exponent", [1.25, 1.5, 2.5])
def test_speed_changes_units_alone(exponent, contact):
    first, *others = (
        collide(
            beads(hertz_exponent=exponent, contact=contact, particles=7, velocity=v), tolerance=1e-9
        )
        for v in (0.1, 1e-6, 1.0, 1e5)
    )
    for other in others:
        # Rounding decides whether a step is refused, so that results agree only within error bars.
        bars = first.restitution_error + other.restitution_error
        assert abs(other.restitution - first.restitution) <= bars < 1e-8
        assert other.v_star is None
        # Times grow as v^((1 - p)/(1 + p)), overlaps as v^(2/(1 + p)).
        ratio = other.velocity / first.velocity
        times = ratio ** ((1.0 - exponent) / (1.0 + exponent))
        lengths = ratio ** (2.0 / (1.0 + exponent))
        assert other.duration == pytest.approx(times * first.duration, rel=1e-8)
        # The shortest bond is sampled at ends of steps, some ten of which are in each overlap.
        assert 1.0 - other.bond_min == pytest.approx(lengths * (1.0 - first.bond_min), rel=0.02)
        assert other.crossed == (other.bond_min < 0.0)


@pytest.mark.parametrize(
    "seed", [*range(4), *(pytest.param(s, marks=pytest.mark.slow) for s in range(4, 30))]
)
def test_random_columns_agree_with_another_integrator(seed, tmp_path):
    judged = judge_column(seed, tmp_path)
    assert judged.distance <= judged.allowed
    assert judged.ending == "proved"


def test_momentum_and_energy_are_kept():
    result = collide(beads(particles=12, target_particles=5, masses=[1.0, 3.0]), tolerance=1e-10)
    # The first limit covers rounding of 1e3 steps. The energy is as exact as eta, with a factor of
    # a hundred as reserve.
    assert result.momentum_residual < 1e-12
    assert abs(result.energy_drift) < 1e-8


@pytest.mark.parametrize("contact", [None, "hard"])
def test_diameters_of_one_size_change_units_alone(contact):
    plain, small = (
        collide(beads(particles=7, contact=contact, diameters=diameters), tolerance=1e-9)
        for diameters in (None, (0.3,))
    )
    bars = plain.restitution_error + small.restitution_error
    assert abs(plain.restitution - small.restitution) <= bars < 1e-8


def test_masses_of_a_tapered_column_are_cubes_of_diameters():
    tapered = beads(particles=5, diameters=(1.0, 0.9, 0.8))
    assert tapered.line.chain_masses == pytest.approx([1.0, 0.729, 0.512, 1.0, 0.729])
    result = collide(tapered, tolerance=1e-9)
    assert abs(result.energy_drift) < 1e-7
    # Contacts of smaller beads are also softer, so that equal masses give another eta.
    other = collide(beads(particles=5, masses=tuple(tapered.line.chain_masses)), tolerance=1e-9)
    assert abs(result.restitution - other.restitution) > 1e-3


@pytest.mark.parametrize("law", ["viscoelastic", "dashpot"])
@pytest.mark.parametrize("contact", [None, "hard"])
def test_damping_takes_the_energy_that_is_missing(law, contact):
    fields = {"particles": 8, "contact": contact}
    damped = collide(beads(**fields, damping=0.05, damping_law=law), tolerance=1e-9)
    elastic = collide(beads(**fields), tolerance=1e-9)
    # The loss is integrated with the motion, as exactly as eta, with a factor of a hundred as
    # reserve.
    assert abs(damped.energy_drift) < 1e-7
    assert damped.dissipated_energy > 0.01 * damped.velocity**2
    assert damped.restitution < elastic.restitution
    assert damped.ending == "proved"
    assert elastic.dissipated_energy is None


def test_one_bead_on_a_dashpot_and_a_linear_law_is_an_oscillator():
    # For p near 1, F = d^p + A v is nearly d + A v. The expected ratio of speeds is that of a
    # damped oscillator up to the time at which the force vanishes, which is before the overlap
    # ends.
    a = 0.2
    frequency = np.sqrt(1.0 - 0.25 * a * a)
    times = np.linspace(1e-3, np.pi / frequency, 200_001)
    decay = np.exp(-0.5 * a * times)
    overlap = decay * np.sin(frequency * times) / frequency
    rate = decay * np.cos(frequency * times) - 0.5 * a * overlap
    free = int(np.argmax(overlap + a * rate < 0.0))
    scene = beads(
        particles=1, hertz_exponent=1.0 + 1e-7, damping=a, damping_law="dashpot", velocity=1.0
    )
    result = collide(scene, tolerance=1e-9)
    # The tolerance covers the grid of times and the exponent of 1 + 1e-7.
    assert result.restitution == pytest.approx(rate[free] ** 2, abs=2e-5)


def test_strong_damping_stops_beads_and_they_part_without_a_pull():
    # With strong damping, overlaps relax as d' = -d^p/A, and the force vanishes as this motion
    # slows.
    result = collide(beads(particles=2, damping=20.0, damping_law="dashpot"))
    assert result.restitution < 1e-5
    assert result.ending == "proved"
    with pytest.raises(ChaincorError, match="Lower the damping"):
        collide(beads(particles=3, damping=1e6))


def test_a_very_soft_wall_returns_the_column_whole(monkeypatch):
    # The contact lasts 1e4 times as long as that of two beads.
    soft = beads(particles=3, contact="power", contact_stiffness=1e-9)
    result = collide(soft, tolerance=1e-7)
    assert abs(1.0 - result.restitution) <= result.restitution_error
    assert result.ending == "proved"
    monkeypatch.setattr(finish, "_LONGEST", 1.0)
    with pytest.raises(ChaincorError, match="Give a stiffer contact"):
        collide(soft, tolerance=1e-6)


@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ({"damping_law": "dashpot"}, "Give damping"),
        ({"diameters": (1.0, 2.0), "hertz_exponent": 2.0}, "leave diameters out"),
        ({"diameters": (1.0, 2.0), "target_particles": 2}, "leave diameters out"),
        ({"potential": "lj", "diameters": (1.0, 2.0)}, "leave diameters out"),
        ({"potential": "lj", "damping": 0.1}, "goes with potential 'hertz'"),
        ({"engine": "lammps", "hertz_exponent": 2.0, "damping": 0.1}, "Leave damping out"),
        (
            {"engine": "lammps", "contact_exponent": 2, "contact": "power", "damping": 0.1},
            "the contact is",
        ),
        ({"engine": "lammps", "table_points": 99, "diameters": (1.0, 2.0)}, "no diameters"),
        ({"engine": "lammps", "contact": "hard", "target_particles": 2}, "Leave contact out"),
        ({"engine": "lammps", "scheme": "order6"}, "Verlet steps"),
        ({"engine": "lammps", "dump": "a.dump"}, "Leave dump out"),
        ({"timestep": 0.01}, "Give a tolerance"),
        ({"velocity": None, "speed": 0.4}, "v*"),
        ({"hertz_exponent": 1.0}, "greater than 1"),
        ({"temperature": 0.1}, "equilibrium"),
        ({"potential": "lj", "hertz_exponent": 1.5}, "goes with potential 'hertz'"),
    ],
)
def test_what_beads_lack_is_refused_by_name(fields, named):
    fields = {key: value for key, value in fields.items() if value is not None}
    kept = {"potential": "hertz", "engine": "reference"}
    with pytest.raises(SceneError, match=named.replace("*", r"\*")):
        Scene(**kept | fields)


def test_beads_have_no_modes_and_no_derivatives():
    result = collide(beads(particles=5))
    assert len(result.mode_energies) == 0
    with pytest.raises(ChaincorError, match="no modes"):
        result.plot.spectrum()
    with pytest.raises(ChaincorError, match="Run nearby scenes"):
        _ = result.sensitivity


def test_the_motion_can_be_shown():
    result = collide(beads(particles=5, contact="hard"))
    history = result.history
    assert len(history.times) > 100
    assert history.times[-1] >= result.last_contact_time
