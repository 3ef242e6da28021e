"""Define answers and usual mistakes of lesson 4: frequencies, shapes and energies of the modes."""

import numpy as np

from chaincor.analysis.modes import mode_frequencies
from chaincor.workflows.lessons.exercise import RIGHT, exercise
from chaincor.workflows.lessons.exercises import by_reference
from chaincor.workflows.lessons.judging import Answers

_N = 10


@exercise(f"{_N} numbers: the frequencies omega_j of a free chain of {_N}, j = 0 to {_N - 1}")
def _exercise_1() -> Answers:
    j, omega = np.arange(_N), mode_frequencies(_N)
    yield omega, RIGHT
    yield (
        np.sin(np.pi * j / _N),
        "sin(pi j/n) is a misprint of the paper: it decreases for j > n/2, but shorter waves "
        "vibrate faster; the frequency is 2 sin(pi j/2n)",
    )
    yield (
        2.0 * np.sin(np.pi * j / _N),
        "these are the frequencies of a ring, which holds whole waves; a free chain "
        "also holds half waves: pi j/2n",
    )
    yield (
        2.0 * np.sin(np.pi * (j + 1) / (2 * _N + 2)),
        "this is a chain held at both ends; the first mode of a free chain has the frequency 0",
    )
    yield (
        2.0 * np.sin(np.pi * (j + 1) / (2 * _N)),
        "these are the modes j = 1 to 10; the question asks for j = 0 to 9",
    )
    yield omega**2, "the square root is forgotten: this is omega^2 = 2 - 2 cos(pi j/n)"
    yield (
        np.pi * j / _N,
        "this is sound in a continuous rod; it is right only for long waves, j much less than n",
    )
    yield (
        omega / (2.0 * np.pi),
        "these are cycles per unit of time; omega is in radians per unit of time, "
        "2 pi times as many",
    )


@exercise("one number: the period of the slowest vibration of a chain of 100")
def _exercise_2() -> Answers:
    slowest, *_, fastest = mode_frequencies(100)[1:]
    period = 2.0 * np.pi / slowest
    yield period, RIGHT
    yield 2.0 * np.pi / period, "this is the frequency omega; the period is 2 pi/omega"
    yield (
        period / 2.0,
        "this is the time of sound to the far end; the period also holds the way back",
    )
    yield (
        2.0 * 99.0,
        "this is 2(n - 1), the bonds to the far end and back; the standing wave also needs half a "
        "bond beyond each end: 2n",
    )
    yield period / (2.0 * np.pi), "1/omega is the time of one radian; a period has 2 pi radians"
    yield 2.0 * np.pi / fastest, "this is the fastest vibration, j = n - 1; the slowest is j = 1"


@exercise("one number: the share of the vibration in modes 50 to 99", tolerance=0.01)
def _exercise_3() -> Answers:
    energies = by_reference(potential="harmonic", particles=100, velocity=0.1).mode_energies
    yield float(energies[50:].sum() / energies[1:].sum()), RIGHT
    yield (
        float(energies[50:].sum() / energies.sum()),
        "this is a share of all the energy; mode 0 is flight and not vibration",
    )
    yield float(energies[1:50].sum() / energies[1:].sum()), "this is the lower half"
    yield (
        float(energies[:50].sum() / energies.sum()),
        "this is the lower half, and it includes the flight, mode 0",
    )
    yield (
        float(np.mean(energies[50:]) / np.mean(energies[1:])),
        "this is a ratio of means; the question asks for a ratio of sums",
    )


@exercise(
    "a function of j and n that returns the pattern of mode j >= 1, n numbers whose squares "
    "sum to 1",
    tolerance=2e-3,
    either_sign=True,
    arguments=lambda: (3, _N),
)
def _exercise_4(j: int, n: int) -> Answers:
    i, unit = np.arange(1, n + 1), np.sqrt(2.0 / n)
    ends = (
        "a crest lies half a bond before particle 1: the cosine needs i - 1/2, with i from 1 to n"
    )
    shape = np.cos(np.pi * j * (i - 0.5) / n)
    yield unit * shape, RIGHT
    yield shape, "the pattern is right, but its squares sum to n/2: divide it by sqrt(n/2)"
    yield (
        unit * np.sin(np.pi * j * (i - 0.5) / n),
        "a sine vanishes at the end of the chain, as if held there; a free end moves most",
    )
    yield unit * np.cos(np.pi * j * (i - 1) / n), ends
    yield unit * np.cos(np.pi * j * i / n), ends
    yield (
        unit * np.cos(2 * np.pi * j * (i - 0.5) / n),
        "these are whole waves, as in a ring; a free chain also holds half waves",
    )
