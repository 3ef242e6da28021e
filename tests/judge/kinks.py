"""
Judge chains whose bonds have kinks, by Dormand and Prince's method of order 8.

The judge shares no code with the engines. Steps end at the wall and at kinks, so that the method
keeps its order. The run ends when no contact has come for half the time of all contacts so far plus
four sound crossings.
"""

from functools import cache

import numpy as np
from numba import njit
from scipy.integrate import DOP853

_A = np.ascontiguousarray(DOP853.A[: DOP853.n_stages, : DOP853.n_stages])
_B = np.ascontiguousarray(DOP853.B)
_STEPS = (0.04, 0.025)
_MOST_STEPS = 3_000_000


@cache
def _loop(force):
    """Compile the judge around ``force(strain, parameters)``."""
    bond = njit(force)

    @njit
    def take(y, step, parameters, slopes, out):
        particles = y.shape[0] // 2
        for stage in range(_B.shape[0]):
            out[:] = y
            for earlier in range(stage):
                if _A[stage, earlier] != 0.0:
                    out += (step * _A[stage, earlier]) * slopes[earlier]
            rate, behind = slopes[stage], 0.0
            rate[0] = out[particles]
            for i in range(particles - 1):
                ahead = bond(out[1 + i], parameters)
                rate[1 + i] = out[particles + i + 1] - out[particles + i]
                rate[particles + i] = behind - ahead
                behind = ahead
            rate[2 * particles - 1] = behind
        out[:] = y
        for stage in range(_B.shape[0]):
            out += (step * _B[stage]) * slopes[stage]

    @njit
    def passed(y, side, kink):
        """Return whether particle 1 is behind the wall or a bond is beyond its kink."""
        if y[0] < 0.0:
            return True
        for i in range(side.shape[0]):  # noqa: SIM110 - a loop is what compiles
            if side[i] * (y[1 + i] - kink) < 0.0:
                return True
        return False

    @njit
    def may_touch(y, z, side, kink, step):
        """Return whether the wall or the kink may be crossed twice within a step."""
        particles = y.shape[0] // 2
        before, after = y[particles], z[particles]
        if before < 0.0 < after and min(y[0], z[0]) < step * (after - before):
            return True
        for i in range(side.shape[0]):
            before = y[particles + i + 1] - y[particles + i]
            after = z[particles + i + 1] - z[particles + i]
            if before * after < 0.0 and side[i] * before < 0.0:
                nearest = min(abs(y[1 + i] - kink), abs(z[1 + i] - kink))
                if nearest < step * (abs(before) + abs(after)):
                    return True
        return False

    @njit
    def run(particles, speed, parameters, kink, longest):
        y = np.zeros(2 * particles)
        y[particles:] = -speed
        y[particles] = speed
        z, slopes = np.zeros(2 * particles), np.zeros((_B.shape[0], 2 * particles))
        side = np.zeros(particles - 1)
        time, last, contacts = 0.0, 0.0, 1
        for _ in range(_MOST_STEPS):
            for i in range(particles - 1):
                away, opening = y[1 + i] - kink, y[particles + i + 1] - y[particles + i]
                if abs(away) > 1e-13 * speed:
                    side[i] = np.sign(away)
                else:  # at the kink; a bond at rest there crosses nothing
                    side[i] = np.sign(opening) if abs(opening) > 1e-9 * speed else 0.0
            step = longest
            take(y, step, parameters, slopes, z)
            while step > 1e-5 * longest and not passed(z, side, kink):
                if not may_touch(y, z, side, kink, step):
                    break
                step *= 0.5
                take(y, step, parameters, slopes, z)
            if passed(z, side, kink):
                early, late = 0.0, step
                while late - early > 1e-16 + 4e-16 * late:
                    middle = 0.5 * (early + late)
                    if middle in (early, late):
                        break
                    take(y, middle, parameters, slopes, z)
                    if passed(z, side, kink):
                        late = middle
                    else:
                        early = middle
                step = late
                take(y, step, parameters, slopes, z)
            y[:] = z
            time += step
            if y[0] <= 0.0 and y[particles] < 0.0:
                y[0], y[particles] = 0.0, -y[particles]
                last, contacts = time, contacts + 1
            if np.sum(y[particles:]) > 0.0 and time - last > 4.0 * particles + 20.0 + 0.5 * last:
                return (np.mean(y[particles:]) / speed) ** 2, contacts
        return np.nan, contacts

    return run


def judge(force, parameters, kink, particles, speed):
    """
    Return eta and its error.

    Parameters
    ----------
    force : callable
        -dU/dr as ``force(strain, parameters)``, with a stiffness of about 1.
    parameters : NamedTuple
        Parameters of the force.
    kink : float
        Strain at which the stiffness jumps; inf if it does not.
    particles : int
        n.
    speed : float
        v0.

    Returns
    -------
    tuple of float
        eta, and the difference between its values at two largest steps.
    """
    run = _loop(force)
    etas = [run(particles, speed, parameters, kink, step)[0] for step in _STEPS]
    return etas[1], abs(etas[1] - etas[0])
