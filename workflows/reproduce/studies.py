"""From a plan to scenes: one study for each figure or group of numbers."""

from dataclasses import dataclass

from chaincor.lammps_inputs.scene import DEFAULT_HARMONIC_VELOCITY, Scene
from chaincor.workflows.reproduce.plan import PAPER_ORDERS, PAPER_SIZE_SPEEDS, Plan

CURVE_POTENTIALS = ("lj", "toda", "log")
# The interval of the chain of two is read off the contacts; eta there is nearly 1 whatever happens.
_PAIR_TOLERANCE = 1e-10


@dataclass(frozen=True)
class Study:
    """
    Scenes that belong together.

    Attributes
    ----------
    key : str
        Name, such as ``curves``.
    title : str
        For the progress bar and the table of times.
    scenes : tuple of Scene
        Run by LAMMPS and in-house.
    in_house : tuple of Scene
        Run in-house only: too long for LAMMPS in this plan.
    """

    key: str
    title: str
    scenes: tuple[Scene, ...]
    in_house: tuple[Scene, ...] = ()


def studies(plan: Plan) -> tuple[Study, ...]:
    """Return all studies of a plan; scenes that occur in several are computed once."""
    return (
        _curves(plan),
        _harmonic_sizes(plan),
        _harmonic_velocities(plan),
        _sizes(plan),
        _increase(plan),
        _slopes(plan),
        _pair(plan),
    )


def _curves(plan: Plan) -> Study:
    scenes = (
        Scene(potential=name, particles=plan.curve_particles, speed=speed, tolerance=plan.tolerance)
        for name in CURVE_POTENTIALS
        for speed in plan.curve_speeds
    )
    return Study("curves", "η against speed, lj, toda, log", tuple(scenes))


def _harmonic(
    particles: int, tolerance: float, velocity: float = DEFAULT_HARMONIC_VELOCITY
) -> Scene:
    return Scene(potential="harmonic", particles=particles, velocity=velocity, tolerance=tolerance)


def _harmonic_sizes(plan: Plan) -> Study:
    return Study(
        "harmonic_sizes",
        "harmonic chains of many lengths",
        tuple(_harmonic(n, plan.tolerance) for n in plan.harmonic_sizes),
        tuple(_harmonic(n, plan.tolerance) for n in plan.harmonic_far_sizes),
    )


def _harmonic_velocities(plan: Plan) -> Study:
    tolerance = 0.1 * plan.tolerance
    return Study(
        "harmonic_velocities",
        "harmonic chain at many velocities",
        tuple(
            _harmonic(plan.curve_particles, tolerance, velocity)
            for velocity in plan.harmonic_velocities
        ),
    )


def _lj(plan: Plan, particles: int, speed: float) -> Scene:
    return Scene(potential="lj", particles=particles, speed=speed, tolerance=plan.tolerance)


def _sizes(plan: Plan) -> Study:
    return Study(
        "sizes",
        "lj chains of many lengths at five speeds",
        tuple(_lj(plan, n, u) for u in PAPER_SIZE_SPEEDS for n in plan.sizes),
        tuple(_lj(plan, n, u) for u, sizes in plan.far_sizes.items() for n in sizes),
    )


def _increase(plan: Plan) -> Study:
    finest = min(plan.increase_tolerances.values())
    scenes = [_harmonic(plan.curve_particles, finest)]
    scenes += [
        Scene(
            potential="power",
            power_order=order,
            power_c=c,
            particles=plan.curve_particles,
            speed=speed,
            tolerance=plan.increase_tolerances[order],
        )
        for order, c in PAPER_ORDERS.items()
        for speed in plan.increase_speeds[order]
    ]
    return Study("increase", "increase of dissipation, r = 3, 4, 5", tuple(scenes))


def _slopes(plan: Plan) -> Study:
    def scenes(sizes: tuple[int, ...]) -> tuple[Scene, ...]:
        chains = [_lj(plan, n, u) for n in sizes for u in plan.slope_speeds]
        return tuple([_harmonic(n, plan.tolerance) for n in sizes] + chains)

    return Study(
        "slopes", "initial slope C, lj", scenes(plan.slope_sizes), scenes(plan.slope_far_sizes)
    )


def _pair(plan: Plan) -> Study:
    return Study(
        "pair",
        "chain of two, for α",
        tuple(
            Scene(potential="lj", particles=2, speed=speed, tolerance=_PAIR_TOLERANCE)
            for speed in plan.pair_speeds
        ),
    )
