"""Draw the error of eta against the step for a hundred particles, stock wall and event wall.

No slope is claimed: with so many contacts the phase of each decides, so every step is shown.

Run: python -m benchmarks.convergence_plot
"""

import argparse
from pathlib import Path

import numpy as np

from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.reference import stepping

SCENE = Scene(potential="lj", particles=100, speed=0.4)
BOND_RANGE = (0.9, 1.2)
STEPS = 40
CURVES = (
    # label, wall, scheme, shortest and longest step, colour, marker
    ("stock fix wall/reflect", "reflect", "verlet", (0.0015, 0.06), "#b3312c", "x"),
    ("event wall, Verlet", "event", "verlet", (0.004, 0.1), "#1f5fa8", "o"),
    ("event wall, order 4", "event", "order4", (0.02, 0.3), "#3a8f4d", "s"),
    ("event wall, order 6", "event", "order6", (0.04, 0.4), "#8a5fb0", "^"),
    ("event wall, order 8", "event", "order8", (0.1, 0.5), "#c98a1b", "D"),
)


def restitution_of(run, numerics: Numerics) -> float:
    """Return eta of the scene."""
    return float(restitution(run(SCENE, numerics).velocities, SCENE.impact_velocity))


def main() -> None:
    """Run every step and draw the figure."""
    from matplotlib.figure import Figure

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/images/convergence.png"))
    output = parser.parse_args().output
    truth = restitution_of(stepping.run, Numerics(scheme="order8", timestep=0.05))
    figure = Figure(figsize=(7.5, 5.0), layout="constrained")
    axes = figure.add_subplot()
    for label, wall, scheme, span, colour, marker in CURVES:
        steps = np.geomspace(*span, STEPS)
        errors = [
            abs(
                restitution_of(lammps.run, Numerics(wall, scheme, h, bond_range=BOND_RANGE)) - truth
            )
            for h in steps.tolist()
        ]
        axes.loglog(
            steps, errors, marker=marker, color=colour, ms=4, lw=0.8, mfc="none", label=label
        )
        print(f"{label}: {min(errors):.1e} to {max(errors):.1e}", flush=True)
    axes.set_xlabel("composed step H (units of sqrt(mass/stiffness))")
    axes.set_ylabel(r"$|\eta(H) - \eta|$")
    axes.set_title("100 Lennard-Jones particles at 0.4 v*, by LAMMPS")
    axes.grid(True, which="major", lw=0.4, alpha=0.5)
    axes.legend(frameon=False)
    output.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(output, dpi=150)
    print(output)


if __name__ == "__main__":
    main()
