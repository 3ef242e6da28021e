"""Lesson 4: frequencies and shapes of the modes, and what is in them."""

from functools import cache

import numpy as np

from chaincor.analysis.modes import mode_frequencies
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.lessons.exercise import Exercise, Mistake
from chaincor.workflows.lessons.exercises.in_house import in_house

_ENDS = "the ends are free halfway before the first and after the last particle: i - 1/2"
_N = 10
_J = np.arange(_N)


def _period() -> float:
    return 2.0 * np.pi / float(mode_frequencies(100)[1])


@cache
def _energies() -> Array:
    return in_house(potential="harmonic", particles=100, velocity=0.1).mode_energies


def _shape(j: int, n: int) -> Array:
    """Return the orthonormal pattern of mode j: the row of a cosine transform, j >= 1."""
    from scipy.fft import idct

    return idct(np.eye(n)[j], norm="ortho")


EXERCISES = {
    1: Exercise(
        f"{_N} numbers: the frequencies omega_j of a free chain of {_N}, j = 0 to {_N - 1}",
        lambda: mode_frequencies(_N),
        (
            Mistake(
                lambda: np.sin(np.pi * _J / _N),
                "sin(pi j/n) is a misprint of the paper: it falls again for j > n/2, while shorter "
                "waves swing faster; the frequency is 2 sin(pi j/2n)",
            ),
            Mistake(
                lambda: 2.0 * np.sin(np.pi * _J / _N),
                "this is a ring, which a whole wave must fit; a free chain takes half waves: "
                "pi j/2n",
            ),
            Mistake(
                lambda: 2.0 * np.sin(np.pi * (_J + 1) / (2 * _N + 2)),
                "this is a chain held at both ends; a free one has a mode without frequency",
            ),
            Mistake(
                lambda: mode_frequencies(_N) ** 2,
                "the square root is forgotten: this is omega^2 = 2 - 2 cos(pi j/n)",
            ),
            Mistake(
                lambda: np.pi * _J / _N,
                "this is sound in a continuous rod, right for long waves only: j much less than n",
            ),
            Mistake(
                lambda: mode_frequencies(_N) / (2.0 * np.pi),
                "these are cycles per unit of time; omega counts radians, 2 pi times as many",
            ),
        ),
    ),
    2: Exercise(
        "one number: the period of the slowest vibration of a chain of 100",
        _period,
        (
            Mistake(
                lambda: 2.0 * np.pi / _period(),
                "this is the frequency omega; the period is 2 pi/omega",
            ),
            Mistake(lambda: _period() / 2.0, "half of it: sound has to go there and back"),
            Mistake(
                lambda: _period() / (2.0 * np.pi),
                "1/omega is the time for one radian; a period has 2 pi of them",
            ),
            Mistake(
                lambda: 2.0 * np.pi / float(mode_frequencies(100)[-1]),
                "this is the fastest vibration, j = n - 1; the slowest is j = 1",
            ),
        ),
    ),
    3: Exercise(
        "one number: the share of the vibration in modes 50 to 99",
        lambda: float(_energies()[50:].sum() / _energies()[1:].sum()),
        (
            Mistake(
                lambda: float(_energies()[50:].sum() / _energies().sum()),
                "this is a share of all the energy; mode 0 is flight and not vibration",
            ),
            Mistake(
                lambda: float(_energies()[1:50].sum() / _energies()[1:].sum()),
                "this is the lower half",
            ),
            Mistake(
                lambda: float(_energies()[:50].sum() / _energies().sum()),
                "this is the lower half, and counts the flight as well",
            ),
            Mistake(
                lambda: float(np.mean(_energies()[50:]) / np.mean(_energies()[1:])),
                "this compares means; asked are sums",
            ),
        ),
        tolerance=0.01,
    ),
    4: Exercise(
        "a function of j and n that returns the pattern of mode j >= 1, n numbers whose squares "
        "sum to 1",
        _shape,
        (
            Mistake(
                lambda j, n: np.cos(np.pi * j * (np.arange(n) + 0.5) / n),
                "the pattern is right, but its squares sum to n/2: divide by the root of that",
            ),
            Mistake(
                lambda j, n: np.sqrt(2.0 / n) * np.sin(np.pi * j * (np.arange(n) + 0.5) / n),
                "a sine is zero at the end of the chain, as if held there; a free end swings most",
            ),
            Mistake(lambda j, n: np.sqrt(2.0 / n) * np.cos(np.pi * j * np.arange(n) / n), _ENDS),
            Mistake(
                lambda j, n: np.sqrt(2.0 / n) * np.cos(np.pi * j * np.arange(1, n + 1) / n),
                _ENDS,
            ),
            Mistake(
                lambda j, n: np.sqrt(2.0 / n) * np.cos(2 * np.pi * j * (np.arange(n) + 0.5) / n),
                "this fits whole waves into the chain, as into a ring; half waves fit as well",
            ),
        ),
        tolerance=1e-6,
        arguments=lambda: (3, _N),
    ),
}
