r"""
Draw bond lengths in equilibrium from the density :math:`\exp(-U(s)/T)`.

The bond lengths of a free chain are independent in equilibrium, because only neighbours have bonds.
Each bond is therefore drawn separately, without a Markov chain.

If a bond can break, its density does not vanish at infinite length. Only bound states of such a
bond are drawn. They end at the energy barrier, or without a barrier at :math:`U = D - T`, because
thermal energy breaks bonds of higher energy. A temperature is refused if the density at the end of
the bound states is not small, because bound states then have no meaning.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache, wraps
from typing import Any, TypeVar

import numpy as np
from numpy.polynomial import legendre

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import SceneError

# The energy that breaks a bond must be at least this many times T. The density at the end of the
# bound states is then below 1e-3 of the density at the natural length: exp(-8), or exp(-7) if the
# bound states end at D - T.
LEAST_DEPTH = 8.0
# Densities below exp(-50) = 2e-22 are omitted. The smallest probability that is drawn is 2^-54 =
# 6e-17.
_REACH = 50.0
# The density is integrated over panels of _POINTS Gauss points. A panel is halved until the last
# terms of its Legendre series are below _RESOLVED times the whole integral. The rounding error of
# the density is about 1e-16.
_POINTS = 16
_RESOLVED = 4e-15
_FIRST_PANELS = 24
_MOST_HALVINGS = 40
_MOST_PANELS = 20_000
# Largest fraction of the integral that may stay unresolved because the energy has small jumps or
# noise.
_UNRESOLVED = 1e-10
# Largest rounding error of an energy with a subtracted constant, as a fraction of T.
_NOISE = 1e-8
# Newton's method ends when its step is below this size, in units of half a panel. Further steps
# would consist of rounding errors.
_CLOSE = 1e-14
_AT_ONCE = 16_384

_NODES, _WEIGHTS = legendre.leggauss(_POINTS)
# Matrix that computes Legendre coefficients from values at the nodes.
_TO_SERIES = (
    (np.arange(_POINTS) + 0.5)[:, np.newaxis] * _WEIGHTS * legendre.legvander(_NODES, _POINTS - 1).T
)


_Found = TypeVar("_Found")


@dataclass(frozen=True, eq=False)
class BondDistribution:
    r"""
    Equilibrium distribution of the strain of one bond.

    The density is a polynomial of degree 15 in each of several panels. See
    :func:`bond_distribution`.
    """

    #: Edges of the panels, of shape (P + 1,). The density is zero beyond the first and the last
    #: edge.
    edges: Array
    #: Legendre coefficients of the density in each panel, times half the panel width; of shape (16,
    #: P).
    densities: Array
    shares: Array  #: Cumulative probability at each edge, from 0 to 1; of shape (P + 1,).

    @cached_property
    def _integrals(self) -> Array:
        return np.asarray(legendre.legint(self.densities, lbnd=-1), dtype=float)

    @cached_property
    def _nodes(self) -> tuple[Array, Array]:
        """Strains and weights of the quadrature from which averages are computed."""
        half = 0.5 * np.diff(self.edges)[:, np.newaxis]
        middles = 0.5 * (self.edges[1:] + self.edges[:-1])[:, np.newaxis]
        values = legendre.legval(_NODES, self.densities)
        weights = values * _WEIGHTS
        return (middles + half * _NODES).ravel(), (weights / np.sum(weights)).ravel()

    @cached_property
    def mean(self) -> float:
        """Mean strain."""
        strains, weights = self._nodes
        return float(np.sum(weights * strains))

    @cached_property
    def variance(self) -> float:
        """Variance of the strain."""
        strains, weights = self._nodes
        return float(np.sum(weights * (strains - self.mean) ** 2))

    def log_moment(self, slopes: Array) -> Array:
        r"""Return :math:`\ln\langle e^{\lambda (s - \langle s\rangle)}\rangle` for each lambda."""
        strains, weights = self._nodes
        powers = np.multiply.outer(slopes, strains - self.mean)
        largest = np.max(powers, axis=-1)
        found = np.log(np.sum(weights * np.exp(powers - largest[..., np.newaxis]), axis=-1))
        return found + largest

    def share_below(self, strains: Array) -> Array:
        """Return the cumulative probability at each strain."""
        s = np.clip(strains, self.edges[0], self.edges[-1])
        panel = np.clip(np.searchsorted(self.edges, s, side="right") - 1, 0, len(self.edges) - 2)
        low, high = self.edges[panel], self.edges[panel + 1]
        x = (2.0 * s - low - high) / (high - low)
        return self.shares[panel] + legendre.legval(x, self._integrals[:, panel], tensor=False)

    def strains(self, shares: Array) -> Array:
        """
        Return the strains with given cumulative probabilities, to 1e-15.

        Each strain is computed separately and does not depend on the other probabilities.
        """
        wanted = np.asarray(shares, dtype=float).ravel()
        found = np.empty_like(wanted)
        for begin in range(0, len(wanted), _AT_ONCE):
            part = slice(begin, begin + _AT_ONCE)
            found[part] = self._invert(wanted[part])
        return found.reshape(np.shape(shares))

    def _invert(self, shares: Array) -> Array:
        """Find the positions in panels by Newton's method within bounds."""
        panel = np.searchsorted(self.shares, shares, side="right") - 1
        panel = np.clip(panel, 0, len(self.edges) - 2)
        inside = shares - self.shares[panel]
        x = np.clip(2.0 * inside / np.diff(self.shares)[panel] - 1.0, -1.0, 1.0)
        low, high = np.full_like(x, -1.0), np.full_like(x, 1.0)
        left = np.arange(len(x))
        for _ in range(100):
            here = x[left]
            series = panel[left]
            excess = legendre.legval(here, self._integrals[:, series], tensor=False) - inside[left]
            slope = legendre.legval(here, self.densities[:, series], tensor=False)
            low[left] = np.where(excess < 0.0, here, low[left])
            high[left] = np.where(excess > 0.0, here, high[left])
            with np.errstate(all="ignore"):
                step = here - excess / slope
            within = (step >= low[left]) & (step <= high[left])
            x[left] = np.where(within, step, 0.5 * (low[left] + high[left]))
            left = left[np.abs(x[left] - here) > _CLOSE]
            if not len(left):
                break
        begin, end = self.edges[panel], self.edges[panel + 1]
        return np.clip(0.5 * (begin + end) + 0.5 * (end - begin) * x, begin, end)


