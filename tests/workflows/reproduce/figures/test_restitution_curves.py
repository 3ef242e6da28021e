"""Test claims on eta as a function of speed by artificial curves with known results."""

import math
from dataclasses import replace
from itertools import product

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.claims import Verdict
from chaincor.workflows.reproduce.measurements import Answer, MeasuredPoint, Measurements
from chaincor.workflows.reproduce.paper import CLAIMS
from chaincor.workflows.reproduce.plan import QUICK

SPEEDS = (0.01, 0.1, 0.5, 0.9, 1.1, 2.0, 10.0)


CLAIM = {claim.key: claim for claim in CLAIMS}


def valley(speed: float) -> float:
    return 1.0 - 0.3 * math.exp(-3.0 * math.log10(speed / 0.8) ** 2)


def measurements(curve=lambda name, u: valley(u), contacts=lambda u: 84 + int(16 * (u > 1.0))):
    """Return curves of three bonds; log above 3 v* has the results of hard spheres."""

    def point(name: str, speed: float) -> MeasuredPoint:
        is_limit = name == "log" and speed > 3.0
        result = {
            "restitution": 1.0 if is_limit else curve(name, speed),
            "restitution_error": 1e-6,
            "contacts": 100 if is_limit else contacts(speed),
            "scheme": "hard-sphere" if is_limit else "order8",
        }
        return MeasuredPoint(
            Scene(potential=name, particles=100, speed=speed), None, Answer(result)
        )

    points = tuple(point(name, u) for name, u in product(("lj", "toda", "log"), SPEEDS))
    return Measurements(QUICK, (), {"curves": points, "harmonic_velocities": ()})


def test_limits_rest_on_what_was_integrated():
    """Exclude log chains that were set equal to hard spheres from evidence that eta goes to 1."""
    measured = measurements(lambda name, u: 0.9 if name == "log" else valley(u))
    found = CLAIM["high-speed limit"].found(measured)
    assert found.value == pytest.approx(0.9)
    assert "2 v* (log, reference)" in found.text
    few = CLAIM["contacts at high speed"].found(measurements(contacts=lambda u: 90))
    assert few.value == pytest.approx(0.9)


def test_one_curve_is_judged_by_the_two_bonds_that_differ_most():
    def curve(name: str, u: float) -> float:
        return valley(u) + (0.05 if name == "log" and u == 2.0 else 0.01 if name == "toda" else 0.0)

    found = CLAIM["one curve"].found(measurements(curve))
    assert found.value == pytest.approx(0.05)
    assert found.error == pytest.approx(2e-6)
    assert "(lj and log, at 2 v*)" in found.text
    assert "below v* no two are more than 0.010 apart, lj and toda no more than 0.010" in found.text
    assert found.brief.startswith("lj and toda within 0.010 below v*")


def with_harmonic(curve):
    """Add a harmonic chain of eta = 0.97 to curves at low speed."""
    measured = measurements(curve)
    chain = MeasuredPoint(
        Scene(potential="harmonic", particles=100, velocity=0.1),
        None,
        Answer({"restitution": 0.97, "restitution_error": 1e-9, "contacts": 87}),
    )
    slow = tuple(
        MeasuredPoint(
            Scene(potential=name, particles=100, speed=u),
            None,
            Answer({"restitution": curve(name, u), "restitution_error": 1e-9, "contacts": 87}),
        )
        for name, u in product(("lj", "toda", "log"), (0.01, 0.013, 0.018, 0.024, 2.0))
    )
    return replace(measured, points={"curves": slow, "harmonic_velocities": (chain,)})


@pytest.mark.parametrize("gap", [0.0, 0.014, 0.0275])
def test_low_speed_limit_tells_a_harmonic_chain_from_one_that_loses_nothing(gap):
    """Require a margin narrower than the loss of the harmonic chain, so that eta = 1 fails."""
    claim = CLAIM["low-speed limit"]
    limit = claim.found(with_harmonic(lambda _, u: 0.97 + gap - 0.3 * u - 2.0 * u**2))
    # The curve is a parabola, so that only error bars of 1e-9 remain, times some tens.
    assert limit.value == pytest.approx(-gap, abs=1e-7)
    assert (claim.judge(limit).verdict is Verdict.REPRODUCED) == (gap == 0.0)


@pytest.mark.parametrize("power", [1, 2])
def test_exponent_of_other_types_is_that_of_the_one_further_from_1(power):
    def curve(name: str, u: float) -> float:
        return 0.97 - 0.3 * u ** (power if name == "log" else 1)

    measured = with_harmonic(curve)
    empty = replace(measured, points=measured.points | {"slopes": (), "increase": ()})
    found = CLAIM["power of other types"].found(empty)
    assert found.value == pytest.approx(power, abs=1e-4)
    assert math.isnan(CLAIM["power lj"].found(empty).value)


@pytest.mark.parametrize(
    ("curve", "contacts", "rising"),
    [
        (valley, lambda u: 84 + int(16 * (u > 1.0)), 1.0),
        (valley, lambda u: 84, 0.0),
        (lambda u: valley(u / 3.0), lambda u: 84 + int(16 * (u > 1.0)), 0.0),
        # A rise within the error bars is not counted.
        (lambda u: 0.7 + 1e-6 * u, lambda u: 84, 0.0),
    ],
)
def test_both_rise_only_if_both_are_larger_above_the_scale(curve, contacts, rising):
    found = CLAIM["rise of both"].found(measurements(lambda _, u: curve(u), contacts))
    assert found.value == rising
