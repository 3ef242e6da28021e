"""Define answers and usual mistakes of lesson 1: coefficients of restitution."""

import numpy as np

from chaincor.analysis.modes import mode_frequencies
from chaincor.workflows.lessons.exercise import RIGHT, exercise
from chaincor.workflows.lessons.exercises import by_reference
from chaincor.workflows.lessons.judging import Answers

_LINEAR = "linear springs: all displacements double, and no ratio changes"


def _eta(particles: int = 10, velocity: float = 0.1) -> float:
    return by_reference(potential="harmonic", particles=particles, velocity=velocity).restitution


@exercise("two numbers: eta of one particle, and of two joined by a spring")
def _exercise_1() -> Answers:
    yield [_eta(1), _eta(2)], RIGHT
    yield [0.0, 0.0], "the wall takes no energy: a single particle leaves as fast as it came"
    yield (
        [1.0, 0.5],
        "the spring does not keep half of the energy. Follow two particles through half a period: "
        "the spring then has its natural length again, and both particles have the same speed",
    )
    yield (
        [0.5, 0.5],
        "a single particle has no spring that could keep energy; follow two particles through "
        "half a period",
    )
    yield (
        [1.0, 0.0],
        "two particles do not stay at the wall: the spring pushes them away from it",
    )
    yield [1.0, _eta()], "the second number is that of ten particles; work out two by hand"


@exercise("one number: the share of the translational energy that went into vibration")
def _exercise_2() -> Answers:
    eta = _eta()
    e = eta**0.5
    yield 1.0 - eta, RIGHT
    yield eta, "this is eta, the share that came back; the question asks for the rest"
    yield e, "this is e, the share of the speed that came back"
    yield (
        1.0 - e,
        "this is the loss of speed; energy is proportional to the square of the speed: eta = e^2",
    )
    yield (1.0 - e) ** 2, "square the speed first, then subtract: 1 - e^2, not (1 - e)^2"
    yield (
        1.0 - e**0.5,
        "this takes the root of e; energy is proportional to the square of the speed",
    )


@exercise("one number: the momentum that the wall gave, in units of n v0")
def _exercise_3() -> Answers:
    eta = _eta()
    e = eta**0.5
    yield 1.0 + e, RIGHT
    yield (
        1.0 - e,
        "mind the sign: the velocity changes from -v0 to +e v0, by more than v0",
    )
    yield 2.0, "a chain that keeps all its energy gives 2; this chain does not"
    yield (
        1.0 + eta,
        "this adds an energy to a momentum: the momentum that leaves is e n v0, not eta n v0",
    )
    yield e, "this is the momentum of the leaving chain; before that, the wall stopped the chain"
    yield 10.0 * (1.0 + e), "this is in units of v0: also divide it by the number of particles"
    yield 1.0, "this momentum only stops the chain; the wall also sends it back"


@exercise("one number: eta of the same chain of springs at twice the velocity")
def _exercise_4() -> Answers:
    yield _eta(velocity=0.2), RIGHT
    lost = 1.0 - _eta()
    yield 1.0 - 4.0 * lost, "the lost energy is four times as large, but so is the initial energy"
    yield 1.0 - 2.0 * lost, _LINEAR
    yield 1.0 - 0.5 * lost, _LINEAR
    yield (
        _eta() ** 0.5,
        "this is e, the ratio of speeds; the question asks for eta = e^2, the ratio of energies",
    )


@exercise("one number: the longest stable step of a chain of two")
def _exercise_5() -> Answers:
    omega = float(mode_frequencies(2)[1])
    yield 2.0 / omega, RIGHT
    yield (
        1.0 / np.sin(9.0 * np.pi / 20.0),
        "this is the limit for ten particles; the vibration of two particles is slower",
    )
    yield 1.0 / omega, "the limit is omega h = 2, not omega h = 1"
    yield (
        2.0,
        "this is the limit for omega = 1; two particles joined by a spring have omega = sqrt(2)",
    )
    yield 1.0, "this is the limit of long chains, whose fastest mode has omega = 2"
    yield 2.0 * np.pi / omega, "this is the period; steps become unstable above 2/omega"
    yield (
        0.2 * np.pi / omega,
        "this is a tenth of the period, a useful step; the question asks for the limit",
    )


@exercise("one number: after how many steps an atom has moved half the skin")
def _exercise_6() -> Answers:
    step, skin, velocity = 0.005, 0.3, 1.0
    yield 0.5 * skin / (velocity * step), RIGHT
    yield skin / (velocity * step), "this is for the whole skin; the question asks for half of it"
    yield 0.5 * skin / velocity, "this is the time; divide it by the timestep"
    yield (
        skin / velocity,
        "this is the time for the whole skin; the question asks for a number of steps",
    )
