"""Test the independent judge against published values and exact modes, and test its refusals."""

import ast
from pathlib import Path

import numpy as np
import pytest
from numba import njit
from scipy.optimize import brentq

from tests.judge import steps
from tests.judge.judge import JudgeRefusal, Law, UserLaw, judge, judge_collision
from tests.reference_cases import CASES, case_name

LJ_SPEED = 0.128489059895
# The published values are converged to 1e-9 and printed with 11 digits.
PUBLISHED = 1e-9
# Times are printed with seven decimals and rounded by half a unit of the last.
PUBLISHED_TIME = 1e-7


def slow_if_long(case):
    marks = [pytest.mark.slow] if case["particles"] > 100 else []
    return pytest.param(case, marks=marks, id=case_name(case))


@pytest.mark.parametrize("module", ["judge", "laws", "steps", "collocation"])
def test_it_shares_no_code_with_the_engines(module):
    source = (Path(__file__).parents[2] / "tests" / "judge" / f"{module}.py").read_text()
    imported = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            imported |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            imported |= {f"{node.module}.{alias.name}" for alias in node.names}
    allowed = ("numpy", "numba", "dataclasses", "collections", "math", "typing")
    foreign = {name for name in imported if name.split(".")[0] not in allowed}
    assert {name for name in foreign if not name.startswith("tests.judge.")} == set()


@pytest.mark.slow_cases
@pytest.mark.parametrize("case", [slow_if_long(case) for case in CASES])
@pytest.mark.slow
def test_published_values(case):
    law = Law(case["potential"], case.get("b", 10.0), case.get("r", 4), case.get("c", 1.0))
    velocity = case.get("velocity") or case["speed_over_vstar"] * case["v_star"]
    particles = case["particles"]
    found = judge_collision(law, particles, velocity, least_time=4.0 * particles, multiple=2.0)
    assert found.restitution == pytest.approx(case["restitution"], abs=PUBLISHED)
    assert found.contacts == case["contacts"]
    assert found.last_contact_time == pytest.approx(case["last_contact_time"], abs=PUBLISHED_TIME)


def modal_collision(particles, velocity, until):
    """Return contact times and final restitution of a harmonic chain from its modes."""
    j = np.arange(particles)
    omega = 2.0 * np.sin(np.pi * j / (2 * particles))[1:]
    shapes = np.cos(np.pi * np.outer(j + 0.5, j) / particles) * np.sqrt(2.0 / particles)
    shapes[:, 0] = particles**-0.5
    place, speed = np.zeros(particles), np.full(particles, -velocity)
    now, times = 0.0, []
    # No acceleration of particle 1 exceeds this: twice the largest displacement amplitude.
    grid = np.arange(0.0, 4.0, 1e-3)
    angle = np.outer(grid, omega)
    cosine, sine = np.cos(angle), np.sin(angle) / omega

    def at(t):
        c = np.concatenate(([1.0], np.cos(omega * t)))
        s = np.concatenate(([t], np.sin(omega * t) / omega))
        w = np.concatenate(([0.0], omega))
        q, p = shapes.T @ place, shapes.T @ speed
        return shapes @ (q * c + p * s), shapes @ (p * c - q * w**2 * s)

    while now < until:
        if place[0] == 0.0 and speed[0] < 0.0:
            times.append(now)
            speed[0] = -speed[0]
        q, p = shapes.T @ place, shapes.T @ speed
        first = shapes[0, 0] * (q[0] + p[0] * grid)
        first = first + cosine @ (shapes[0, 1:] * q[1:]) + sine @ (shapes[0, 1:] * p[1:])
        below = np.flatnonzero(first[1:] < 0.0)
        # A dip between two grid points could hide a contact. The curvature is below 4 velocity
        # here.
        low = np.flatnonzero((first[2:-1] < first[1:-2]) & (first[2:-1] < first[3:]))
        assert np.all(np.abs(first[low + 2]) > 4.0 * velocity * 1e-6), "the grid is too coarse"
        if below.size:
            end = grid[below[0] + 1]
            start = grid[below[0]]
            step = brentq(lambda t: at(t)[0][0], max(start, 1e-9), end, xtol=1e-15)
        else:
            step = grid[-1]
        place, speed = at(step)
        if below.size:
            place = place - place[0]
        now += step
    return np.array(times), float(speed.mean() / velocity) ** 2


@pytest.mark.parametrize("particles", [2, 7, 80])
@pytest.mark.slow
def test_harmonic_chains_agree_with_their_modes(particles):
    # Modes are followed to t = 800; for n = 80, the last contact is at 160. A root has an error of
    # 1e-15 in x, or 1e-14 in time at these speeds. Each of 70 contacts shifts positions by this
    # much.
    times, restitution = modal_collision(particles, 0.1, 5.0 * 2.0 * particles)
    found = judge_collision(Law("harmonic"), particles, 0.1)
    assert found.contact_times == pytest.approx(times, abs=1e-9)
    assert found.restitution == pytest.approx(restitution, abs=1e-10)


# Three integrators that share no code found these results. Each scene has one contact long after
# its other contacts.
LATE = [
    (25, 1.45, 24, None, 0.80185365),
    (28, 1.47, 27, 38.8087, 0.80498439),
    (117, 1.36, 111, 213.995, 0.76958002),
]


