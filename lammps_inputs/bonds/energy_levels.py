"""Where a bond holds an energy: U(s) = energy solved for the strain, on either side of rest."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array

if TYPE_CHECKING:
    from chaincor.lammps_inputs.bonds.potential import Potential


# Strains of one scan, of which two narrow a range down to less than a thousandth.
_GRID = 64


def halved(holds: Callable[[float], bool], inside: float, outside: float) -> tuple[float, float]:
    """Return the neighbouring numbers between which a condition ceases to hold, by halving."""
    # SciPy's root finders need fewer steps, and take longer to load than a run takes.
    while (middle := 0.5 * (inside + outside)) not in (inside, outside):
        inside, outside = (middle, outside) if holds(middle) else (inside, middle)
    return inside, outside


def holds_at_most(
    bond: "Potential", energy: float, side: float
) -> Callable[[Array], NDArray[np.bool_]]:
    """Return whether a bond holds no more than an energy, of distances from rest to one side."""

    def holds(distances: Array) -> NDArray[np.bool_]:
        with np.errstate(all="ignore"):
            return np.asarray(bond.energy(side * distances), dtype=float) <= energy

    return holds


def distance_at(bond: "Potential", energy: float, side: float, end: float = math.inf) -> float:
    """
    Return how far from rest a bond first holds an energy, to the last bit.

    `side` is -1 for compressed bonds, 1 for stretched ones; `end` is returned where the bond holds
    less up to there.
    """
    holds = holds_at_most(bond, energy, side)
    far = math.sqrt(2.0 * energy / bond.stiffness) * np.geomspace(1e-3, 1e9, 4000)
    far = np.append(far[far < end], end) if end < far[-1] else far
    above = ~holds(far)
    if not np.any(above):
        return end
    first = int(np.argmax(above))
    inner = float(far[first - 1]) if first else 0.0
    return halved(lambda distance: bool(holds(np.array(distance))), inner, float(far[first]))[0]


def compressed_strain(bond: "Potential", energy: float) -> float:
    """
    Return the compressed strain, below zero, at which a bond holds an energy.

    It stops short of -1, where particles would meet, if the bond cannot hold it.
    """
    return float(compressed_strains(bond, np.array([energy]))[0])


def compressed_strains(bond: "Potential", energies: Array) -> Array:
    """Return the same for many energies, of the shape (energies,); each as by itself."""
    floor = max(bond.strain_min, -1.0)
    # Distance to the floor, found by its logarithm: log bonds get as short as exp(-energy).
    low, high = np.full(len(energies), -700.0), np.zeros(len(energies))
    for _ in range(60):
        middle = 0.5 * (low + high)
        strains = floor * -_expm1(middle)
        with np.errstate(all="ignore"):
            held = np.broadcast_to(bond.energy(strains), strains.shape)
        beyond = (held > energies) | ~np.isfinite(held)
        low, high = np.where(beyond, middle, low), np.where(beyond, high, middle)
    return floor * -_expm1(high)


def _expm1(exponents: Array) -> Array:
    # NumPy's own rounds otherwise than that of the system, by which numbers have been found so far.
    return np.array([math.expm1(exponent) for exponent in exponents.tolist()])


def strain_range(bond: "Potential", energy: float) -> tuple[float, float]:
    """
    Return the strains between which a bond must be if it holds no more than an energy.

    They are rounded outward by less than a thousandth; inf where the energy suffices to break the
    bond.
    """
    shortest = -_outermost(bond, energy, -1.0, -bond.strain_min)
    if energy >= bond.dissociation:
        return shortest, math.inf
    return shortest, min(_outermost(bond, energy, 1.0, bond.strain_max), bond.strain_max)


def _outermost(bond: "Potential", energy: float, side: float, end: float) -> float:
    """Return roughly, by a few calls, where U first exceeds an energy."""
    holds = holds_at_most(bond, energy, side)
    inner, outer = 0.0, 1e-3 * math.sqrt(2.0 * energy / bond.stiffness)
    for _ in range(_GRID):
        if outer >= end:
            outer = end
            break
        if not holds(np.array(outer)):
            break
        inner, outer = outer, 2.0 * outer
    for _ in range(2):
        distances = np.linspace(inner, outer, _GRID)
        above = ~holds(distances)
        above[-1] = True
        first = int(np.argmax(above))
        inner, outer = float(distances[max(first - 1, 0)]), float(distances[first])
    return outer
