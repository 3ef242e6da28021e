r"""
A judge of two bodies on a line: Dormand and Prince's order 8, steps ended where the bodies touch.

It shares no code with the engines. The state is all strains, the gap among them, and the
velocities. Steps follow the stiffest bond of the moment and how fast bonds change; an overlap of
soft bodies is entered and left in steps that grow and shrink with it, for the force
:math:`K d^q` has no Taylor series there. It is followed on until `multiple` times the time of the
last contact, and counted anew whenever one comes. Two runs of different steps are compared.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.integrate import DOP853

Array = NDArray[np.float64]

_A = np.ascontiguousarray(DOP853.A[: DOP853.n_stages, : DOP853.n_stages])
_B = np.ascontiguousarray(DOP853.B)
# Steps in units of the stiffest bond's 1/frequency, and of the time in which a bond gets another
# stiffness; where the runs disagree, both are run again with parts of these.
STEPS = (0.5, 0.35)
CLOSER = (1.0, 0.6, 0.36)
# An overlap changes by so much of itself in a step; what it is entered with, in parts of a step.
_OVERLAP_SHARE, _ENTRY = 0.2, 1e-8
# A touch shorter than such a part of a step is nothing.
_GRAZE = 1e-9
# Roundings of a run, of each step and each contact.
_FLOOR, _STEP_FLOOR, _CONTACT_FLOOR = 1e-13, 3e-17, 1e-15

HARMONIC, LJ, TODA, LOG, POWER, MORSE = range(6)
KINDS = {
    "harmonic": HARMONIC,
    "lj": LJ,
    "toda": TODA,
    "log": LOG,
    "power": POWER,
    "morse": MORSE,
}
DONE, UNDONE, LOST, RUNAWAY = range(4)
# Beyond so many times the energy at the start a bond has left its well for good.
_EXPLODED = 1e3
_MOST_CONTACTS = 2_000_000


@dataclass(frozen=True)
class Bonds:
    """
    A law by its name, with b for toda, c and order for power, D and a for morse.

    U = D (1 - exp(-a s))^2 for morse; the others as in the package's table.
    """

    name: str
    first: float = 0.0
    second: float = 0.0


@dataclass(frozen=True)
class Bodies:
    """
    What collides, along x: the target from its far end, then the chain.

    Attributes
    ----------
    masses, velocities : ndarray of shape (N,)
        A mass of inf is a wall.
    strains : ndarray of shape (N - 1,)
        At `first` - 1 the gap.
    first : int
        Particles of the target, or 1.
    stiffness, exponent : float
        K and q of soft bodies; K = 0 is hard.
    """

    masses: Array
    velocities: Array
    strains: Array
    first: int
    stiffness: float = 0.0
    exponent: float = 1.5


@dataclass(frozen=True)
class Seen:
    """
    What one run saw.

    Attributes
    ----------
    restitution : float
        Square of the ratio of relative velocities of the centres of mass.
    contacts : int
        Contacts; of soft bodies the overlaps.
    first_contact, last_contact : float
        When the first and the last began, since the start.
    contact_times : ndarray of shape (contacts,)
        Since the first.
    horizon : float
        Until when it was followed.
    strains, velocities : ndarray
        The last state.
    energy_drift, momentum_drift : float
        Relative to the energy, and to the momentum of all particles at its mean speed; the latter
        without a wall only.
    steps : int
        Taken.
    """

    restitution: float
    contacts: int
    first_contact: float
    last_contact: float
    contact_times: Array
    horizon: float
    strains: Array
    velocities: Array
    energy_drift: float
    momentum_drift: float
    steps: int


@dataclass(frozen=True)
class Judgement:
    """The finer run, and by how much it may be off; inf where the runs differ in contacts."""

    seen: Seen
    error: float


class Unsure(RuntimeError):
    """The judge cannot follow a motion."""


@njit(error_model="numpy", cache=True, inline="always")
def _bond(kind, p, q, s):
    """Return U', U'' and the length over which that changes."""
    if kind == HARMONIC:
        return s, 1.0, 1e300
    if kind == LJ:
        y = 1.0 / (1.0 + s)
        y2 = y * y
        y6 = y2 * y2 * y2
        # 1 - r^-6 without cancellation.
        rest = s * y * (1.0 + y) * (1.0 + y2 * (1.0 + y2))
        return y6 * y * rest / 6.0, y6 * y2 * (13.0 * y6 - 7.0) / 6.0, 0.2 * (1.0 + s)
    if kind == TODA:
        decay = np.expm1(-p * s)
        return -decay / p, 1.0 + decay, 2.0 / p
    if kind == LOG:
        y = 1.0 / (1.0 + s)
        return s * y, y * y, 0.5 * (1.0 + s)
    if kind == POWER:
        power = s ** int(q - 2)
        curvature = q * (q - 1.0) * p * power
        return (
            s * (1.0 + q * p * power),
            1.0 + curvature,
            1.0 / (1.0 + abs(q * p) ** (1.0 / (q - 2))),
        )
    decay = np.expm1(-q * s)
    return (
        -2.0 * p * q * (1.0 + decay) * decay,
        2.0 * p * q * q * (1.0 + decay) * (1.0 + 2.0 * decay),
        1.0 / q,
    )


