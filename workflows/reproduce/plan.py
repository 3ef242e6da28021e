"""Plan the scenes that check the paper: a quick plan and a full plan, as plain numbers."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from chaincor.lammps_inputs.scene import DEFAULT_HARMONIC_VELOCITY, Scene

# The paper's figure of 1 - eta against n has these five speeds, in units of v*.
PAPER_SIZE_SPEEDS = (0.780, 0.390, 0.160, 0.078, 0.008)
# The paper's figure of the increase has these orders of the lowest anharmonic term, each with the
# sign of c that stiffens compression. Only the sign matters, because c scales lengths and eta(v/v*)
# is the same for every |c|.
PAPER_ORDERS = {3: -1.0, 4: 1.0, 5: -1.0}


@dataclass(frozen=True)
class ReproductionPlan:
    """
    All numbers that decide the scenes of `chaincor reproduce`.

    Speeds are in units of v*, and tolerances are absolute errors of eta.
    """

    name: str  #: ``quick`` or ``full``.
    tolerance: float  #: Tolerance of every plotted point.
    curve_particles: int  #: Length of the chains whose eta is drawn against speed.
    curve_speeds: tuple[float, ...]  #: Speeds for lj, toda and log chains.
    #: Lengths of harmonic chains by LAMMPS and by the reference engine.
    harmonic_sizes: tuple[int, ...]
    #: Longer or more closely spaced lengths of harmonic chains, by the echo of the free end.
    harmonic_far_sizes: tuple[int, ...]
    #: Lengths around which harmonic chains give the limit of long chains.
    harmonic_longest: tuple[int, ...]
    #: Velocities at which the harmonic chain's eta must be the same.
    harmonic_velocities: tuple[float, ...]
    #: Lengths of lj chains at the paper's five speeds. The most expensive runs use the reference
    #: engine only.
    sizes: tuple[int, ...]
    #: Longer lj chains by speed, by the reference engine only.
    far_sizes: dict[float, tuple[int, ...]]
    #: Speeds for the increase of dissipation, by order. Chains of order 3 break from 0.15 v* on,
    #: and reach their low-speed limit only below 0.005 v*.
    increase_speeds: dict[int, tuple[float, ...]]
    #: Tolerances by order, at most 2 % of the smallest increase in the figure.
    increase_tolerances: dict[int, float]
    #: Lengths of lj chains for C, the initial slope of dissipation against speed.
    slope_sizes: tuple[int, ...]
    slope_far_sizes: tuple[int, ...]  #: Longer lj chains for C, by the reference engine only.
    slope_speeds: tuple[float, ...]  #: Speeds of the chains for C.
    slow_sizes: tuple[int, ...]  #: Lengths of slow chains of five bonds.
    slow_variables: tuple[float, ...]  #: Values of kappa v0 n^(2/3) of the slow chains.
    pair_speeds: tuple[float, ...]  #: Speeds of the chain of two particles, for alpha.


@dataclass(frozen=True)
class Study:
    """Scenes of one study."""

    key: str  #: Name, such as ``curves``.
    title: str  #: Title in the table of times.
    scenes: tuple[Scene, ...]  #: Scenes for LAMMPS and the reference engine.
    #: Scenes for the reference engine only, which take LAMMPS too long in this plan.
    reference: tuple[Scene, ...] = ()
    #: Harmonic chains of 20 particles or more, by the echo of their free end.
    echoed: tuple[Scene, ...] = ()

    @property
    def all_scenes(self) -> tuple[Scene, ...]:
        """Scenes of the study for all engines."""
        return (*self.scenes, *self.reference, *self.echoed)


def harmonic_chains(
    lengths: Iterable[int],
    tolerance: float,
    velocities: Iterable[float] = (DEFAULT_HARMONIC_VELOCITY,),
) -> tuple[Scene, ...]:
    """Return harmonic chains, defined equally for all studies so that equal scenes run once."""
    return tuple(
        Scene(potential="harmonic", particles=n, velocity=v, tolerance=tolerance)
        for n, v in product(lengths, velocities)
    )


def chains(
    potential: str, lengths: Iterable[int], speeds: Iterable[float], tolerance: float, **more: Any
) -> tuple[Scene, ...]:
    """Return scenes of chains with other bonds, at speeds in units of v*."""
    return tuple(
        Scene(potential=potential, particles=n, speed=u, tolerance=tolerance, **more)
        for n, u in product(lengths, speeds)
    )


def _speeds(first: float, last: float, count: int, *more: float) -> tuple[float, ...]:
    """Return speeds evenly spaced on a logarithmic scale, rounded to 6 digits, and extra speeds."""
    spaced = (float(f"{u:.6g}") for u in np.geomspace(first, last, count))
    return tuple(sorted({*spaced, *more}))


def _sizes(first: int, last: int, count: int, *more: int) -> tuple[int, ...]:
    spaced = np.round(np.geomspace(first, last, count)).astype(int).tolist()
    return tuple(sorted({*spaced, *more}))


# These additional speeds lie near the minimum and where f/n reaches 1, and include the speeds of
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
    # Faster and longer chains break at the free end, and their eta would need ever smaller steps.
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
        0.39: (1400, 2000),  # At n = 3000, rounding decides whether eta is 0.781 or 0.784.
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
