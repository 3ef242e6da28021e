r"""
Impulse of a wall beyond its ideal maximum, if the push decreases linearly.

    python -m benchmarks.slow_chains.ending

A wall pushes a half-infinite harmonic chain with an average force F = 1 - a t. The ideal maximum of
the impulse is 1/(2a), and the final impulse is larger by the excess.

Particle 1 bounces at intervals tau < pi. All frequencies of the bouncing are above the band;
therefore the bouncing sends no wave into the chain, and its action is conserved while F decreases.
At constant F and tau, the surplus of the impulse and the action are

.. math:: \frac{\beta}{F} = \frac12 + \sum_{m \ge 1} (1 - \theta_m), \qquad
          \frac{I}{F^2} = \frac{\tau}{4 \pi} \sum_{m \ge 1}
          \frac{(m \omega)^2 (1 - \theta_m)^2}{1 - e^{-2 \kappa_m}}, \qquad
          \omega = \frac{2 \pi}{\tau},

with :math:`\theta_m^2 = 1 - (2/m\omega)^2` and the decay
:math:`e^{-\kappa_m} = (1 - \theta_m)/(1 + \theta_m)` from particle to particle.
"""

import math

import numpy as np

from benchmarks.slow_chains.harmonic_limit import remainders
from chaincor.analysis.slow_chains.harmonic import PressedEnd

RATES = (0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)
# The length of the push differs by up to four intervals of 2.3 between contacts.
_PHASES = np.linspace(0.0, 9.2, 13)[:-1]
# The search without a guess begins when the push is smaller than these parts of the rate's powers.
_IRREGULAR, _POWER, _FEW = 6.0, 0.6, 50.0
_TERMS = np.arange(1, 4001)


def steady_contacts(interval: float) -> tuple[float, float]:
    """
    Return surplus and action of contacts at equal intervals under a constant push of 1.

    Parameters
    ----------
    interval : float
        Time between contacts, less than pi.
    """
    reach = interval / (math.pi * _TERMS)
    theta = np.sqrt(1.0 - reach**2)
    decay = (1.0 - theta) / (1.0 + theta)
    terms = (2.0 * (1.0 - theta) / reach) ** 2 / (1.0 - decay**2)
    # At large m, the terms are reach^2/2 and reach^2.
    rest = (interval / math.pi) ** 2 / (len(_TERMS) + 0.5)
    surplus = 0.5 + float(np.sum(1.0 - theta)) + 0.5 * rest
    return surplus, interval / (4.0 * math.pi) * (float(np.sum(terms)) + rest)


def interval_under(push: float, interval: float = 2.29954) -> float:
    """Return the interval under a smaller push, for the action of `interval` under a push of 1."""
    action = steady_contacts(interval)[1]
    shortest, longest = interval, math.pi
    for _ in range(60):
        middle = 0.5 * (shortest + longest)
        if steady_contacts(middle)[1] * push**2 < action:
            shortest = middle
        else:
            longest = middle
    return middle


def interval_at(push: float, rate: float) -> float:
    """Return the interval between contacts at which a decreasing push passes a value."""
    end = PressedEnd(rate)
    while end.push > push:
        end.next_contact()
    return end.times[-1] - end.times[-2]


def excess(rate: float) -> float:
    """Return the final impulse minus 1/(2a)."""
    end = PressedEnd(rate)
    while end.push > max(_IRREGULAR * rate**_POWER, _FEW * rate):
        end.next_contact()
    while end.next_contact(until=1.0 / rate + 40.0, steady=False):
        pass
    return end.surplus - 0.5 * end.push**2 / rate


def mean_excess(rate: float) -> tuple[float, float]:
    """Return mean and error of the excess over 12 phases of the last contacts."""
    found = [excess(1.0 / (1.0 / rate + late)) for late in _PHASES]
    return float(np.mean(found)), float(np.std(found, ddof=1)) / len(found) ** 0.5


def part_of_excess(n: float) -> tuple[float, float]:
    """Return -2 n^(-1/3) E and its error, the part of the excess in a harmonic chain's loss."""
    # When the push vanishes, its slope is a = 2^(5/3) Ai(z0) n^(-1/3).
    mean, error = mean_excess(1.44891 * n ** (-1.0 / 3.0))
    return -2.0 * n ** (-1.0 / 3.0) * mean, 2.0 * n ** (-1.0 / 3.0) * error


def main() -> None:
    """Print intervals, excesses, and the part of the excess in the remainder of chains."""
    print("| push | interval, a = 1e-4 | equal action |\n|---|---|---|")
    for push in (0.9, 0.7, 0.5, 0.3):
        print(
            f"| {push} | {interval_at(push, 1e-4):.4f} | {interval_under(push):.4f} |", flush=True
        )
    print("| n | remainder | -2 n^(-1/3) excess |\n|---|---|---|")
    for n, remainder, error in remainders():
        part, bar = part_of_excess(n)
        print(f"| {n:.0f} | {remainder:.4f}({error:.4f}) | {part:.4f}({bar:.4f}) |", flush=True)
    print("| a | excess | error | excess/a^(3/5) |\n|---|---|---|---|")
    for rate in RATES:
        mean, error = mean_excess(rate)
        print(f"| {rate:g} | {mean:.4f} | {error:.4f} | {mean / rate**0.6:.2f} |", flush=True)


if __name__ == "__main__":
    main()
