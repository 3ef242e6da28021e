"""
Excess of a wall's impulse over its ideal maximum, if the push decreases linearly.

    python -m benchmarks.slow_chains.ending

A wall pushes a half-infinite harmonic chain with an average force of 1 - c t. The ideal maximum of
the momentum is 1/(2c), and the final momentum is larger. The excess is smaller if the push ends
more slowly. Results are means over 20 phases of the last contacts.
"""

import math

import numpy as np

from chaincor.analysis.slow_chains.harmonic import PressedEnd


class _Ramp:
    """Echo of the free end that is linear in time."""

    def __init__(self, rate: float) -> None:
        self._rate = rate

    def of(self, time: float, times: list[float], momenta: list[float]) -> tuple[float, float]:
        return 0.5 * self._rate * time**2, self._rate * time


def excess(rate: float) -> float:
    """Return the final momentum minus 1/(2c)."""
    end = PressedEnd()
    while end.next_contact(_Ramp(rate), until=1.0 / rate + 40.0):
        pass
    return math.fsum(end.momenta) - 0.5 / rate


def main() -> None:
    """Print means and scatters."""
    print("| c | excess | scatter |\n|---|---|---|")
    for rate in (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001):
        # The durations of the push differ by up to four intervals of 2.3 between contacts.
        found = [excess(1.0 / (1.0 / rate + late)) for late in np.linspace(0.0, 9.2, 21)[:-1]]
        print(f"| {rate} | {np.mean(found):.4f} | {np.std(found):.4f} |", flush=True)


if __name__ == "__main__":
    main()
