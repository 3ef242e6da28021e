"""Check bonds without a known formula for kinks, jumps and a wrong energy."""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import PotentialError

if TYPE_CHECKING:
    from chaincor.lammps_inputs.bonds.potential import Potential

# Range of the checked strains: from almost zero length to a thousand natural lengths. Near the
# natural length, their spacing is fine enough for impact speeds down to 1e-4.
_SMALLEST, _SHORTEST, _LONGEST = 1e-4, -0.95, 1e3
_COMPRESSED, _STRETCHED = 200, 300
# The brackets of possible kinks are halved until their width is _NARROW times the strain, or
# _NARROWEST near the natural length.
_NARROW, _NARROWEST = 1e-8, 1e-9
# Least relative change of the slope at a kink, within the narrowest bracket. Rounding (eps F/1e-9)
# changes the slope by only about 1e-7. In a bracket four times as wide, the change at a kink grows
# by less than the factor `_SAME`. The change of a smooth curve grows by a factor of four.
_KINK, _SAME = 1e-4, 2.0
# Rounding changes a sum of four forces by at most this number times epsilon times the largest term
# in the force.
_ROUNDINGS = 64.0
# The force jumps if it changes by more than this factor times the change that its slopes explain.
_JUMP = 4.0
# Allowed relative difference between a decrease of the energy and the work of the force. A user's
# constants may have only seven digits. The difference does not change eta, which depends only on
# the force.
_WORK = 1e-6
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


def scan_strains(bond: "Potential") -> Array:
    """Return increasing strains for checks of a bond, geometrically spaced on each side of 0."""
    low, high = max(bond.strain_min, _SHORTEST), min(bond.strain_max, _LONGEST)
    nearest = min(_SMALLEST, 1e-2 * -low, 1e-2 * high)
    return np.concatenate(
        (-np.geomspace(-low, nearest, _COMPRESSED), np.geomspace(nearest, high, _STRETCHED))
    )


def find_kinks(bond: "Potential") -> tuple[float, ...]:
    """
    Return the strains at which the stiffness of a bond jumps, in increasing order.

    Overlapping brackets are halved about their largest second difference, down to 1e-8 of the
    strain. If the slope still changes in the final bracket, there is a kink. Two kinks are both
    found if their distance is more than 1e-2 of the strain. Otherwise only the sharper one may be
    found.

    Raises PotentialError if the force itself jumps.
    """
    edges = scan_strains(bond)
    scale = _slope_at_rest(bond, edges)
    low, high = edges[:-2].copy(), edges[2:].copy()
    rows = np.arange(len(low))
    quarters = np.arange(5) / 4.0
    with np.errstate(all="ignore"):
        for _ in range(60):
            width = high - low
            narrow = 4.0 * np.maximum(_NARROW * np.maximum(abs(low), abs(high)), _NARROWEST)
            wide = width > narrow
            if not wide.any():
                break
            points = low[wide, None] + width[wide, None] * quarters
            bends = np.abs(np.diff(_forces(bond, points), 2, axis=1))
            middle = 1 + np.argmax(np.where(np.isfinite(bends), bends, -1.0), axis=1)
            centre = points[rows[: len(points)], middle]
            low[wide] = centre - 0.25 * width[wide]
            high[wide] = centre + 0.25 * width[wide]
        middles = 0.5 * (low + high)
        near = np.maximum(_NARROW * np.abs(middles), _NARROWEST)
        below, above, left, right = _beside(bond, middles, near)
        change, larger = right - left, np.maximum(np.abs(left), np.abs(right))
        *_, further_left, further_right = _beside(bond, middles, 4.0 * near)
        further = further_right - further_left
        _refuse_jumps(bond, middles, near, (below, above), np.maximum(larger, scale))
        # size of the terms that cancel in a small force
        size = np.abs(below) + scale * np.abs(middles)
        kinked = np.abs(change) > _KINK * np.maximum(larger, _SMALLEST * scale)
        kinked &= np.abs(change) > _ROUNDINGS * sys.float_info.epsilon * size / near
        kinked &= np.abs(further) < _SAME * np.abs(change)
        # The tangents on both sides of a kink intersect at the kink.
        met = middles + (above - below - near * (left + right)) / (left - right)
    places: list[float] = []
    for k in np.flatnonzero(kinked).tolist():
        if not abs(met[k] - middles[k]) <= 4.0 * near[k]:
            continue
        place = round(float(met[k]), 9)
        place = place if abs(place - met[k]) <= 0.1 * near[k] else float(met[k])
        if not places or place - places[-1] > 20.0 * near[k]:
            places.append(place + 0.0)
    return tuple(places)


