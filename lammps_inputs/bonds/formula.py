"""A bond whose energy is given as a formula."""

import math
from collections.abc import Callable, Mapping
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.check import find_kinks
from chaincor.lammps_inputs.bonds.formula_code import FormulaParameters, formula_code
from chaincor.lammps_inputs.bonds.formula_rest import (
    LOST,
    expand,
    lost_digits,
    many_digits,
    reach_of,
)
from chaincor.lammps_inputs.bonds.formula_text import canonical_text
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.errors import PotentialError

# A strain, and a relative difference of the stiffness, that are rounding.
_ROUNDING = 1e-12


class Formula(UserBond):
    r"""
    A bond given by a formula for its energy.

    U is a function of the strain ``s``, or the length ``r`` = 1 + s, and of named parameters.
    Natural length is where the force vanishes nearest to length 1; strains count from it, so that
    a chain at rest has none, and U and -dU/ds are zero there. Near it a series of the force is
    used, for which the formula is expanded with 40 digits: nothing cancels at any strain. Speeds,
    energies and times are those of the formula. The speed scale v* is that of
    :math:`U(x^*) = k (x^* - x_0)^2`, with the stiffness k and the natural length of the formula.

    Raises PotentialError if it is no formula, it has no stable length near 1, kinks, or its digits
    cancel.
    """

    text: str  #: The energy, in one way of many to write it.
    given: dict[str, float]  #: The parameters.
    smooth = True
    kinks = ()

    def __init__(self, text: str, parameters: Mapping[str, float]) -> None:
        self.text, self.given = canonical_text(text), dict(sorted(parameters.items()))
        self._code = formula_code(self.text, tuple(self.given))
        self._values = tuple(self.given.values()) or (0.0,)
        self._functions = {
            name: self._code.function(getattr(self._code, name), self._values)
            for name in ("energy", "force", "curvature")
        }
        with np.errstate(all="ignore"):
            self._exact_rest, self._series = expand(self._code, self._values, self._refuse)
            self._rest = float(self._exact_rest)
            self._near = reach_of(self._series)
            terms, orders = np.asarray(self._series), np.arange(1, len(self._series) + 1)
            # Near rest: a power of the strain, and the series that it is a factor of.
            self._near_rest = {
                "energy": (2, -terms / (orders + 1)),
                "force": (1, terms),
                "curvature": (0, -terms * orders),
            }
            low, high = self._find_ends()
            self._barrier = self._find_barrier(high)
            low = self._find_inner_barrier(low)
            offset = self._functions["energy"](self._rest)
            if not math.isfinite(offset):
                raise self._refuse("has no finite value at rest", "one at every length near 1")
            self._offset = float(offset)
            reach = (max(-1.0, low), min(high, self._barrier))
            lost = lost_digits(
                self._code, self._values, self._exact_rest, self.force, self._near, reach
            )
            if lost is not None:
                raise self._refuse(
                    f"loses its digits: at strain {lost[0]:.3g} the force in double precision is "
                    f"off by {lost[1]:.1g} of itself",
                    f"{LOST:g} at most: rewrite it without differences of large numbers",
                )
            self._low, self._high = low, high
            try:
                super().__init__(
                    self.energy, self.force, name="formula", strain_min=low, strain_max=high
                )
            except PotentialError as error:
                raise self._refuse(
                    f"is not smooth ({error})", "a formula without poles and jumps"
                ) from None
            found = find_kinks(self)
        if found:
            raise self._refuse(f"has a kink at strain {found[0]:.6g}", "a smooth formula")
        if math.isfinite(self._barrier):
            self.dissociation = math.inf

    def __reduce__(self) -> tuple[Callable, tuple[Any, ...]]:
        return formula_bond, (self.text, tuple(self.given.items()))

    def as_keys(self) -> dict[str, Any]:
        """Return the formula."""
        return {"energy": self.text, "parameters": self.given}

    @property
    def natural_length(self) -> float:
        """Length at which the formula has its minimum; 1 to rounding where that is meant."""
        return 1.0 if abs(self._rest) < _ROUNDING else 1.0 + self._rest

    @property
    def force_kernel(self) -> Callable:
        """Compiled once for all values of the parameters."""
        return self._code.kernel

    @property
    def curvature_kernel(self) -> Callable:
        """The same of U''."""
        return self._code.curvature_kernel

    @property
    def users_force(self) -> None:  # type: ignore[override]
        """None: there is a kernel."""
        return

    @property
    def parameters(self) -> FormulaParameters:
        """Of the kernel."""
        return FormulaParameters(self._values, self._rest, self._near, self._series)

    @property
    def anharmonic_order(self) -> int | None:  # type: ignore[override]
        """Order of the first term after the square that is more than rounding."""
        terms = [abs(c) * self._near**k for k, c in enumerate(self._series)]
        return next((k + 2 for k, t in enumerate(terms) if k and t > _ROUNDING * terms[0]), None)

    @property
    def barrier_strain(self) -> float:
        """Strain at which a stretched bond is pulled no further back."""
        return self._barrier

    @cached_property
    def natural_speed(self) -> float | None:
        """v*, with so many digits that the 13 that are kept are those of any processor."""
        strain = self._find_compressed_strain()
        if strain is None:
            return None
        digits, rest = many_digits(), self._exact_rest
        energy = self._code.function(self._code.energy, self._values, digits)
        offset = energy(rest)

        def excess(s: Any) -> Any:
            return (energy(rest + s) - offset) / (self.stiffness * s * s) - 1

        near = (strain * (1.0 - 1e-9), strain * (1.0 + 1e-9))
        root = digits.findroot(excess, near, solver="secant", tol=1e-40)
        return float(f"{float(digits.sqrt(2 * self.stiffness) * abs(root)):.12e}")

    def energy(self, strain: ArrayLike) -> Any:
        """Return U, zero at rest."""
        return self._joined(strain, "energy")

    def force(self, strain: ArrayLike) -> Any:
        """Return -dU/ds."""
        return self._joined(strain, "force")

    def curvature(self, strain: ArrayLike) -> Any:
        """Return U''."""
        return self._joined(strain, "curvature")

    @property
    def stiffness(self) -> float:
        """U'' at rest."""
        return -self._series[0]

    def _joined(self, strain: Any, name: str) -> Any:
        """Return a series in the strain near rest, and the formula beyond."""
        s = np.asarray(strain, dtype=float)
        power, series = self._near_rest[name]
        x = np.clip(s, -self._near, self._near)
        total = np.zeros_like(x)
        for coefficient in series[::-1]:
            total = total * x + coefficient
        beyond = self._functions[name](self._rest + s)
        if name == "energy":
            beyond = beyond - self._offset
        outside = (s < self._low) | (s > self._high)
        beyond = np.where(outside, math.nan, beyond)
        return np.where(np.abs(s) < self._near, x**power * total, beyond)[()]

    _low, _high, _barrier = -math.inf, math.inf, math.inf

    def _refuse(self, what: str, expected: str) -> PotentialError:
        values = ", ".join(f"{name} = {value:g}" for name, value in self.given.items())
        where = f" with {values}" if values else ""
        return PotentialError(f"energy {self.text!a}{where} {what}; expected {expected}")

    def _find_ends(self) -> tuple[float, float]:
        """Return the strains between which no base or argument changes its sign."""
        from scipy.optimize import brentq

        ends = [-(1.0 + self._rest), math.inf]
        far = np.geomspace(1e-6, 1e6, 6000)
        outward = (-np.append(far[far < -ends[0]], -ends[0]), far)
        for guard in self._code.guards:
            function = self._code.function(guard, self._values)

            def value(strain: Any, function: Callable = function) -> Any:
                return function(self._rest + strain)

            at_rest = value(0.0)
            for side, strains in enumerate(outward):
                changed = np.flatnonzero(~(np.asarray(value(strains)) * at_rest > 0.0))
                if not len(changed):
                    continue
                first = int(changed[0])
                inner = float(strains[first - 1]) if first else 0.0
                outer = float(strains[first])
                try:
                    end = float(brentq(value, inner, outer, xtol=1e-15))
                except ValueError:  # zero or no number at the end itself
                    end = outer
                if abs(end) < abs(ends[side]):
                    ends[side] = end
        low = ends[0]
        if abs(low + 1.0) < _ROUNDING:
            low = -1.0
        # Where particles can meet, at finite energy or of longer bonds, engines see for themselves.
        energy = self._functions["energy"](np.float64(self._rest + low))
        holds = low == -1.0 and not math.isfinite(energy)
        return (low if low > -1.0 or holds else -math.inf), ends[1]

    def _find_barrier(self, high: float) -> float:
        """Return the first stretched strain where the force pulls no longer."""
        strains = np.geomspace(self._near, min(1e3, 0.999 * high), 4000)
        forces = self.force(strains)
        pushes = np.flatnonzero(forces > 1e-13 * self.stiffness)
        if not len(pushes):
            return math.inf
        return self._zero_of_force(strains, int(pushes[0]))

    def _find_inner_barrier(self, low: float) -> float:
        """Return the end of the strains, or the first compressed one where the force pulls."""
        end = 0.999 * min(1.0, -low)
        if end <= self._near:
            return low
        strains = -np.geomspace(self._near, end, 2000)
        pulls = np.flatnonzero(~(self.force(strains) > 0.0))
        return self._zero_of_force(strains, int(pulls[0])) if len(pulls) else low

    def _zero_of_force(self, strains: Array, first: int) -> float:
        from scipy.optimize import brentq

        if first == 0:
            return float(strains[0])
        try:
            return float(brentq(self.force, strains[first - 1], strains[first], xtol=1e-15))
        except ValueError:
            return float(strains[first - 1])


@lru_cache(maxsize=256)
def formula_bond(text: str, parameters: tuple[tuple[str, float], ...]) -> Formula:
    """Return the bond of a formula, the same object each time."""
    return Formula(text, dict(parameters))
