"""Compute the error of LAMMPS's force along a table, as a fraction of the local force."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.table_rows import LEAST_ROWS
from chaincor.workflows.tables.lammps_curve import LammpsCurve, Style, TableData, lammps_curve
from chaincor.workflows.tables.neighbours import Neighbours

# Particles rarely reach energies higher than this many kT above the minimum.
THERMAL_ENERGIES = 10.0
# The local force at a point is the largest force in its neighbourhood, which extends by the
# fraction WINDOW of the range to both sides. The local force is at least LEAST_FORCE times the
# largest force in the range.
WINDOW = 0.05
LEAST_FORCE = 1e-3
_BINS = 200
# Errors are computed at up to _PLACES points between two rows, and at about _MOST_PLACES points in
# all.
_PLACES, _MOST_PLACES = 8, 400_000
# Contradictions are averaged over this many rows on both sides. The scatter is the maximum over the
# same rows.
_BESIDE = 3
# The mean of seven random errors rarely exceeds this multiple of the largest scatter.
_MEAN_OF_NOISE = 1.5
# In the _END_ROWS rows at each end, polynomials amplify noise by the factor _MOVED_AT_ENDS.
_END_ROWS, _MOVED_AT_ENDS = 2, 6.0
# Rounding scatters numbers by 0.29 units of the last digit. Numbers count as exact if their median
# scatter is smaller than this fraction of half a unit.
_EXACT = 0.05


def judged_range(table: TableData, thermal: float) -> tuple[float, float]:
    """
    Return the range in which the energy is less than 10 kT above its minimum.

    For pairs, energies up to the energy of the last row are also included. If the energy jumps at
    the cutoff, the last rows before the cutoff are excluded. The range has at least four rows.
    """
    end = last_row(table)
    if end < len(table.energies) - 1 and not table.is_bitmap:
        end = max(end - _BESIDE, LEAST_ROWS)
    energies, x = table.energies[: end + 1], table.lengths[: end + 1]
    height = THERMAL_ENERGIES * thermal
    reached = _reached(energies, height) if table.kind == "pair" else 0
    lowest = reached + int(np.argmin(energies[reached:]))
    limit = float(energies[lowest]) + height
    if table.kind == "pair":
        limit = max(limit, float(energies[-1]))
    if table.period:
        return float(x[0]), float(x[-1])
    inside = energies <= limit
    first = last = lowest
    while first > 0 and inside[first - 1]:
        first -= 1
    while last < len(x) - 1 and inside[last + 1]:
        last += 1
    first = min(first, max(last - 3, 0))
    last = max(last, min(first + 3, len(x) - 1))
    low, high = float(x[first]), float(x[last])
    if 0 < first <= lowest and not inside[first - 1]:
        low = _crossing(x, energies, first - 1, first, limit)
    if last < len(x) - 1 and not inside[last + 1]:
        high = _crossing(x, energies, last + 1, last, limit)
    return low, high


def _reached(energies: Array, height: float) -> int:
    """
    Return the innermost row that a pair reaches without climbing by more than `height`.

    Rows behind a higher barrier, for example placeholders near the origin, do not count for the
    minimum.
    """
    inwards = energies[::-1]
    limits = np.maximum(np.minimum.accumulate(inwards) + height, inwards[0])
    barriers = np.flatnonzero(inwards > limits)
    return len(energies) - int(barriers[0]) if len(barriers) else 0


def _crossing(x: Array, energies: Array, outside: int, inside: int, limit: float) -> float:
    part = (limit - energies[inside]) / (energies[outside] - energies[inside])
    return float(x[inside] + np.clip(part, 0.0, 1.0) * (x[outside] - x[inside]))


@dataclass(frozen=True)
class Errors:
    """Errors of the force along a range, as fractions of the local force."""

    at: Array  #: Lengths or angles at which the errors are computed.
    size: Array  #: Local force, in the unit of the file.
    #: Difference between LAMMPS's force and polynomials through neighbouring rows.
    interpolation: Array
    unsure: Array  #: Uncertainty of these polynomials.
    scatter: Array  #: Noise and rounding of the forces.
    contradiction: Array  #: Systematic difference between forces and -dE/dr.

    @cached_property
    def whole(self) -> Array:
        """Total error of the force at each place."""
        return np.maximum(self.interpolation + self.unsure, self.scatter) + self.contradiction

    @property
    def largest(self) -> float:
        """Largest total error."""
        return float(np.max(self.whole))

    @property
    def worst(self) -> float:
        """Length or angle with the largest total error."""
        return float(self.at[np.argmax(self.whole)])


@dataclass(frozen=True)
class Judge:
    """Table whose forces are judged within a range."""

    table: TableData
    digits: Array  #: Half a unit of the last digit in energies and forces, of shape (rows, 2).
    low: float  #: Lower end of the range.
    high: float  #: Upper end of the range.

    @cached_property
    def rows(self) -> Neighbours:
        """Rows up to the cutoff, without the zeros beyond it."""
        kept = slice(last_row(self.table) + 1)
        t = self.table
        short = replace(
            t, lengths=t.lengths[kept], energies=t.energies[kept], forces=t.forces[kept]
        )
        return Neighbours(short, self.digits[kept])

    def size_at(self, at: Array, low: float | None = None, high: float | None = None) -> Array:
        """Return the local force at each place, which is the largest force near it."""
        low, high = self.low if low is None else low, self.high if high is None else high
        x, _, forces, _ = self.rows.padded
        if not self.table.has_forces:
            forces = self.rows.by_energies(x, 8)
        edges = np.linspace(low, high, _BINS + 1)
        within = (x >= low) & (x <= high)
        ends = np.abs(np.interp(edges, x, forces))
        largest = np.maximum(ends[:-1], ends[1:])
        bins = np.clip(((x[within] - low) / (high - low) * _BINS).astype(int), 0, _BINS - 1)
        np.maximum.at(largest, bins, np.abs(forces[within]))
        reach = round(WINDOW * _BINS)
        around = np.lib.stride_tricks.sliding_window_view(
            np.pad(largest, reach, mode="edge"), 2 * reach + 1
        ).max(axis=1)
        around = np.maximum(around, LEAST_FORCE * float(np.max(largest)))
        where = np.clip(((at - low) / (high - low) * _BINS).astype(int), 0, _BINS - 1)
        result: Array = around[where]
        return np.where(result > 0.0, result, 1.0)

    @cached_property
    def differences(self) -> tuple[Array, Array]:
        """
        Differences between mean forces from energies and from forces, and their systematic part.

        Both arrays have the shape (rows - 1,) and the unit of force. The systematic part is the
        absolute mean over seven neighbours, in which noise averages out, minus the possible
        contributions from rounding, from the spacing of rows, and from noise.
        """
        if not self.table.has_forces:
            nothing = np.zeros(len(self.rows.padded[0]) - 1)
            return nothing, nothing
        by_energies, by_forces, room = self.rows.mean_forces()
        signed = np.nan_to_num(by_energies - by_forces)
        if np.ptp(self.table.energies) == 0.0:
            return signed, np.zeros(len(signed))
        width = 2 * _BESIDE + 1
        mean = np.abs(_windows(signed, width).mean(axis=1))

        noise = _MEAN_OF_NOISE * self._scatter_between()
        beyond = mean - _windows(np.minimum(room, 1e300), width).mean(axis=1) - noise
        return signed, np.clip(beyond, 0.0, None)

    def _scatter_between(self) -> Array:
        scatter = self.scatter
        return np.maximum(scatter[1:], scatter[:-1])

    @cached_property
    def scatter(self) -> Array:
        """Largest scatter or rounding of the forces around each row."""
        return self._largest_beside(self._own_scatter[0], self.rows.padded[3][:, 1])

    @cached_property
    def _own_scatter(self) -> tuple[Array, bool]:
        """Scatter of each force, and whether the forces have rounding errors."""
        if not self.table.has_forces:
            return np.zeros(len(self.rows.padded[0])), False
        own = np.nan_to_num(self.rows.scatter(), nan=0.0, posinf=0.0)
        # Numbers with few digits may be exact, and then have no rounding errors.
        is_rounded = np.median(own) > _EXACT * np.median(self.rows.padded[3][:, 1])
        return own, bool(is_rounded)

    def places(self, low: float, high: float) -> Array:
        """Return the places at which errors are computed: rows, and points between rows."""
        x = self.table.lengths
        inside = x[(x > low) & (x < high)]
        edges = np.concatenate([[low], inside, [high]])
        many = int(np.clip(_MOST_PLACES // len(edges), 1, _PLACES))
        parts = (np.arange(many) + 0.5) / many
        between = (edges[:-1, None] + np.diff(edges)[:, None] * parts).ravel()
        return np.sort(np.concatenate([edges, between]))

    def curve(self, style: Style, rows: int) -> LammpsCurve:
        """Return energy and force as LAMMPS interpolates them."""
        return lammps_curve(self.table, style, rows)

    def errors(
        self, style: Style, rows: int, low: float | None = None, high: float | None = None
    ) -> Errors:
        """Return the errors in a range, by default from `self.low` to `self.high`."""
        low, high = self.low if low is None else low, self.high if high is None else high
        at = self.places(low, high)
        size = self.size_at(at, low, high)
        x = self.rows.padded[0]
        between = np.clip(np.searchsorted(x, at, side="right") - 1, 0, len(x) - 2)
        _, systematic = self.differences
        contradiction = systematic[between] / size
        best, unsure = self.rows.forces_at(at, contradiction < 1e-3)
        with np.errstate(all="ignore"):
            missed = np.abs(self.curve(style, rows).force(at) - best)
        relative = self._relative_scatter(low, high)
        scatter = np.maximum(relative[between], relative[between + 1])
        # Noise also changes the polynomials, most strongly near the ends. The change is subtracted
        # here, so that noise counts only once.
        is_end = (between < _END_ROWS) | (between >= len(x) - 1 - _END_ROWS)
        moved = np.where(is_end & (self.table.period == 0.0), _MOVED_AT_ENDS, 1.0) * scatter
        missed, unsure = (
            np.clip(np.nan_to_num(part / size, nan=0.0, posinf=1e300) - moved, 0.0, None)
            for part in (missed, unsure)
        )
        return Errors(at, size, missed, unsure, scatter, contradiction)

    def _relative_scatter(self, low: float, high: float) -> Array:
        """
        Return the largest scatter around each row, as a fraction of the local force.

        At each row, the scatter is divided by the local force before the largest fraction is
        chosen. Otherwise a kink in the core would be compared with the smaller forces beside the
        core.
        """
        x, _, _, digits = self.rows.padded
        size = self.size_at(x, low, high)
        within = np.ones(len(x), dtype=bool)
        within[1:-1] = (x[2:] > low) & (x[:-2] < high)
        within[0], within[-1] = x[1] > low, x[-2] < high
        own = np.where(within, self._own_scatter[0], 0.0) / size
        found = self._largest_beside(own, digits[:, 1] / size)
        return np.nan_to_num(found, nan=0.0, posinf=1e300)

    def _largest_beside(self, own: Array, rounding: Array) -> Array:
        """Return the largest scatter around each row; for rounded forces, at least the rounding."""
        largest: Array = _windows(own, 2 * _BESIDE + 1).max(axis=1)
        return np.maximum(largest, rounding) if self._own_scatter[1] else largest


def last_row(table: TableData) -> int:
    """Return the index of the last row, for pairs without the zeros beyond the cutoff."""
    rows = np.flatnonzero((table.energies != 0.0) | (table.forces != 0.0))
    last = len(table.energies) - 1
    if table.kind != "pair" or not len(rows) or rows[-1] < LEAST_ROWS:
        return last
    return int(rows[-1])


def _windows(values: Array, width: int) -> Array:
    """Return `width` values around each value, of shape (values, width)."""
    padded = np.pad(values, width // 2, mode="reflect" if len(values) > width // 2 else "edge")
    return np.lib.stride_tricks.sliding_window_view(padded, width)