@njit(error_model="numpy", cache=True)
def _rates(y, inverse, gap, law, contact, touching, rate):
    count = inverse.shape[0]
    kind = int(law[0])
    behind = 0.0
    for i in range(count - 1):
        rate[i] = y[count + i] - y[count - 1 + i]
        if i == gap:
            ahead = 0.0
            if touching and y[i] < 0.0:
                ahead = -contact[0] * (-y[i]) ** contact[1]
        else:
            ahead = _bond(kind, law[1], law[2], y[i])[0]
        rate[count - 1 + i] = (ahead - behind) * inverse[i]
        behind = ahead
    rate[2 * count - 2] = -behind * inverse[count - 1]


@njit(error_model="numpy", cache=True)
def _take(y, step, inverse, gap, law, contact, touching, slopes, out, a, b):
    size = y.shape[0]
    for stage in range(b.shape[0]):
        out[:] = y
        for earlier in range(stage):
            share = step * a[stage, earlier]
            if share != 0.0:
                slope = slopes[earlier]
                for i in range(size):
                    out[i] += share * slope[i]
        _rates(out, inverse, gap, law, contact, touching, slopes[stage])
    out[:] = y
    for stage in range(b.shape[0]):
        share = step * b[stage]
        if share != 0.0:
            slope = slopes[stage]
            for i in range(size):
                out[i] += share * slope[i]


@njit(error_model="numpy", cache=True)
def _natural_step(y, inverse, gap, law, contact, touching):
    """Return the shortest time in which anything changes."""
    count = inverse.shape[0]
    kind = int(law[0])
    fastest = 1e-300
    for i in range(count - 1):
        if i == gap:
            if touching and y[i] < 0.0:
                stiffness = contact[0] * contact[1] * (-y[i]) ** (contact[1] - 1.0)
                fastest = max(fastest, stiffness * (inverse[i] + inverse[i + 1]))
            continue
        _, stiffness, length = _bond(kind, law[1], law[2], y[i])
        change = abs(y[count + i] - y[count - 1 + i]) / length
        fastest = max(fastest, abs(stiffness) * (inverse[i] + inverse[i + 1]), change * change)
    return 1.0 / np.sqrt(fastest)


@njit(error_model="numpy", cache=True)
def _kinetic(y, inverse):
    """Return the energy of all that is no wall."""
    count = inverse.shape[0]
    energy = 0.0
    for i in range(count):
        if inverse[i] > 0.0:
            energy += 0.5 * y[count - 1 + i] ** 2 / inverse[i]
    return energy


