"""Test that proved restitutions lie within the error bars, and that wrong numbers do not."""

from itertools import pairwise

import mpmath
import pytest

from benchmarks.certified.table import CASES, read_table
from chaincor.workflows.collision import collide

ROWS = {row.case: row for row in read_table()}
BY_NAME = {case.name: case for case in CASES}


def test_every_case_is_proved_to_fifty_digits():
    assert set(ROWS) == set(BY_NAME)
    assert min(row.digits for row in ROWS.values()) >= 50


@pytest.mark.slow_cases
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("name", BY_NAME)
def test_bars_in_house_hold_what_was_proved(name, tolerance):
    found = collide(BY_NAME[name].scene(engine="reference", tolerance=tolerance))
    assert not ROWS[name].refutes(found.restitution, found.restitution_error)


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("name", BY_NAME)
def test_bars_of_lammps_hold_what_was_proved(name, tolerance):
    found = collide(BY_NAME[name].scene(engine="lammps", tolerance=tolerance))
    assert not ROWS[name].refutes(found.restitution, found.restitution_error)


@pytest.mark.slow_cases
@pytest.mark.parametrize("name", ["lj-5-0.0625", "harmonic-10-0.125", "log-10-0.25-target"])
def test_a_wrong_number_is_refused(name):
    found = collide(BY_NAME[name].scene(engine="reference", tolerance=1e-9))
    # The wrong restitution is above or below the right one by more than the sum of its error bar
    # and the enclosure.
    for sign in (1, -1):
        wrong = found.restitution + sign * 2.5 * found.restitution_error
        assert ROWS[name].refutes(wrong, found.restitution_error)


@pytest.mark.parametrize("name", ["harmonic-2-0.125", "lj-2-0.09375", "harmonic-2-0.125-masses"])
def test_the_proof_can_be_run_again(name):
    pytest.importorskip("flint")
    from benchmarks.certified.__main__ import prove  # needs flint

    again, kept = prove(BY_NAME[name]), ROWS[name]
    assert (again.middle, again.radius) == (kept.middle, kept.radius)
    assert again.contacts == kept.contacts


# The check has its own formulas for U'(s).
FORCES = {
    "harmonic": lambda s: s,
    "lj": lambda s: ((1 + s) ** -7 - (1 + s) ** -13) / 6,
    "toda": lambda s: (1 - mpmath.exp(-10 * s)) / 10,
    "log": lambda s: s / (1 + s),
}


@pytest.mark.parametrize("potential", FORCES)
def test_a_step_encloses_the_motion_that_another_integrator_finds(potential):
    flint = pytest.importorskip("flint")
    from benchmarks.certified.bonds import BONDS
    from benchmarks.certified.flow import Chain, State

    masses, strains, velocities = (2, 1, 3), ("-0.02", "0.0125"), ("0.05", "-0.0625", "0.01")
    flint.ctx.dps, mpmath.mp.dps = 60, 40
    try:
        chain = Chain(BONDS[potential], tuple(flint.arb(mass) for mass in masses))
        begin = State(
            flint.arb("0.25"),
            tuple(flint.arb(strain) for strain in strains),
            tuple(flint.arb(velocity) for velocity in velocities),
        )
        step = chain.step(begin, terms=50, longest=1e4)
        enclosed = step.state(step.length).flat()
        length = mpmath.mpf(step.length.str(50, radius=False))

        def rates(_time, values):
            pull = [FORCES[potential](strain) for strain in values[1:3]]
            forces = [pull[0], pull[1] - pull[0], -pull[1]]
            return [
                values[3],
                *(after - before for before, after in pairwise(values[3:])),
                *(force / mass for force, mass in zip(forces, masses, strict=True)),
            ]

        start = [mpmath.mpf(text) for text in ("0.25", *strains, *velocities)]
        exact = mpmath.odefun(rates, 0, start, tol=mpmath.mpf(10) ** -36)(length)
        for ball, value in zip(enclosed, exact, strict=True):
            # The tolerance is the radius of the enclosing ball plus the error of the other
            # integrator.
            room = ball + flint.arb(0, "1e-34")
            assert room.contains(flint.arb(mpmath.nstr(value, 45)))
            assert float(ball.rad()) < 1e-30
    finally:
        flint.ctx.dps, mpmath.mp.dps = 15, 15
