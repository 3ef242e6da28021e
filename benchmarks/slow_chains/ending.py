"""
How much a wall gives beyond the largest value of what it should, where its push ends linearly.

    python -m benchmarks.slow_chains.ending

A half-infinite harmonic chain is pressed with 1 - c t on average. The momentum ends above its
maximum, 1/(2c), by less the slower the push ends; means over 20 phases of the last contacts.
"""

import math

import numpy as np

from chaincor.analysis.slow_chains.harmonic import PressedEnd


class _Ramp:
    """Reflection of the free end if it were linear in time."""

    def __init__(self, rate: float) -> None:
        self._rate = rate

    def of(self, time: float, times: list[float], momenta: list[float]) -> tuple[float, float]:
        return 0.5 * self._rate * time**2, self._rate * time


def excess(rate: float) -> float:
    """Return the momentum beyond 1/(2c)."""
    end = PressedEnd()
    while end.next_contact(_Ramp(rate), until=1.0 / rate + 40.0):
        pass
    return math.fsum(end.momenta) - 0.5 / rate


def main() -> None:
    """Print means and scatters."""
    print("| c | excess | scatter |\n|---|---|---|")
    for rate in (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001):
        # Lengths of the ramp that differ by four contacts of 2.3 in all.
        found = [excess(1.0 / (1.0 / rate + late)) for late in np.linspace(0.0, 9.2, 21)[:-1]]
        print(f"| {rate} | {np.mean(found):.4f} | {np.std(found):.4f} |", flush=True)


if __name__ == "__main__":
    main()
