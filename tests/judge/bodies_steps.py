"""Compile the steps of ``bodies``, the judge of two bodies."""

import numpy as np
from numba import njit

HARMONIC, LJ, TODA, LOG, POWER, MORSE = range(6)
DONE, UNDONE, LOST, RUNAWAY = range(4)
# An overlap changes by at most this fraction in a step. A contact is entered with this fraction of
# a step.
_OVERLAP_SHARE, _ENTRY = 0.2, 1e-8
# A contact shorter than this fraction of a step is ignored.
_GRAZE = 1e-9
# A bond whose energy exceeds this multiple of the initial energy has left its well for good.
_EXPLODED = 1e3


@njit(error_model="numpy", cache=True, inline="always")
def _bond(kind, p, q, s):
    """Return U', U'' and the strain over which U'' changes."""
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
    """Return the kinetic energy without that of the wall."""
    count = inverse.shape[0]
    energy = 0.0
    for i in range(count):
        if inverse[i] > 0.0:
            energy += 0.5 * y[count - 1 + i] ** 2 / inverse[i]
    return energy


@njit(error_model="numpy", cache=True)
def run_steps(
    y, inverse, first, law, contact, share, least, multiple, most_steps, most_energy, times, a, b
):
    count = inverse.shape[0]
    gap = first - 1
    ahead, behind = count - 1 + first, count - 2 + first
    soft = contact[0] > 0.0
    z, slopes = np.empty(y.shape[0]), np.empty((b.shape[0], y.shape[0]))
    now, last, hits, touching = 0.0, 0.0, 0, False
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
            last = now
            if soft:
                touching = True
            else:
                exchanged = -2.0 * opening / (inverse[gap] + inverse[first])
                y[behind] -= exchanged * inverse[gap]
                y[ahead] += exchanged * inverse[first]
                opening = -opening
        if hits > 0:
            begun = times[0]
            if now - begun > max(least, multiple * (last - begun)) and not touching:
                return DONE, now, hits, steps
        natural = share * _natural_step(y, inverse, gap, law, contact, touching)
        if natural > 1e100 and touching:
            # For free particles in contact, the natural step is the time in which they turn round.
            energy = 0.5 * opening * opening / (inverse[gap] + inverse[first])
            power = contact[1] + 1.0
            natural = share * (energy * power / contact[0]) ** (1.0 / power) / abs(opening)
        elif natural > 1e100:
            # For free particles apart, the step leads to the contact, or far beyond the motion if
            # no contact follows.
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
            # The particles turned. The search continues where their tangents meet on the other
            # side.
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
            if touching:
                last = now  # the end of a soft contact, which may last long
            touching = False
            continue
        y[:] = z
        now += step
    return UNDONE, now, hits, most_steps