def _slope_at_rest(bond: "Potential", edges: Array) -> float:
    """Return the larger slope of the force on the two sides of the natural length."""
    near = edges[[_COMPRESSED - 1, _COMPRESSED]]
    return float(np.max(np.abs(bond.force(near) / near)))


def _forces(bond: "Potential", strains: Array) -> Array:
    return np.asarray(bond.force(strains.ravel()), dtype=float).reshape(strains.shape)


def _beside(bond: "Potential", middles: Array, near: Array) -> tuple[Array, ...]:
    """Return the forces and their slopes slightly below and slightly above some strains."""
    places = middles[:, None] + near[:, None] * np.array([-3.0, -1.0, 1.0, 3.0])
    far_left, left, right, far_right = _forces(bond, places).T
    return left, right, (left - far_left) / (2.0 * near), (far_right - right) / (2.0 * near)


def _refuse_jumps(
    bond: "Potential", middles: Array, near: Array, forces: tuple[Array, Array], slope: Array
) -> None:
    before, after = forces
    jump = np.abs(after - before)
    explained = _JUMP * 2.0 * near * slope
    noise = 1e2 * sys.float_info.epsilon * np.maximum(np.abs(before), slope)
    excess = np.where(np.isfinite(jump), jump - explained - noise, -np.inf)
    worst = int(np.argmax(excess))
    if excess[worst] > 0.0:
        raise PotentialError(
            f"the force of bond '{bond.name}' jumps by {jump[worst]:.3g} at strain "
            f"{middles[worst]:.6g}. Join the two parts of the force, for example by a short "
            "steep line"
        )


def refuse_mismatch(bond: "Potential", kinks: Sequence[float]) -> None:
    """
    Refuse a bond whose force is not the derivative of its energy.

    The force is integrated between neighbouring strains of :func:`scan_strains` by Gauss quadrature
    with 8 points. The resulting work must equal the decrease of the energy. The quadrature error is
    estimated from halved intervals, and the rounding error from the size of the energies. Raises
    PotentialError with the strain at which work and decrease differ most.
    """
    # Intervals end at kinks, because Gauss quadrature requires a smooth force.
    edges = np.unique(np.concatenate((scan_strains(bond), kinks)))
    with np.errstate(all="ignore"):
        energies = np.asarray(bond.energy(edges), dtype=float)
        low, high = edges[:-1], edges[1:]
        middle = 0.5 * (low + high)
        whole, size = _work(bond, low, high)
        halves = _work(bond, low, middle)[0] + _work(bond, middle, high)[0]
        mismatch = np.abs(energies[:-1] - energies[1:] - halves)
        rounding = 64.0 * sys.float_info.epsilon
        # Terms that cancel in a small energy are as large as stiffness times length squared, or as
        # the constant in the energy.
        size_at_rest = _slope_at_rest(bond, scan_strains(bond)) + abs(bond.energy_offset)
        rounding *= np.abs(energies[:-1]) + np.abs(energies[1:]) + size_at_rest
        allowed = _WORK * size + 4.0 * np.abs(halves - whole) + rounding
        excess = mismatch / np.maximum(allowed, sys.float_info.min)
    known = np.isfinite(excess)
    if not known.any():
        raise PotentialError(
            f"bond '{bond.name}' has no finite energy and force anywhere near length 1. "
            "Write both as functions of the strain r - 1"
        )
    # the message gives a strain that bonds reach in practice, if possible
    usual = known & (excess > 1.0) & (np.abs(middle) < 1.0)
    worst = int(np.argmax(np.where(usual if usual.any() else known, excess, -1.0)))
    if excess[worst] > 1.0:
        work = float(halves[worst] / (high[worst] - low[worst]))
        slope = float((energies[worst] - energies[worst + 1]) / (high[worst] - low[worst]))
        if abs(work + slope) < 0.01 * abs(slope):
            raise PotentialError(
                f"the force of bond '{bond.name}' has the wrong sign near strain "
                f"{middle[worst]:.6g}: it is {work:.6g}, and -dU/dr is {slope:.6g}. Return -dU/dr, "
                "the negative slope of the energy"
            )
        raise PotentialError(
            f"energy and force of bond '{bond.name}' contradict each other: near strain "
            f"{middle[worst]:.6g} the force is {work:.6g}, but -dU/dr is {slope:.6g}. "
            "Return -dU/dr as the force. If the formula ends at some strain, give "
            "strain_min and strain_max"
        )


def _work(bond: "Potential", low: Array, high: Array) -> tuple[Array, Array]:
    """Return the integrals of the force and of its absolute value over each interval."""
    half = 0.5 * (high - low)
    forces = _forces(bond, 0.5 * (low + high)[:, None] + half[:, None] * _NODES)
    return half * (forces @ _WEIGHTS), half * (np.abs(forces) @ _WEIGHTS)
