r"""
Judge two bodies on a line by Dormand and Prince's method of order 8.

The judge shares no code with the engines. A step ends where the bodies touch. The state is all
strains, among them the gap, and the velocities. Steps follow the stiffest bond of the moment and
the rate at which bonds change. The steps grow and shrink with the overlap of soft bodies, because
the force :math:`K d^q` has no Taylor series at :math:`d = 0`. The motion is followed until
`multiple` times the time of the last contact; each new contact extends this time. Two runs with
different steps are compared.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DOP853

from tests.judge.bodies_steps import (
    DONE,
    HARMONIC,
    LJ,
    LOG,
    MORSE,
    POWER,
    RUNAWAY,
    TODA,
    run_steps,
)

Array = NDArray[np.float64]

_A = np.ascontiguousarray(DOP853.A[: DOP853.n_stages, : DOP853.n_stages])
_B = np.ascontiguousarray(DOP853.B)
# Steps are in units of the stiffest bond's 1/frequency, and of the time in which a bond changes its
# stiffness. If the runs disagree, both are repeated with these fractions of the steps.
STEPS = (0.5, 0.35)
CLOSER = (1.0, 0.6, 0.36)
# Rounding errors: of a whole run, of each step and of each contact.
_FLOOR, _STEP_FLOOR, _CONTACT_FLOOR = 1e-13, 3e-17, 1e-15

KINDS = {
    "harmonic": HARMONIC,
    "lj": LJ,
    "toda": TODA,
    "log": LOG,
    "power": POWER,
    "morse": MORSE,
}
_MOST_CONTACTS = 2_000_000


@dataclass(frozen=True)
class Bonds:
    """
    A force law: its name, with b for toda, c and order for power, D and a for morse.

    For morse, U = D (1 - exp(-a s))^2. The other laws are those of the package's table.
    """

    name: str
    first: float = 0.0
    second: float = 0.0


@dataclass(frozen=True)
class Bodies:
    """Bodies of a collision along x: the target from its far end, then the chain."""

    #: Masses, of shape (N,); a wall has the mass inf.
    masses: Array
    velocities: Array  #: See ``masses``.
    strains: Array  #: Strains, of shape (N - 1,); element `first` - 1 is the gap.
    first: int  #: Number of particles of the target; 1 for a wall.
    #: K and q of soft bodies; K = 0 is hard.
    stiffness: float = 0.0
    exponent: float = 1.5  #: See ``stiffness``.


@dataclass(frozen=True)
class Seen:
    """Result of one run."""

    restitution: float  #: Square of the ratio of relative velocities of the centres of mass.
    contacts: int  #: Number of contacts; for soft bodies, of overlaps.
    #: Times from the start to the beginnings of the first and the last contact.
    first_contact: float
    last_contact: float  #: See ``first_contact``.
    contact_times: Array  #: Times since the first contact, of shape (contacts,).
    horizon: float  #: Time up to which the motion was followed.
    #: The last state.
    strains: Array
    velocities: Array  #: See ``strains``.
    #: Drift relative to the energy, and to the momentum of all particles at the speed of that
    #: energy. The momentum drift is 0 if there is a wall.
    energy_drift: float
    momentum_drift: float  #: See ``energy_drift``.
    steps: int  #: Number of steps.


@dataclass(frozen=True)
class Judgement:
    """The finer run and its error, which is inf if the runs differ in their numbers of contacts."""

    seen: Seen
    error: float


class Unsure(RuntimeError):
    """The judge could not follow a motion to its end; gives the contacts and the time reached."""

    def __init__(self, message: str, contacts: int = 0, time: float = 0.0) -> None:
        super().__init__(message)
        self.contacts, self.time = contacts, time


def energy_of(bonds: Bonds, bodies: Bodies, strains: Array, velocities: Array) -> float:
    """Return the energy without that of the wall, for bodies that do not overlap."""
    free = np.isfinite(bodies.masses)
    energy = 0.5 * float(np.sum(bodies.masses[free] * velocities[free] ** 2))
    s = np.delete(strains, bodies.first - 1)
    p, q = bonds.first, bonds.second
    with np.errstate(all="ignore"):
        values = {
            "harmonic": lambda: 0.5 * s**2,
            "lj": lambda: np.expm1(-6.0 * np.log1p(s)) ** 2 / 72.0,
            "toda": lambda: (np.expm1(-p * s) + p * s) / p**2,
            "log": lambda: s - np.log1p(s),
            "power": lambda: s**2 * (0.5 + p * s ** (q - 2)),
            "morse": lambda: p * np.expm1(-q * s) ** 2,
        }[bonds.name]()
    return energy + float(np.sum(values))


def _opening(bodies: Bodies, velocities: Array) -> float:
    first, masses = bodies.first, bodies.masses
    chain, target = masses[first:], masses[:first]
    speed = float(chain @ velocities[first:] / chain.sum())
    if np.isfinite(target).all():
        speed -= float(target @ velocities[:first] / target.sum())
    return speed


def crossing_time(bodies: Bodies) -> float:
    """Return the time in which sound crosses the slower body and one or two further bonds."""
    parts = [bodies.masses[bodies.first :], bodies.masses[: bodies.first]]
    return max((len(m) + 1) * float(np.sqrt(np.mean(m))) for m in parts if np.isfinite(m).all())


def run_once(
    bonds: Bonds,
    bodies: Bodies,
    share: float,
    *,
    multiple: float = 20.0,
    most_steps: int = 5_000_000,
) -> Seen:
    """
    Integrate two bodies through a collision and beyond it.

    Parameters
    ----------
    bonds, bodies
        What collides.
    share : float
        Fraction of the natural step.
    multiple : float
        Duration of the run, in units of the time from the first contact to the end of the last. The
        run lasts for at least 40 sound crossings.
    most_steps : int
        Number of steps after which the judge gives up.

    Returns
    -------
    Seen
        What was seen.

    Raises
    ------
    Unsure
        If steps do not suffice, or the motion cannot be followed.
    """
    y = np.concatenate((bodies.strains, bodies.velocities)).astype(float)
    times = np.zeros(_MOST_CONTACTS)
    before = energy_of(bonds, bodies, bodies.strains, bodies.velocities)
    ended, now, hits, steps = run_steps(
        y, 1.0 / bodies.masses, bodies.first,
        np.array([KINDS[bonds.name], bonds.first, bonds.second]),
        np.array([bodies.stiffness, bodies.exponent]),
        share, 40.0 * crossing_time(bodies), multiple, most_steps, before, times, _A, _B,
    )  # fmt: skip
    if ended == RUNAWAY:
        raise Unsure(f"a bond runs away over its barrier before t = {now:g}")
    if ended != DONE:
        message = f"not at its end after {steps} steps and {hits} contacts, at t = {now:g}"
        raise Unsure(message, hits, now)
    count = len(bodies.masses)
    strains, velocities = y[: count - 1].copy(), y[count - 1 :].copy()
    after = energy_of(bonds, bodies, strains, velocities)
    momentum = 0.0
    if np.isfinite(bodies.masses).all():
        change = float(bodies.masses @ (velocities - bodies.velocities))
        momentum = change / (2.0 * before * float(bodies.masses.sum())) ** 0.5
    return Seen(
        restitution=(_opening(bodies, velocities) / _opening(bodies, bodies.velocities)) ** 2,
        contacts=hits,
        first_contact=float(times[0]),
        last_contact=float(times[hits - 1]),
        contact_times=times[:hits] - times[0],
        horizon=now,
        strains=strains,
        velocities=velocities,
        energy_drift=after / before - 1.0,
        momentum_drift=momentum,
        steps=steps,
    )


def judge(bonds: Bonds, bodies: Bodies, *, closer: float = 1.0, **settings) -> Judgement:
    """
    Run with two different steps and compare the results.

    Parameters
    ----------
    bonds, bodies, settings
        As in :func:`run_once`.
    closer : float
        Fraction of the usual steps.

    Returns
    -------
    Judgement
        Judgement of the finer run. The error of a smooth motion falls with the eighth power of the
        step, here to a seventeenth. The error given is a third of the difference between the two
        runs, plus the energy drift and rounding.
    """
    coarse, fine = (run_once(bonds, bodies, closer * share, **settings) for share in STEPS)
    if coarse.contacts != fine.contacts:
        return Judgement(fine, np.inf)
    rounding = _FLOOR + _STEP_FLOOR * fine.steps + _CONTACT_FLOOR * fine.contacts
    # Two runs may have the same error by chance. eta is in units of the energy of approach, and
    # compressed bodies have much more energy.
    approach = 0.5 * _reduced_mass(bodies) * _opening(bodies, bodies.velocities) ** 2
    whole = energy_of(bonds, bodies, bodies.strains, bodies.velocities)
    lost = abs(fine.energy_drift) * whole / approach
    return Judgement(fine, abs(coarse.restitution - fine.restitution) / 3.0 + lost + rounding)


def _reduced_mass(bodies: Bodies) -> float:
    target, chain = np.split(bodies.masses, [bodies.first])
    return float(1.0 / (1.0 / np.sum(target) + 1.0 / np.sum(chain)))
