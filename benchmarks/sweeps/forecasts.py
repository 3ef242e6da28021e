"""
Forecasts of single collisions against the time they take, as ratios.

    python -m benchmarks.sweeps.forecasts

A forecast is good where the ratio is within a factor of two of 1 on an idle machine whose cost
model is its own (`chaincor tradeoff --calibrate`).
"""

import time

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.work import Forecast
from chaincor.workflows.collision import collide

_CHAINS = (("lj", 100, 0.1), ("toda", 100, 1.0), ("log", 50, 0.5), ("lj", 200, 0.5))


def main() -> None:
    """Print one line a collision."""
    print("engine     potential  n     v/v*  seconds  forecast/seconds")
    for engine in ("lammps", "reference"):
        for potential, particles, speed in _CHAINS:
            scene = Scene(potential=potential, particles=particles, speed=speed, engine=engine)
            collide(scene)  # loads compiled code
            taken = []
            for _ in range(3):
                started = time.process_time()
                collide(scene)
                taken.append(time.process_time() - started)
            ratio = Forecast.of([scene]).seconds / min(taken)
            print(
                f"{engine:10} {potential:9} {particles:4} {speed:6.1f} "
                f"{min(taken):8.3f} {ratio:6.2f}"
            )


if __name__ == "__main__":
    main()
