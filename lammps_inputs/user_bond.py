"""A bond of a user's own: Python functions of the strain."""

import math

import numpy as np

from lammps_inputs.errors import PotentialError
from lammps_inputs.potential import Potential


class UserBond(Potential):
    """
    A bond given by a user's own functions of the strain.

    Parameters
    ----------
    energy, force : callable
        U(s) and -dU/dr(s), both of arrays.
    name : str
        A label for results.
    strain_min, strain_max : float
        Strains at which the functions may be asked lie between these.

    Raises
    ------
    PotentialError
        If the force does not vanish at natural length or the bond is not stable there.
    """

    anharmonic_order = None
    _STEP = 1e-5  # central difference of the force: error of order step^2 = 1e-10

    def __init__(self, energy, force, name="user", strain_min=-1.0, strain_max=math.inf):
        self.name = name
        self.strain_max = strain_max
        self._energy = energy
        self._force = force
        self.strain_min = strain_min
        self._offset = float(energy(np.array(0.0)))
        at_rest = float(force(np.array(0.0)))
        self._stiffness = float(self.curvature(0.0))
        if not abs(at_rest) <= 1e-9 * abs(self._stiffness):
            raise PotentialError(
                f"bond '{name}' pushes with {at_rest:g} at length 1; expected no force there: "
                "scale lengths so that the natural bond length is 1"
            )
        if not self._stiffness > 0:
            raise PotentialError(
                f"bond '{name}' has curvature {self._stiffness:g} at length 1; expected a stable "
                "bond, with positive curvature there"
            )

    def energy(self, strain):
        """Return the user's energy, shifted to zero at s = 0."""
        return np.asarray(self._energy(np.asarray(strain, dtype=float)), dtype=float) - self._offset

    def force(self, strain):
        """Return the user's force."""
        return np.asarray(self._force(np.asarray(strain, dtype=float)), dtype=float)

    def curvature(self, strain):
        """Return -dF/ds by a central difference, one-sided at the ends of the range."""
        s = np.asarray(strain, dtype=float)
        below = np.maximum(s - self._STEP, self.strain_min)
        above = np.minimum(s + self._STEP, self.strain_max)
        return -(self.force(above) - self.force(below)) / (above - below)

    @property
    def stiffness(self):
        """U''(1), from the user's force."""
        return self._stiffness
