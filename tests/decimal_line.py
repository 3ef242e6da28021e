"""Compute collisions of harmonic bodies by Taylor series in 50 digits, without modes."""

from dataclasses import dataclass
from decimal import Decimal, localcontext

DIGITS = 50
_TERMS = 45


@dataclass(frozen=True)
class Sharp:
    """Result that is exact except for the last of the digits, rounded to floating-point numbers."""

    separation_rate: float
    contact_times: list[float]
    contact_speeds: list[float]
    velocities: list[float]
    displacements: list[float]


def collide_in_decimals(masses, first, strains, velocities, until: float) -> Sharp:
    """
    Integrate a line of particles (see ``lammps_inputs/line.py``) up to a given time.

    A wall has the mass inf. On each step, the gap is a polynomial. Its sign is evaluated on a fine
    grid, and roots are bisected. Contacts that are much less than a step apart are therefore found.
    """
    with localcontext() as context:
        context.prec = DIGITS
        inverse = [Decimal(0) if m == float("inf") else 1 / Decimal(m) for m in masses]
        count, gap = len(masses), first - 1
        s, v = [Decimal(x) for x in strains], [Decimal(x) for x in velocities]
        stiffest = max(inverse[i] for i in range(count)) * 4
        # The remainder after 45 terms, (omega h)^45/45! with omega h < 1/2, is below 1e-69.
        step = Decimal("0.5") / stiffest.sqrt()
        now, origin = Decimal(0), None
        times, speeds = [], []
        displacement = Decimal(0)  # of the particle at the contact end of the target

        def series():
            x, u = [list(s)], [list(v)]
            for m in range(_TERMS):
                pull = [Decimal(0)] + [0 if i == gap else x[m][i] for i in range(count - 1)]
                pull.append(Decimal(0))
                rate = [(pull[i + 1] - pull[i]) * inverse[i] / (m + 1) for i in range(count)]
                opening = [(u[m][i + 1] - u[m][i]) / (m + 1) for i in range(count - 1)]
                x.append(opening)
                u.append(rate)
            return x, u

        def at(coefficients, place, t):
            total = Decimal(0)
            for term in reversed(coefficients):
                total = total * t + term[place]
            return total

        last = None
        while now < Decimal(until):
            x, u = series()
            if s[gap] == 0 and v[gap + 1] < v[gap]:
                root = Decimal(0)
            else:
                root = _first_zero([term[gap] for term in x], step)
            h = step if root is None else root
            moved = sum(u[m][gap] * h ** (m + 1) / (m + 1) for m in range(_TERMS + 1))
            displacement += moved
            s = [at(x, i, h) for i in range(count - 1)]
            v = [at(u, i, h) for i in range(count)]
            now += h
            if root is None:
                continue
            s[gap] = Decimal(0)
            closing = v[gap] - v[gap + 1]
            exchanged = 2 * closing / (inverse[gap] + inverse[gap + 1])
            v[gap] -= exchanged * inverse[gap]
            v[gap + 1] += exchanged * inverse[gap + 1]
            origin = now if origin is None else origin
            times.append(float(now - origin))
            speeds.append(float(closing))
            last = list(s), list(v), displacement

        s, v, displacement = last
        chain = sum(v[i] / inverse[i] for i in range(first, count))
        opening = chain / sum(1 / inverse[i] for i in range(first, count))
        if inverse[0] != 0:
            target = sum(v[i] / inverse[i] for i in range(first))
            opening -= target / sum(1 / inverse[i] for i in range(first))
        places = [displacement]
        for i in range(first, count - 1):
            places.append(places[-1] + s[i])
        behind = [displacement]
        for i in range(gap - 1, -1, -1):
            behind.append(behind[-1] - s[i])
        return Sharp(
            float(opening),
            times,
            speeds,
            [float(each) for each in v],
            [float(each) for each in [*reversed(behind), *places]],
        )


def _first_zero(terms, step):
    """Return the first zero of a polynomial that starts positive or leaves 0 upward, or None."""

    def value(t):
        total = Decimal(0)
        for term in reversed(terms):
            total = total * t + term
        return total

    parts = 16
    for k in range(1, parts + 1):
        low, high = step * (k - 1) / parts, step * k / parts
        if value(high) < 0:
            while high - low > Decimal(10) ** (8 - DIGITS):
                middle = (low + high) / 2
                low, high = (low, middle) if value(middle) < 0 else (middle, high)
            return low
    return None
