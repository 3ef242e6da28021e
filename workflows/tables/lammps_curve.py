r"""
Define the data of a table, and interpolate its energy and force as LAMMPS does.

LAMMPS fits cubic splines to the energies and forces of the file. The slopes at the ends come from
``FP`` or from the two outer rows. LAMMPS then evaluates the splines at N points and interpolates
between these points. The points are uniform in r for bonds and angles, uniform over a full turn for
dihedrals, and uniform in r^2 for pairs. For pairs, F/r takes the place of F. Bitmaps are
interpolated without splines.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from chaincor.lammps_inputs.arrays import Array

TableKind = Literal["bond", "angle", "dihedral", "pair"]
Style = Literal["linear", "spline", "lookup", "bitmap"]
Function = Callable[[Array], Array]

# If the slope given for an end is larger than this, LAMMPS ignores the slope and sets the curvature
# at this end to zero.
_NO_SLOPE = 0.99e30
# Without FPRIME, LAMMPS computes the slopes of a pair's F/r at both ends from finite differences.
# Their width is this fraction of a bin.
_SECANT = 0.1


@dataclass(frozen=True)
class TableData:
    """Rows of a table as LAMMPS stores them, with increasing lengths."""

    kind: TableKind
    lengths: Array  #: Lengths or angles. For pairs, LAMMPS recomputes them from R, RSQ or BITMAP.
    energies: Array
    forces: Array  #: Forces, minus the slope of the energy; NaN in a dihedral table without forces.
    slopes: tuple[float, float] | None  #: dF/dr at both ends, from FP or FPRIME.
    is_bitmap: bool = False
    period: float = 0.0  #: Full turn of a dihedral, 360 or 2 pi; 0 for other kinds.

    @property
    def has_forces(self) -> bool:
        """Whether the file holds forces."""
        return not bool(np.isnan(self.forces[0]))


@dataclass(frozen=True)
class LammpsCurve:
    """Energy and force as functions of the length or angle."""

    energy: Function
    force: Function


def lammps_curve(table: TableData, style: Style, rows: int) -> LammpsCurve:
    """
    Return energy and force as LAMMPS interpolates them by `style` between `rows` points.

    Lengths have the unit of the file. Sources: ``bond_table.cpp``, ``angle_table.cpp``,
    ``dihedral_table.cpp`` and ``pair_table.cpp`` of LAMMPS.
    """
    if table.kind == "dihedral":
        return _dihedral(table, style, rows)
    if table.is_bitmap:
        return _bitmap(table)
    r, first, last = table.lengths, table.forces[0], table.forces[-1]
    energy = _spline(r, table.energies, -first, -last)
    slopes = table.slopes or _outer_slopes(r, table.forces)
    force = _spline(r, table.forces, *slopes)
    if table.kind == "pair":
        return _pair(table, style, rows, energy, force)
    nodes = np.linspace(r[0], r[-1], rows)
    energies, forces = energy(nodes), force(nodes)
    if style == "linear":
        return LammpsCurve(_lines(nodes, energies), _lines(nodes, forces))
    return LammpsCurve(
        _spline(nodes, energies, -forces[0], -forces[-1]), _spline(nodes, forces, *slopes)
    )


def _pair(
    table: TableData, style: Style, rows: int, energy: Function, force: Function
) -> LammpsCurve:
    r = table.lengths
    low, high = r[0] ** 2, r[-1] ** 2
    bin_width = (high - low) / (rows - 1)
    if style == "lookup":
        middle = np.sqrt(low + (np.arange(rows - 1) + 0.5) * bin_width)
        energies, over_r = energy(middle), force(middle) / middle

        def bin_of(at: Array) -> Array:
            return np.clip(((at * at - low) / bin_width).astype(int), 0, rows - 2)

        return LammpsCurve(lambda at: energies[bin_of(at)], lambda at: over_r[bin_of(at)] * at)
    nodes = low + np.arange(rows) * bin_width
    inside = np.clip(np.sqrt(nodes), r[0], r[-1])
    energies, forces = energy(inside), force(inside)
    over_r = forces / inside
    if style == "linear":
        energy_of, force_of = _lines(nodes, energies), _lines(nodes, over_r)
    else:
        inner, outer = float(inside[0]), float(inside[-1])
        if table.slopes is not None:
            ends = [
                (slope / at - value / at**2) / (2.0 * at)
                for slope, at, value in zip(
                    table.slopes, (inner, outer), (forces[0], forces[-1]), strict=True
                )
            ]
        else:
            step = _SECANT * bin_width
            near = np.sqrt(np.array([low + step, high - step]))
            beside = force(near) / near
            ends = [(beside[0] - over_r[0]) / step, (over_r[-1] - beside[1]) / step]
        energy_of = _spline(nodes, energies, -forces[0] / (2 * inner), -forces[-1] / (2 * outer))
        force_of = _spline(nodes, over_r, *ends)
    return LammpsCurve(lambda at: energy_of(at * at), lambda at: force_of(at * at) * at)


def _bitmap(table: TableData) -> LammpsCurve:
    """Interpolate F/r linearly in r^2. The last bin has the slope of the previous bin."""
    nodes, over_r = table.lengths**2, table.forces / table.lengths

    def between(values: Array) -> Function:
        # LAMMPS stores all values of r^2 in single precision.
        def value(at: Array) -> Array:
            q = (at * at).astype(np.float32).astype(float)
            k = np.clip(np.searchsorted(nodes, q, side="right") - 1, 0, len(nodes) - 1)
            step = np.minimum(k, len(nodes) - 2)
            slope = (values[step + 1] - values[step]) / (nodes[step + 1] - nodes[step])
            result: Array = values[k] + slope * (q - nodes[k])
            return result

        return value

    energy_of, force_of = between(table.energies), between(over_r)
    return LammpsCurve(energy_of, lambda at: force_of(at) * at)


def _dihedral(table: TableData, style: Style, rows: int) -> LammpsCurve:
    period = table.period
    phi = table.lengths - period * np.floor(table.lengths / period)
    order = np.argsort(phi, kind="stable")
    phi, energies, forces = (x[order] for x in (phi, table.energies, table.forces))
    cyclic = _cyclic_lines if style == "linear" else _cyclic_spline
    nodes: Array = np.arange(float(rows)) * (period / rows)
    energy_of = cyclic(nodes, sampled := cyclic(phi, energies, period)(nodes), period)
    if table.has_forces:
        return LammpsCurve(energy_of, cyclic(nodes, cyclic(phi, forces, period)(nodes), period))
    if style == "linear":
        slopes = (np.roll(sampled, -1) - np.roll(sampled, 1)) / (2.0 * period / rows)
        return LammpsCurve(energy_of, cyclic(nodes, -slopes, period))
    spline = _periodic_spline(nodes, sampled, period)
    return LammpsCurve(energy_of, lambda at: -spline(at, 1))


def bitmap_lengths(low: float, high: float, bits: int) -> Array:
    """
    Return the distances that LAMMPS assigns to the rows of a BITMAP table, in file order.

    The bits of the row index are the lower exponent bits and upper mantissa bits of a
    single-precision r^2. Raise ValueError for too few or too many bits.
    """
    low2, high2 = np.float32(low * low), np.float32(high * high)
    exponent = int(np.floor(np.log2(low * low)))
    exponent_bits = 0
    while 2.0 ** (2**exponent_bits) < high * high / 2.0**exponent:
        exponent_bits += 1
    shift = 23 - (bits - exponent_bits)
    if bits - exponent_bits < 3 or shift < 0:
        raise ValueError("too few or too many bits")
    mask = (1 << (bits + shift)) - 1
    mask_high = int(high2.view(np.int32)) & ~mask
    mask_low = int(low2.view(np.int32)) & ~mask
    rows = np.arange(1 << bits, dtype=np.int64) << shift
    squares = (rows | mask_low).astype(np.int32).view(np.float32)
    upper = (rows | mask_high).astype(np.int32).view(np.float32)
    squares = np.where(squares < low * low, upper, squares)
    return np.sqrt(squares.astype(np.float32)).astype(float)


def _outer_slopes(r: Array, forces: Array) -> tuple[float, float]:
    return (
        float((forces[1] - forces[0]) / (r[1] - r[0])),
        float((forces[-1] - forces[-2]) / (r[-1] - r[-2])),
    )


def _lines(x: Array, y: Array) -> Function:
    return lambda at: np.interp(at, x, y)


def _spline(x: Array, y: Array, low: float, high: float) -> Function:
    from scipy.interpolate import CubicSpline

    ends = [(2, 0.0) if slope > _NO_SLOPE else (1, slope) for slope in (low, high)]
    spline = CubicSpline(x, y, bc_type=tuple(ends))
    return lambda at: spline(at)


def _cyclic_lines(x: Array, y: Array, period: float) -> Function:
    return lambda at: np.interp(at, x, y, period=period)


def _periodic_spline(x: Array, y: Array, period: float) -> Callable[..., Array]:
    from scipy.interpolate import CubicSpline

    spline: Callable[..., Array] = CubicSpline(
        np.append(x, x[0] + period), np.append(y, y[0]), bc_type="periodic"
    )
    return spline


def _cyclic_spline(x: Array, y: Array, period: float) -> Function:
    spline = _periodic_spline(x, y, period)
    return lambda at: spline(at)
