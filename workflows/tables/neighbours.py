"""Estimate forces and their scatter by polynomials through neighbouring rows."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from chaincor.lammps_inputs.arrays import Array, Indices, Mask
from chaincor.workflows.tables.lammps_curve import TableData

# Numbers of rows that polynomials interpolate, in order of decreasing accuracy: _OF_FORCES for
# polynomials through forces alone, and _OF_BOTH for polynomials through energies and forces.
_OF_FORCES = (8, 6, 4)
_OF_BOTH = (4, 3, 2)
_EPSILON = 2.0**-52


def newton(z: Array, y: Array, slopes: Array | None) -> Array:
    """
    Return the Newton coefficients (divided differences) of polynomials through values y at z.

    All arrays have the shape (polynomials, nodes). If two neighbouring nodes are equal, `slopes`
    replaces the difference quotient.
    """
    c = y.copy()
    found = [c[:, :1]]
    for level in range(1, z.shape[1]):
        gaps = z[:, level:] - z[:, :-level]
        with np.errstate(divide="ignore", invalid="ignore"):
            c = np.diff(c, axis=1) / gaps
        if level == 1 and slopes is not None:
            c = np.where(gaps == 0.0, slopes[:, :-1], c)
        found.append(c[:, :1])
    return np.concatenate(found, axis=1)


def horner(z: Array, c: Array, at: Array) -> tuple[Array, Array]:
    """Return the value and the slope of each Newton polynomial at its place in `at`."""
    value, slope = c[:, -1], np.zeros(len(at))
    for j in range(c.shape[1] - 2, -1, -1):
        gap = at - z[:, j]
        slope = slope * gap + value
        value = value * gap + c[:, j]
    return value, slope


@dataclass(frozen=True)
class Neighbours:
    """Rows of a table, and polynomials through neighbouring rows."""

    table: TableData
    digits: Array  #: Half a unit of the last digit in energies and forces, of shape (rows, 2).

    @cached_property
    def padded(self) -> tuple[Array, Array, Array, Array]:
        """Lengths, energies, forces and rounding, continued periodically for dihedrals."""
        t = self.table
        if not t.period:
            return t.lengths, t.energies, t.forces, self.digits
        pad = min(_OF_FORCES[0], len(t.lengths))
        x = np.concatenate([t.lengths[-pad:] - t.period, t.lengths, t.lengths[:pad] + t.period])
        rest = (
            np.concatenate([column[-pad:], column, column[:pad]])
            for column in (t.energies, t.forces, self.digits)
        )
        energies, forces, digits = rest
        return x, energies, forces, digits

    def first_of(self, at: Array, count: int) -> Indices:
        """Return the index of the first row among the `count` rows around each place."""
        x = self.padded[0]
        k = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
        return np.clip(k - (count // 2 - 1), 0, max(len(x) - count, 0))

    def by_forces(self, at: Array, count: int) -> Array:
        """Return the force at each place, from polynomials through the forces of `count` rows."""
        x, _, forces, _ = self.padded
        count = min(count, len(x))
        rows = np.arange(len(x) - count + 1)[:, None] + np.arange(count)
        first = self.first_of(at, count)
        c = newton(x[rows], forces[rows], None)
        return horner(x[rows][first], c[first], at)[0]

    def by_both(self, at: Array, count: int) -> Array:
        """Return -dE/dr at each place, from polynomials through both columns of `count` rows."""
        x, energies, forces, _ = self.padded
        count = min(count, len(x))
        rows = np.arange(len(x) - count + 1)[:, None] + np.arange(count).repeat(2)
        first = self.first_of(at, count)
        c = newton(x[rows], energies[rows], -forces[rows])
        return -horner(x[rows][first], c[first], at)[1]

    def by_energies(self, at: Array, count: int) -> Array:
        """Return -dE/dr at each place, from polynomials through the energies of `count` rows."""
        x, energies, _, _ = self.padded
        count = min(count, len(x))
        rows = np.arange(len(x) - count + 1)[:, None] + np.arange(count)
        first = self.first_of(at, count)
        c = newton(x[rows], energies[rows], None)
        return -horner(x[rows][first], c[first], at)[1]

    def forces_at(self, at: Array, trusted: Mask) -> tuple[Array, Array]:
        """
        Return the force at each place, and its difference between two polynomial degrees.

        `trusted` marks the places at which the energies may be used besides the forces.
        """
        with np.errstate(all="ignore"):
            if not self.table.has_forces:
                fine, coarse = (self.by_energies(at, n) for n in (8, 6))
                return fine, np.abs(fine - coarse)
            fine, coarse = (self.by_forces(at, n) for n in _OF_FORCES[:2])
            both, fewer = (self.by_both(at, n) for n in _OF_BOTH[:2])
            x, _, _, digits = self.padded
            first = self.first_of(at, 2)
            rounding = 4.0 * np.maximum(digits[first, 0], digits[first + 1, 0])
            rounding = rounding / (x[first + 1] - x[first])
            unsure, of_both = np.abs(fine - coarse), np.abs(both - fewer) + rounding
        better = trusted & (of_both < unsure)
        return np.where(better, both, fine), np.where(better, of_both, unsure)

    def mean_forces(self) -> tuple[Array, Array, Array]:
        """
        Return mean forces between rows, from energies and from forces, and an allowed difference.

        Each array has the shape (rows - 1,). The allowed difference is the sum of rounding errors
        and of differences between polynomial degrees.
        """
        x, energies, _, digits = self.padded
        places, weights = np.polynomial.legendre.leggauss(4)
        h = np.diff(x)
        at = x[:-1, None] + h[:, None] * (0.5 + 0.5 * places)
        with np.errstate(all="ignore"):
            means = [
                (self.by_forces(at.ravel(), n).reshape(at.shape) * weights).sum(axis=1) / 2.0
                for n in _OF_FORCES
            ]
            by_energies = -np.diff(energies) / h
            size = np.maximum(np.abs(energies[1:]), np.abs(energies[:-1]))
            room = (digits[1:, 0] + digits[:-1, 0] + 8.0 * _EPSILON * size) / h
        room += np.maximum(digits[1:, 1], digits[:-1, 1])
        room += np.abs(means[0] - means[1]) + 0.1 * np.abs(means[1] - means[2])
        return by_energies, means[0], np.nan_to_num(room, nan=np.inf)

    @np.errstate(all="ignore")
    def scatter(self) -> Array:
        """
        Return how far each force deviates from the neighbouring rows, of shape (rows,).

        If the errors of the forces are independent, the result estimates their standard deviation.
        """
        x, _, forces, _ = self.padded
        by_forces, share = self.left_out(6)
        scatter = np.abs(forces - by_forces) / share
        if len(x) >= 5:
            # Each force is compared with a polynomial through five energies and four other forces.
            rows = np.clip(np.arange(len(x))[:, None] - 2, 0, len(x) - 5) + np.arange(5)
            middle = np.arange(len(x))[:, None] - rows[:, :1]
            scatter = np.minimum(scatter, self._by_four(rows, middle[:, 0]))
        return scatter

    @np.errstate(all="ignore")
    def _by_four(self, rows: Indices, middle: Indices) -> Array:
        """
        Return how far each force deviates from a polynomial through five energies and four forces.

        `middle` is the position of the row in question among the five `rows`.
        """
        x, energies, forces, _ = self.padded
        result = np.full(len(x), np.inf)
        for k in range(5):
            mine = middle == k
            if not np.any(mine):
                continue
            order = [k, *(j for j in range(5) if j != k for _ in (0, 1))]
            picked = rows[mine][:, order]
            with np.errstate(all="ignore"):
                c = newton(x[picked], energies[picked], -forces[picked])
                said = -horner(x[picked], c, x[mine.nonzero()[0]])[1]
            result[mine] = np.abs(forces[mine] - said) / _SHARE[k]
        return result

    @np.errstate(all="ignore")
    def left_out(self, count: int) -> tuple[Array, Array]:
        """Predict each force from `count` neighbours, and return the amplification of errors."""
        x, _, forces, _ = self.padded
        count = min(count, len(x) - 1)
        n = len(x)
        rows = np.clip(np.arange(n)[:, None] - count // 2, 0, n - count - 1)
        rows = rows + np.arange(count + 1)
        others = rows[rows != np.arange(n)[:, None]].reshape(n, count)
        nodes = x[others]
        weights = np.ones((n, count))
        for j in range(count):
            for k in range(count):
                if k != j:
                    weights[:, j] *= (x - nodes[:, k]) / (nodes[:, j] - nodes[:, k])
        said = (weights * forces[others]).sum(axis=1)
        return said, np.sqrt(1.0 + (weights**2).sum(axis=1))


def _shares() -> list[float]:
    """Return the amplification of errors in `_by_four` for each omitted row, for equal spacing."""
    found = []
    x = np.arange(5.0)
    for k in range(5):
        order = [k, *(j for j in range(5) if j != k for _ in (0, 1))]
        total = 1.0
        for j in range(5):
            if j != k:
                forces = (x == j).astype(float)
                z = x[order][None]
                c = newton(z, np.zeros((1, 9)), -forces[order][None])
                total += float(horner(z, c, x[k : k + 1])[1][0]) ** 2
        found.append(math.sqrt(total))
    return found


_SHARE = _shares()
