"""A bond whose force is a cubic spline, as that of a table is."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.user_bond import UserBond

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


class SplineParameters(NamedTuple):
    """A cubic spline, for compiled loops."""

    knots: Array  #: Strains between which the cubics lie; of shape (rows,).
    #: Their coefficients, of the cube first, of the strain beyond the knot before; of shape (4,
    #: rows - 1).
    terms: Array
    #: Strains between which there is a force; the outer cubics go on to these.
    low: float
    high: float  #: See ``low``.


def spline_force(strain: float, parameters: SplineParameters) -> float:
    """Return the spline at one strain; no number beyond its ends."""
    if not parameters.low <= strain <= parameters.high:
        return np.nan
    knots, terms = parameters.knots, parameters.terms
    first, last = 0, terms.shape[1]
    while last - first > 1:
        middle = (first + last) // 2
        if strain < knots[middle]:
            last = middle
        else:
            first = middle
    s = strain - knots[first]
    force: float = ((terms[0, first] * s + terms[1, first]) * s + terms[2, first]) * s
    return force + terms[3, first]


class SplineBond(UserBond):
    """
    A bond whose force is a cubic spline, and whose energy is the integral of that.

    Parameters
    ----------
    force : scipy.interpolate.CubicSpline
        Of the strain; nothing at 0.
    name : str
        A label for results.
    reach : float
        How far beyond its rows the spline may go on.
    """

    force_kernel = staticmethod(spline_force)

    def __init__(self, force: "CubicSpline", name: str, reach: float = 0.0) -> None:
        energy = force.antiderivative()
        energy.c *= -1.0
        super().__init__(energy, force, name, float(force.x[0]) - reach, float(force.x[-1]) + reach)
        self.force_spline = force
        knots, terms = (np.ascontiguousarray(a, dtype=float) for a in (force.x, force.c))
        self._parameters = SplineParameters(knots, terms, self.strain_min, self.strain_max)

    @property
    def parameters(self) -> tuple[Any, ...]:
        """Of the kernel, which all splines share."""
        return self._parameters

    def _refuse_mismatch(self) -> None:
        """Refuse nothing: the energy was made of the force."""
