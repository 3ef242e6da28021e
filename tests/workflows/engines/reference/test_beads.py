"""Beads that only push: known losses, the scaling law, the proved end, and other integrators."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chaincor import Scene, collide
from chaincor.lammps_inputs.errors import ChaincorError, SceneError

# 1 - eta of beads of mass 1 that arrive together and just touch, by exponent and contact: from
# another program, to the digits printed.
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
    # The first comes back to the wall just when both part: each has bounced once from the other.
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
        # Roundings decide whether a step is refused, so that only the bars hold.
        bars = first.restitution_error + other.restitution_error
        assert abs(other.restitution - first.restitution) <= bars < 1e-8
        assert other.v_star is None
        # Times grow as v^((1 - p)/(1 + p)), overlaps as v^(2/(1 + p)).
        ratio = other.velocity / first.velocity
        times = ratio ** ((1.0 - exponent) / (1.0 + exponent))
        lengths = ratio ** (2.0 / (1.0 + exponent))
        assert other.duration == pytest.approx(times * first.duration, rel=1e-8)
        # The shortest of the ends of steps, some ten of which are in each overlap.
        assert 1.0 - other.bond_min == pytest.approx(lengths * (1.0 - first.bond_min), rel=0.02)
        assert other.crossed == (other.bond_min < 0.0)


def independent_loss(masses, targets, exponent, gaps, hard, damping, tolerance):
    """
    Return 1 - eta by SciPy's DOP853 with the wall, or target, as an event.

    Beads stand along x, a target (or a soft wall, which never moves) before the chain. Positions
    are those of touching beads with their lengths taken off.
    """
    wall = not len(targets)
    every = np.concatenate((targets[::-1] if not wall else [np.inf], masses))
    first = len(every) - len(masses)
    x = np.concatenate((np.zeros(first), np.cumsum(np.concatenate(([0.0], gaps)))))
    v = np.concatenate((np.zeros(first), -np.ones(len(masses))))

    def rates(_time, state):
        overlaps = np.maximum(state[: len(every) - 1] - state[1 : len(every)], 0.0)
        forces = overlaps**exponent
        if damping:
            factor, power = damping
            closing = -np.diff(state[len(every) :])
            drag = factor * np.where(overlaps > 0.0, overlaps**power, 0.0) * closing
            forces = np.maximum(forces + drag, 0.0)
        if hard:
            forces[first - 1] = 0.0
        push = np.append(0.0, forces) - np.append(forces, 0.0)
        return np.concatenate((state[len(every) :], push / every))

    def touches(_time, state):
        return state[first] - state[first - 1]

    touches.terminal, touches.direction = hard, -1.0
    state, now = np.concatenate((x, v)), 0.0
    for _ in range(400):
        velocities = state[len(every) :]
        closing = velocities[first - 1] - velocities[first]
        if hard and closing > 0.0 and state[first] - state[first - 1] <= 1e-9:
            given = 2.0 * closing / (1.0 / every[first - 1] + 1.0 / every[first])
            velocities[first - 1] -= given / every[first - 1]
            velocities[first] += given / every[first]
            state[first] = state[first - 1] + 1e-15
        found = solve_ivp(
            rates, (now, now + 5.0), state, "DOP853", events=touches, rtol=tolerance, atol=tolerance
        )
        state, now = found.y[:, -1].copy(), found.t[-1]
        x, v = state[: len(every)], state[len(every) :]
        apart = np.min(np.diff(x)) >= -1e-9 and np.min(np.diff(v)) >= -1e-7
        if found.status == 0 and apart:
            break
    else:
        raise AssertionError("the beads do not part")
    speed = masses @ v[first:] / np.sum(masses)
    if not wall:
        speed -= targets[::-1] @ v[:first] / np.sum(targets)
    return 1.0 - speed**2


def _column(seed):
    random = np.random.default_rng(seed)
    masses = np.exp(random.uniform(-1.0, 1.0, random.integers(1, 9)))
    targets = np.exp(random.uniform(-1.0, 1.0, random.integers(1, 5) * (seed % 3 == 0)))
    exponent = float(random.uniform(1.2, 3.0))
    gaps = random.uniform(0.0, 0.5, len(masses) - 1) * (seed % 2)
    hard = bool(random.integers(2))
    factor, dashpot = float(random.uniform(0.02, 0.3)), bool(random.integers(2))
    damping = (factor, 0.0 if dashpot else exponent - 1.0) if seed % 4 == 0 else ()
    return masses, targets, exponent, gaps, hard, damping


def _scene_of(column, folder):
    masses, targets, exponent, gaps, hard, damping = column
    fields = {"hertz_exponent": exponent, "particles": len(masses), "velocity": 1.0}
    if hard:
        fields["contact"] = "hard"
    if damping:
        fields["damping"] = damping[0]
        fields["damping_law"] = "viscoelastic" if damping[1] else "dashpot"
    if len(targets):
        fields |= {"target_particles": len(targets), "target_masses": tuple(targets.tolist())}
    if np.any(gaps):
        rows = [f"{s:.17g},{m:.17g}" for s, m in zip([0.0, *gaps], masses, strict=True)]
        path = folder / "column.csv"
        path.write_text("\n".join(["strain,mass", *rows]))
        return beads(**fields, initial=path)
    return beads(**fields, masses=tuple(masses.tolist()))


@pytest.mark.parametrize(
    "seed", [*range(4), *(pytest.param(s, marks=pytest.mark.slow) for s in range(4, 30))]
)
def test_random_columns_agree_with_another_integrator(seed, tmp_path):
    column = _column(seed)
    result = collide(_scene_of(column, tmp_path), tolerance=1e-8)
    # The other's own error, by a run at ten times its tolerance, with a reserve of three.
    loss, rough = (independent_loss(*column, tolerance) for tolerance in (1e-12, 1e-11))
    allowed = result.restitution_error + 3.0 * abs(loss - rough) + 1e-10
    assert abs(1.0 - result.restitution - loss) <= allowed
    assert result.ending == "proved"


def test_momentum_and_energy_are_kept():
    result = collide(beads(particles=12, target_particles=5, masses=[1.0, 3.0]), tolerance=1e-10)
    # Roundings of 1e3 steps; energy as exact as eta, with a reserve of a hundred.
    assert result.momentum_residual < 1e-12
    assert abs(result.energy_drift) < 1e-8


@pytest.mark.parametrize("law", ["viscoelastic", "dashpot"])
@pytest.mark.parametrize("contact", [None, "hard"])
def test_damping_takes_the_energy_that_is_missing(law, contact):
    fields = {"particles": 8, "contact": contact}
    damped = collide(beads(**fields, damping=0.05, damping_law=law), tolerance=1e-9)
    elastic = collide(beads(**fields), tolerance=1e-9)
    # The loss is integrated beside the motion, as exactly as eta; with a reserve of a hundred.
    assert abs(damped.energy_drift) < 1e-7
    assert damped.dissipated_energy > 0.01 * damped.velocity**2
    assert damped.restitution < elastic.restitution
    assert damped.ending == "proved"
    assert elastic.dissipated_energy is None


def test_one_bead_on_a_dashpot_and_a_linear_law_is_an_oscillator():
    # F = d^p + A v is near d + A v for p near 1: the exact speed ratio of a damped half-swing, up
    # to where the force vanishes, which is before the bead parts.
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
    # Steps of the table of times, and the power of 1 + 1e-7.
    assert result.restitution == pytest.approx(rate[free] ** 2, abs=2e-5)


def test_strong_damping_stops_beads_and_they_part_without_a_pull():
    # On a dashpot that rules, overlaps relax as d' = -d^p/A; force ends where this motion slows.
    result = collide(beads(particles=2, damping=20.0, damping_law="dashpot"))
    assert result.restitution < 1e-5
    assert result.ending == "proved"


@pytest.mark.parametrize(
    ("fields", "named"),
    [
        ({"damping_law": "dashpot"}, "Give damping"),
        ({"potential": "lj", "damping": 0.1}, "goes with potential 'hertz'"),
        ({"engine": "lammps", "hertz_exponent": 2.0}, "Set engine to 'reference'"),
        ({"engine": "lammps", "contact_exponent": 2.0, "contact": "power"}, "Hertz's law"),
        ({"engine": "lammps", "contact": "hard", "target_particles": 2}, "Leave contact out"),
        ({"engine": "lammps", "scheme": "order6"}, "Verlet steps"),
        ({"engine": "lammps", "dump": "a.dump"}, "Leave it out"),
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