def kept_by_bond(find: Callable[..., _Found]) -> Callable[..., _Found]:
    """Cache the results of a function whose first argument is a bond, if it is hashable."""
    kept = lru_cache(maxsize=64)(find)

    @wraps(find)
    def found(bond: Potential, *others: Any) -> _Found:
        try:
            hash(bond)
        except TypeError:
            return find(bond, *others)
        return kept(bond, *others)

    return found


@kept_by_bond
def bond_distribution(bond: Potential, temperature: float) -> BondDistribution:
    r"""
    Return the equilibrium distribution of a bond's strain; the temperature is :math:`k_B T`.

    The density is :math:`\propto \exp(-U(s)/T)` for all strains, or for those of bound states.
    Raises SceneError if the bond has no force in tension, or breaks at an energy below
    `LEAST_DEPTH` times T.
    """
    low, high = _ends(bond, temperature)
    edges = np.linspace(low, high, _FIRST_PANELS + 1)
    inner = [kink for kink in (0.0, *bond.kinks) if low < kink < high]
    edges = np.unique(np.concatenate((edges, inner)))
    begins, ends = edges[:-1], edges[1:]
    noise = 8.0 * np.finfo(float).eps * abs(bond.energy_offset) / temperature
    kept: list[tuple[Array, Array, Array]] = []
    whole = count = 0.0
    for halving in range(_MOST_HALVINGS + 1):
        series = _series(bond, temperature, begins, ends)
        total = whole + 2.0 * float(np.sum(series[0]))
        tails = np.max(np.abs(series[-3:]), axis=0)
        done = tails <= (_RESOLVED + noise) * total
        full = count + 2 * len(begins) > _MOST_PANELS or halving == _MOST_HALVINGS
        if noise > _NOISE or (full and np.sum(tails[~done]) > _UNRESOLVED * total):
            raise SceneError(
                f"temperature is {temperature:g}: exp(-U/T) of the {bond.name} bond cannot be "
                "integrated, because its energy is not smooth or is rounded to more than T. "
                "Give a smooth energy or a higher temperature"
            )
        if full:
            done[:] = True
        kept.append((begins[done], ends[done], series[:, done]))
        whole += 2.0 * float(np.sum(series[0, done]))
        count += int(np.sum(done))
        begins, ends = begins[~done], ends[~done]
        if not len(begins):
            break
        middles = 0.5 * (begins + ends)
        begins, ends = np.concatenate((begins, middles)), np.concatenate((middles, ends))
    starts = np.concatenate([part[0] for part in kept])
    order = np.argsort(starts)
    densities = np.concatenate([part[2] for part in kept], axis=1)[:, order]
    shares = np.concatenate(([0.0], np.cumsum(2.0 * densities[0])))
    return BondDistribution(
        np.append(starts[order], high), densities / shares[-1], shares / shares[-1]
    )