@pytest.mark.slow_cases
@pytest.mark.parametrize(("particles", "speed", "contacts", "last", "restitution"), LATE)
def test_late_contacts_of_breaking_chains(particles, speed, contacts, last, restitution):
    found = judge_collision(Law("lj"), particles, speed * LJ_SPEED, multiple=6.0, least_time=400.0)
    assert found.contacts == contacts
    # Restitutions have eight digits, and times three or four decimals.
    assert found.restitution == pytest.approx(restitution, abs=1e-8)
    if last is not None:
        assert found.last_contact_time == pytest.approx(last, abs=1e-3)
    assert found.horizon >= 6.0 * found.last_contact_time


def test_contacts_of_a_harmonic_chain_that_come_close_together():
    found = judge_collision(Law("harmonic"), 87, 0.1)
    assert (found.contacts, round(found.restitution, 7)) == (76, 0.9532266)


def test_any_state_is_followed():
    found = judge(Law("lj"), 0.05, [0.5, 0.0], [0.001, 0.30, -0.25])
    assert found.contacts == 1
    assert found.last_contact_time == pytest.approx(3.8, abs=0.05)


@pytest.mark.parametrize(
    ("law", "particles", "velocity"),
    [(Law("log"), 20, 4.8), (Law("lj"), 20, 1.3), (Law("toda"), 20, 2.5), (Law("lj"), 20, 1e-13)],
)
def test_extremes_keep_energy_and_momentum(law, particles, velocity):
    found = judge_collision(law, particles, velocity)
    # Some 1e4 steps round by 1e-16 each.
    assert abs(found.energy_drift) < 1e-12
    assert abs(found.momentum_drift) < 1e-12
    # The wall gives twice the incoming speed of each contact as momentum; the sum gives eta.
    after = 2.0 * found.contact_speeds.sum() - particles * velocity
    assert (after / (particles * velocity)) ** 2 == pytest.approx(found.restitution, abs=1e-12)


@pytest.mark.slow
def test_bonds_given_by_functions_by_another_integrator():
    energy = njit(lambda s: np.expm1(-6.0 * np.log1p(s)) ** 2 / 72.0)
    force = njit(lambda s: (1.0 + s) ** -7 * np.expm1(-6.0 * np.log1p(s)) / 6.0)
    settings = {"multiple": 2.0, "least_time": 100.0}
    series = judge_collision(Law("lj"), 28, 1.47 * LJ_SPEED, **settings)
    user = judge_collision(UserLaw(energy, force, 1.0 / 72.0), 28, 1.47 * LJ_SPEED, **settings)
    assert user.contact_times == pytest.approx(series.contact_times, abs=1e-9)
    assert user.restitution == pytest.approx(series.restitution, abs=1e-10)


@pytest.mark.slow
def test_kinks_are_resolved():
    law = UserLaw(njit(lambda s: 0.5 * min(s, 0.0) ** 2), njit(lambda s: -min(s, 0.0)))
    # Motions between kinks are sums of sines. Other integrators gave these results to eight digits.
    for particles, restitution in ((10, 0.93471398), (20, 0.95987176)):
        found = judge_collision(law, particles, 0.1)
        assert found.restitution == pytest.approx(restitution, abs=1e-8)
        assert abs(found.energy_drift) < 1e-12


def test_it_refuses_what_its_two_runs_do_not_agree_on():
    with pytest.raises(JudgeRefusal, match="differ by") as refusal:
        judge_collision(Law("lj"), 60, 1.4 * LJ_SPEED, accuracy=0.0)
    assert len(set(refusal.value.contacts)) == 1


def test_it_refuses_a_bond_that_runs_away():
    with pytest.raises(JudgeRefusal, match="barrier"):
        judge_collision(Law("power", order=3, c=-1.0), 20, 3.0)


def test_it_refuses_a_particle_that_rests_at_the_wall():
    with pytest.raises(JudgeRefusal, match="rests"):
        judge(Law("lj"), 0.0, [-0.1], [0.0, 0.1])


@pytest.mark.parametrize(
    ("roots", "first"),
    [
        ([0.3, 0.30001], 0.3),
        ([0.9], 0.9),
        ([-0.5, 1.5], 2.0),
        ([0.2, 0.2 + 1e-7, 0.6], 0.2),
        ([0.4 + 1e-3j, 0.4 - 1e-3j], 2.0),
        ([0.4 + 1e-3j, 0.4 - 1e-3j, 0.7], 0.7),
    ],
)
def test_the_first_root_of_a_step(roots, first):
    a = np.real(np.polynomial.polynomial.polyfromroots(roots))
    degree = 16
    padded = np.zeros(degree + 1)
    padded[: a.size] = a / np.sign(a[0])
    basis = steps.bernstein_basis(degree)
    found = steps.first_root(padded, degree, basis, np.zeros((48, degree + 1)), np.zeros((48, 2)))
    # Two roots 1e-7 apart move by 1e-16/1e-7 when the coefficients round.
    assert found == pytest.approx(first, abs=1e-8)
