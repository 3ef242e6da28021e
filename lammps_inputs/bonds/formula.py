"""Define a bond by a formula for its energy."""

import math
from collections.abc import Callable, Mapping
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

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

# Smaller strains, or relative changes of the stiffness, are attributed to rounding.
_ROUNDING = 1e-12


class Formula(UserBond):
    r"""
    Bond given by a formula for its energy.

    U is a function of the strain ``s``, or the length ``r`` = 1 + s, and of named parameters. The
    natural length is the zero of the force nearest to length 1. The methods of this class measure
    strains from the natural length, where U and -dU/ds vanish. Near the natural length the formula
    would lose digits by cancellation. There the force is a series whose coefficients are computed
    with 40 digits. Speeds, energies and times are in the units of the formula. The speed scale v*
    is obtained from :math:`U(x^*) = k (x^* - x_0)^2`, with the stiffness k and the natural length
    of the formula.

    Raises PotentialError if the text is not a formula, or if the bond has no stable length near 1,
    has kinks, or loses digits by cancellation.
    """

    text: str  #: Formula of the energy in canonical form.
    given: dict[str, float]  #: Values of the parameters, by name.
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
            self.stiffness = -self._series[0]
            terms, orders = np.asarray(self._series), np.arange(1, len(self._series) + 1)
            # Near the natural length, each function is a power of the strain times a series; each
            # entry contains this power and the coefficients.
            self._near_rest = {
                "energy": (2, -terms / (orders + 1)),
                "force": (1, terms),
                "curvature": (0, -terms * orders),
            }
            low, high = self._find_ends()
            self.barrier_strain = self._find_barrier(high)
            low = self._find_inner_barrier(low)
            offset = self._functions["energy"](self._rest)
            if not math.isfinite(offset):
                raise self._refuse(
                    "has no finite value at rest",
                    "Give a formula that is finite at every length near 1",
                )
            self._offset = float(offset)
            reach = (max(-1.0, low), min(high, self.barrier_strain))
            lost = lost_digits(
                self._code, self._values, self._exact_rest, self.force, self._near, reach
            )
            if lost is not None:
                raise self._refuse(
                    f"loses its digits: at strain {lost[0]:.3g} the force in double precision is "
                    f"off by {lost[1]:.1g} of itself ({LOST:g} is allowed)",
                    "Rewrite the formula without differences of large numbers",
                )
            self.strain_min, self.strain_max = low, high
            try:
                super().__init__(self.energy, self.force, "formula", low, high)
            except PotentialError as error:
                raise self._refuse(
                    f"is not smooth ({error})", "Give a formula without poles and jumps"
                ) from None
            found = find_kinks(self)
        if found:
            raise self._refuse(f"has a kink at strain {found[0]:.6g}", "Give a smooth formula")
        if math.isfinite(self.barrier_strain):
            self.dissociation = math.inf
        # A natural length that differs from 1 only by rounding is replaced by 1.
        self.natural_length = 1.0 if abs(self._rest) < _ROUNDING else 1.0 + self._rest
        # The anharmonic order is the order of the first term after the square that exceeds
        # rounding.
        sizes = [abs(c) * self._near**k for k, c in enumerate(self._series)]
        larger = (k for k, size in enumerate(sizes) if k and size > _ROUNDING * sizes[0])
        self.anharmonic_order = next((k + 2 for k in larger), None)
        # The kernels are compiled once, for all values of the parameters.
        self.users_force = None
        self.force_kernel, self.curvature_kernel = self._code.kernels
        self.parameters = FormulaParameters(self._values, self._rest, self._near, self._series)

    def __reduce__(self) -> tuple[Callable, tuple[Any, ...]]:
        return formula_bond, (self.text, tuple(self.given.items()))

    def as_keys(self) -> dict[str, Any]:
        """Return the formula."""
        return {"energy": self.text, "parameters": self.given}

    @cached_property
    def natural_speed(self) -> float | None:
        """v*, from 40 digits, rounded to 13 digits that are equal on all processors."""
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
        """Return U, which is zero at the natural length."""
        return self._joined(strain, "energy")

    def force(self, strain: ArrayLike) -> Any:
        """Return -dU/ds."""
        return self._joined(strain, "force")

    def curvature(self, strain: ArrayLike) -> Any:
        """Return U''."""
        return self._joined(strain, "curvature")

    def _joined(self, strain: Any, name: str) -> Any:
        """Return values of a function, at small strains from the series, else from the formula."""
        s = np.asarray(strain, dtype=float)
        power, series = self._near_rest[name]
        x = np.clip(s, -self._near, self._near)
        total = np.zeros_like(x)
        for coefficient in series[::-1]:
            total = total * x + coefficient
        beyond = self._functions[name](self._rest + s)
        if name == "energy":
            beyond = beyond - self._offset
        outside = (s < self.strain_min) | (s > self.strain_max)
        beyond = np.where(outside, math.nan, beyond)
        return np.where(np.abs(s) < self._near, x**power * total, beyond)[()]

    def _refuse(self, problem: str, remedy: str) -> PotentialError:
        values = ", ".join(f"{name} = {value:g}" for name, value in self.given.items())
        where = f" with {values}" if values else ""
        return PotentialError(f"energy {self.text!a}{where} {problem}. {remedy}")

    def _find_ends(self) -> tuple[float, float]:
        """Return the strains between which no base of a power or argument of log changes sign."""
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
                except ValueError:  # at the end itself the expression is 0 or NaN
                    end = outer
                if abs(end) < abs(ends[side]):
                    ends[side] = end
        low = ends[0]
        if abs(low + 1.0) < _ROUNDING:
            low = -1.0
        # If the energy is finite at zero length, the bond has no smallest strain; the engines then
        # detect particles that pass each other.
        energy = self._functions["energy"](np.float64(self._rest + low))
        holds = low == -1.0 and not math.isfinite(energy)
        return (low if low > -1.0 or holds else -math.inf), ends[1]

    def _find_barrier(self, high: float) -> float:
        """Return the smallest positive strain at which the force does not pull."""
        strains = np.geomspace(self._near, min(1e3, 0.999 * high), 4000)
        return self._first_zero(strains, self.force(strains) > 1e-13 * self.stiffness, math.inf)

    def _find_inner_barrier(self, low: float) -> float:
        """Return the negative strain nearest to 0 at which the force pulls, or else the end."""
        end = 0.999 * min(1.0, -low)
        if end <= self._near:
            return low
        strains = -np.geomspace(self._near, end, 2000)
        return self._first_zero(strains, ~(self.force(strains) > 0.0), low)

    def _first_zero(self, strains: Array, beyond: NDArray[np.bool_], end: float) -> float:
        """Return the zero of the force before the first strain marked `beyond`, or the end."""
        from scipy.optimize import brentq

        if not np.any(beyond):
            return end
        first = int(np.argmax(beyond))
        if first == 0:
            return float(strains[0])
        try:
            return float(brentq(self.force, strains[first - 1], strains[first], xtol=1e-15))
        except ValueError:
            return float(strains[first - 1])


@lru_cache(maxsize=256)
def formula_bond(text: str, parameters: tuple[tuple[str, float], ...]) -> Formula:
    """Return the bond of a formula; equal arguments give the same object."""
    return Formula(text, dict(parameters))