@njit(error_model="numpy", cache=True)
def _run(
    y, inverse, first, law, contact, share, least, multiple, most_steps, most_energy, times, a, b
):
    count = inverse.shape[0]
    gap = first - 1
    ahead, behind = count - 1 + first, count - 2 + first
    soft = contact[0] > 0.0
    z, slopes = np.empty(y.shape[0]), np.empty((b.shape[0], y.shape[0]))
    now, hits, touching = 0.0, 0, False
    longest = 1e300
    ceiling = _EXPLODED * most_energy
    for steps in range(most_steps):
        if steps % 64 == 0 and not _kinetic(y, inverse) < ceiling:
            return RUNAWAY, now, hits, steps
        opening = y[ahead] - y[behind]
        if y[gap] == 0.0 and opening < 0.0 and not touching:
            if hits == times.shape[0]:
                return LOST, now, hits, steps
            times[hits] = now
            hits += 1
            if soft:
                touching = True
            else:
                exchanged = -2.0 * opening / (inverse[gap] + inverse[first])
                y[behind] -= exchanged * inverse[gap]
                y[ahead] += exchanged * inverse[first]
                opening = -opening
        if hits > 0:
            begun = times[0]
            if now - begun > max(least, multiple * (times[hits - 1] - begun)) and not touching:
                return DONE, now, hits, steps
        natural = share * _natural_step(y, inverse, gap, law, contact, touching)
        if natural > 1e100 and touching:
            # Free particles at their touch: as long as they take to turn.
            energy = 0.5 * opening * opening / (inverse[gap] + inverse[first])
            power = contact[1] + 1.0
            natural = share * (energy * power / contact[0]) ** (1.0 / power) / abs(opening)
        elif natural > 1e100:
            # Free particles: on to the contact, or long beyond any.
            natural = -1.5 * y[gap] / opening if opening < 0.0 else 2.0 * least
        step = natural
        if touching and opening != 0.0:
            step = min(step, _OVERLAP_SHARE * abs(y[gap] / opening) + _ENTRY * natural)
        step = min(step, longest)
        longest = 1e300
        _take(y, step, inverse, gap, law, contact, touching, slopes, z, a, b)
        if not np.isfinite(z[gap]):
            return LOST, now, hits, steps
        sign = -1.0 if touching else 1.0
        after = z[ahead] - z[behind]
        event = sign * z[gap] < 0.0
        if not event and sign * opening < 0.0 < sign * after and step > _GRAZE * natural:
            # It turned: where its tangents meet on the other side, look closer.
            met = (z[gap] - y[gap] - after * step) / (opening - after)
            if sign * (y[gap] + opening * met) < 0.0:
                longest = 0.25 * step
                continue
        if event:
            low, high = 0.0, step
            place, speed = z[gap], after
            t = step
            for _ in range(100):
                t = t - place / speed if speed != 0.0 else low
                if not low < t < high:
                    t = 0.5 * (low + high)
                _take(y, t, inverse, gap, law, contact, touching, slopes, z, a, b)
                place, speed = z[gap], z[ahead] - z[behind]
                if place == 0.0:
                    break
                if sign * place > 0.0:
                    low = t
                else:
                    high = t
                if high - low <= 4e-16 * high or abs(place) < 1e-17 * abs(speed) * step:
                    break
            y[:] = z
            now += t
            y[gap] = 0.0
            touching = False
            continue
        y[:] = z
        now += step
    return UNDONE, now, hits, most_steps


def energy_of(bonds: Bonds, bodies: Bodies, strains: Array, velocities: Array) -> float:
    """Return the energy of all but the wall, of bodies that do not overlap."""
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


def crossing_time(bodies: Bodies, stiffness: float = 1.0) -> float:
    """Return how long sound takes through the slower body, and a bond or two."""
    parts = [bodies.masses[bodies.first :], bodies.masses[: bodies.first]]
    return max(
        (len(m) + 1) * float(np.sqrt(np.mean(m) / stiffness)) for m in parts if np.isfinite(m).all()
    )


def run_once(
    bonds: Bonds,
    bodies: Bodies,
    share: float,
    *,
    multiple: float = 20.0,
    most_steps: int = 5_000_000,
) -> Seen:
    """
    Carry two bodies through a collision, and on.

    Parameters
    ----------
    bonds, bodies
        What collides.
    share : float
        Of the natural step.
    multiple : float
        Until when, in times from the first to the last contact; 40 crossings of sound at least.
    most_steps : int
        When to give up.

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
    ended, now, hits, steps = _run(
        y, 1.0 / bodies.masses, bodies.first,
        np.array([KINDS[bonds.name], bonds.first, bonds.second]),
        np.array([bodies.stiffness, bodies.exponent]),
        share, 40.0 * crossing_time(bodies), multiple, most_steps, before, times, _A, _B,
    )  # fmt: skip
    if ended == RUNAWAY:
        raise Unsure(f"a bond runs away over its barrier before t = {now:g}")
    if ended != DONE:
        raise Unsure(f"not at its end after {steps} steps and {hits} contacts, at t = {now:g}")
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
    Run twice and compare.

    Parameters
    ----------
    bonds, bodies, settings
        As in :func:`run_once`.
    closer : float
        Part of the usual steps.

    Returns
    -------
    Judgement
        Of the finer run. The error of a smooth motion falls with the eighth power of the step, to
        a seventeenth; a third of the difference is taken, and energy that did not stay.
    """
    coarse, fine = (run_once(bonds, bodies, closer * share, **settings) for share in STEPS)
    if coarse.contacts != fine.contacts:
        return Judgement(fine, np.inf)
    rounding = _FLOOR + _STEP_FLOOR * fine.steps + _CONTACT_FLOOR * fine.contacts
    return Judgement(fine, abs(coarse.restitution - fine.restitution) / 3.0 + rounding)
