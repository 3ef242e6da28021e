"""Define the quick plan and the full plan for checking the paper."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from chaincor.lammps_inputs.scene import DEFAULT_HARMONIC_VELOCITY, Scene

# The paper's figure of 1 - eta against n shows these five speeds, in units of v*.
PAPER_SIZE_SPEEDS = (0.780, 0.390, 0.160, 0.078, 0.008)
# Orders of the lowest anharmonic term in the paper's figure of the increase, each with the sign of
# c that makes bonds stiffer in compression. The size of c does not matter: c only scales lengths,
# and eta(v/v*) is the same for every |c|.
PAPER_ORDERS = {3: -1.0, 4: 1.0, 5: -1.0}


@dataclass(frozen=True)
class ReproductionPlan:
    """
    All numbers that determine the scenes of `chaincor reproduce`.

    Speeds are in units of v*, and tolerances are absolute errors of eta.
    """

    name: str  #: ``quick`` or ``full``.
    tolerance: float  #: Tolerance of every plotted point.
    curve_particles: int  #: Length of the chains in the figure of eta against speed.
    curve_speeds: tuple[float, ...]  #: Speeds of lj, toda and log chains.
    #: Lengths of harmonic chains for LAMMPS and the reference engine.
    harmonic_sizes: tuple[int, ...]
    #: Longer or more closely spaced lengths of harmonic chains for the echo method.
    harmonic_far_sizes: tuple[int, ...]
    #: Lengths around which harmonic chains determine the limit of long chains.
    harmonic_longest: tuple[int, ...]
    #: Velocities at which the harmonic chain must have the same eta.
    harmonic_velocities: tuple[float, ...]
    #: Lengths of lj chains at the paper's five speeds. The most expensive scenes are computed only
    #: by the reference engine.
    sizes: tuple[int, ...]
    #: Lengths of longer lj chains for each speed, only for the reference engine.
    far_sizes: dict[float, tuple[int, ...]]
    #: Speeds for the increase of dissipation, for each order. Chains of order 3 break from 0.15 v*
    #: on, and reach their low-speed limit only below 0.005 v*.
    increase_speeds: dict[int, tuple[float, ...]]
    #: Tolerance for each order, at most 2 % of the smallest increase in the figure.
    increase_tolerances: dict[int, float]
    #: Lengths of lj chains for C, the initial slope of dissipation against speed.
    slope_sizes: tuple[int, ...]
    #: Lengths of longer lj chains for C, only for the reference engine.
    slope_far_sizes: tuple[int, ...]
    slope_speeds: tuple[float, ...]  #: Speeds of the chains for C.
    slow_sizes: tuple[int, ...]  #: Lengths of slow chains with five bonds.
    slow_variables: tuple[float, ...]  #: Values of kappa v0 n^(2/3) of the slow chains.
    pair_speeds: tuple[float, ...]  #: Speeds of the chain of two particles, for alpha.


@dataclass(frozen=True)
class Study:
    """Scenes that are computed for one question."""

    key: str  #: Name, such as ``curves``.
    title: str  #: Title of the study in the table of times.
    scenes: tuple[Scene, ...]  #: Scenes for LAMMPS and the reference engine.
    #: Scenes only for the reference engine, because LAMMPS would take too long.
    reference: tuple[Scene, ...] = ()
    #: Harmonic chains of at least 20 particles, for the echo method.
    echoed: tuple[Scene, ...] = ()

    @property
    def all_scenes(self) -> tuple[Scene, ...]:
        """All scenes of the study."""
        return (*self.scenes, *self.reference, *self.echoed)


def harmonic_chains(
    lengths: Iterable[int],
    tolerance: float,
    velocities: Iterable[float] = (DEFAULT_HARMONIC_VELOCITY,),
) -> tuple[Scene, ...]:
    """
    Return the scenes of harmonic chains.

    All studies use this function, so that equal scenes run only once.
    """
    return tuple(
        Scene(potential="harmonic", particles=n, velocity=v, tolerance=tolerance)
        for n, v in product(lengths, velocities)
    )


def chains(
    potential: str, lengths: Iterable[int], speeds: Iterable[float], tolerance: float, **more: Any
) -> tuple[Scene, ...]:
    """Return the scenes of chains with other bonds, at speeds in units of v*."""
    return tuple(
        Scene(potential=potential, particles=n, speed=u, tolerance=tolerance, **more)
        for n, u in product(lengths, speeds)
    )


def _speeds(first: float, last: float, count: int, *more: float) -> tuple[float, ...]:
    """Return speeds with equal ratios, rounded to 6 digits, together with extra speeds."""
    spaced = (float(f"{u:.6g}") for u in np.geomspace(first, last, count))
    return tuple(sorted({*spaced, *more}))


def _sizes(first: int, last: int, count: int, *more: int) -> tuple[int, ...]:
    spaced = np.round(np.geomspace(first, last, count)).astype(int).tolist()
    return tuple(sorted({*spaced, *more}))


# The extra speeds lie near the minimum of eta and where f/n reaches 1. They include the speeds of
# the reference values.
_NOTEWORTHY = (0.4, 0.55, 0.65, 0.7, 0.78, 0.82, 0.86, 0.9, 1.1, 1.5, 2.0)

QUICK = ReproductionPlan(
    name="quick",
    tolerance=1e-5,
    curve_particles=100,
    curve_speeds=_speeds(0.01, 10.0, 25, *_NOTEWORTHY),
    harmonic_sizes=_sizes(2, 1000, 28, 10, 19, 20, 100, 500),
    harmonic_far_sizes=_sizes(150, 3000, 60, 4000, 5000, 7000, 10000),
    harmonic_longest=(3000, 10_000, 30_000),
    harmonic_velocities=(1e-3, 1e-2, 0.1, 0.5),
    sizes=(10, 20, 50, 100, 200, 500, 1000),
    # Faster and longer chains break at the free end, and their eta would need ever smaller time
    # steps.
    far_sizes={
        0.39: (2000,),
        0.16: (3000, 5000),
        0.078: (3000,),
        0.008: (2000, 3000, 5000, 10000),
    },
    increase_speeds={
        3: _speeds(0.01, 0.13, 12, 0.001, 0.002, 0.004),
        4: _speeds(0.01, 0.2, 13),
        5: _speeds(0.01, 0.2, 13),
    },
    increase_tolerances={3: 2e-6, 4: 4e-7, 5: 2e-8},
    slope_sizes=(100, 300),
    slope_far_sizes=(1000, 2000),
    slope_speeds=_speeds(0.005, 0.3, 9),
    slow_sizes=(30, 100, 300, 1000),
    slow_variables=(0.3, 1.0, 3.0, 10.0),
    pair_speeds=_speeds(1e-3, 0.3, 9),
)

FULL = ReproductionPlan(
    name="full",
    tolerance=1e-7,
    curve_particles=100,
    curve_speeds=_speeds(0.01, 10.0, 61, *_NOTEWORTHY),
    harmonic_sizes=_sizes(2, 2000, 60, 10, 19, 20, 100, 500, 1000),
    harmonic_far_sizes=_sizes(150, 20000, 120),
    harmonic_longest=(3000, 10_000, 30_000, 100_000),
    harmonic_velocities=(1e-3, 1e-2, 0.1, 0.3, 0.5),
    sizes=(10, 14, 20, 30, 50, 70, 100, 140, 200, 300, 500, 700, 1000),
    far_sizes={
        0.78: (1400, 2000),
        0.39: (1400, 2000),  # For n = 3000, rounding decides whether eta is 0.781 or 0.784.
        **dict.fromkeys((0.16, 0.078, 0.008), (1400, 2000, 3000, 5000, 10000, 20000)),
    },
    increase_speeds={
        3: _speeds(0.01, 0.13, 25, *_speeds(0.0005, 0.008, 7)),
        4: _speeds(0.005, 0.2, 25),
        5: _speeds(0.005, 0.2, 25),
    },
    increase_tolerances={3: 1e-7, 4: 2e-8, 5: 1e-9},
    slope_sizes=(100, 300, 1000),
    slope_far_sizes=(3000, 10000),
    slope_speeds=_speeds(0.003, 0.3, 15),
    slow_sizes=(30, 100, 300, 1000, 3000, 10000),
    slow_variables=(0.3, 1.0, 3.0, 5.0, 12.0, 30.0),
    pair_speeds=_speeds(1e-3, 0.3, 17),
)