def _series(bond: Potential, temperature: float, begins: Array, ends: Array) -> Array:
    """Return the Legendre coefficients of exp(-U/T) in each panel, times half the panel width."""
    half = 0.5 * (ends - begins)
    strains = 0.5 * (begins + ends) + half * _NODES[:, np.newaxis]
    with np.errstate(all="ignore"):
        values = np.exp(-np.asarray(bond.energy(strains), dtype=float) / temperature)
    # If the energy overflows to NaN, the density is zero.
    return _TO_SERIES @ (np.nan_to_num(values, nan=0.0) * half)


def _ends(bond: Potential, temperature: float) -> tuple[float, float]:
    """Return the smallest and largest strain of the density; refuse too high a temperature."""
    floor, ceiling = bond.crossing_strain, min(bond.barrier_strain, bond.strain_max)
    if bond.dissociation == 0.0:
        raise SceneError(
            f"temperature is given, but a {bond.name} bond has no force in tension, so the chain "
            "has no equilibrium. Drop temperature"
        )
    pressed = _energy_at(bond, floor)
    depth = min(pressed, _energy_at(bond, ceiling), bond.dissociation)
    if temperature * LEAST_DEPTH > depth:
        end = f"{'presses the ends of' if depth == pressed else 'breaks'} a {bond.name} bond"
        end += " together" * (depth == pressed)
        raise SceneError(
            f"temperature is {temperature:g}: an energy of {depth:.6g} {end}. Give a "
            f"temperature of at most {depth / LEAST_DEPTH:.6g} ({LEAST_DEPTH:g} times less "
            "than this energy)"
        )
    level = _REACH * temperature
    low = -bond.distance_at(level, -1.0, -floor)
    high = bond.distance_at(min(level, bond.dissociation - temperature), 1.0, ceiling)
    if math.isinf(high) or math.isinf(low):
        raise SceneError(
            f"temperature is {temperature:g}: the energy of the {bond.name} bond grows too "
            "slowly for an equilibrium. Give a lower temperature"
        )
    return low, high


def _energy_at(bond: Potential, strain: float) -> float:
    """Return U at the largest or smallest strain; inf if there is none or U is not finite."""
    if math.isinf(strain):
        return math.inf
    with np.errstate(all="ignore"):
        energy = float(bond.energy(strain))
    return energy if math.isfinite(energy) else math.inf
