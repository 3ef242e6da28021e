"""Define the Hertz bond: overlapping beads repel each other with a power of the overlap."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.named_bond import NamedBond, Strain
from chaincor.lammps_inputs.contacts.power import PowerContact
from chaincor.lammps_inputs.errors import PotentialError

#: Exponent of the force between elastic spheres, and in LAMMPS's granular styles.
HERTZ = 1.5
# With larger exponents, energies overflow or underflow at speeds that scenes allow.
LARGEST_EXPONENT = 9.0


class HertzParameters(NamedTuple):
    """Exponent p of the force."""

    exponent: float


def hertz_force(strain: Strain, parameters: HertzParameters) -> Strain:
    """Return d^p with the overlap d = -s; 0 if the beads are apart."""
    overlap, exponent = np.maximum(-strain, 0.0), parameters.exponent
    # Roots and products are several times cheaper than a power.
    if exponent == 1.5:
        return overlap * np.sqrt(overlap)
    if exponent == 2.0:
        return overlap * overlap
    if exponent == 2.5:
        return overlap * overlap * np.sqrt(overlap)
    if exponent == 3.0:
        return overlap * overlap * overlap
    if exponent == 1.25:
        return overlap * np.sqrt(np.sqrt(overlap))
    return overlap**exponent


def hertz_curvature(strain: Strain, parameters: HertzParameters) -> Strain:
    """Return p d^(p - 1)."""
    overlap = np.maximum(-strain, 0.0)
    return parameters.exponent * overlap ** (parameters.exponent - 1.0)


@dataclass(frozen=True)
class Hertz(NamedBond):
    """
    U = d^(p + 1)/(p + 1) with the overlap d = -s; 0 if the beads are apart.

    While beads overlap, damping adds A d^(p - 1) d' (viscoelastic spheres) or A d' (a dashpot) to
    the repulsive force d^p, where d' is the time derivative of d. A negative sum is replaced by 0,
    because separating beads do not attract each other.
    """

    exponent: float = HERTZ  #: Exponent p of the force; 3/2 for two spheres.
    damping: float = 0.0  #: Factor A of the damping force.
    damping_law: str = "viscoelastic"  #: Law of damping: ``viscoelastic`` or ``dashpot``.

    name = "hertz"
    title = "beads (hertz)"
    keys: ClassVar = {
        "hertz_exponent": "exponent",
        "damping": "damping",
        "damping_law": "damping_law",
    }
    parameters_type = HertzParameters
    force_kernel = staticmethod(hertz_force)
    curvature_kernel = staticmethod(hertz_curvature)
    smooth = False
    only_pushes = True
    stiffness = 0.0
    anharmonic_order = None  # None allows centres to pass each other, as with springs
    dissociation = 0.0
    convex_strain = 0.0
    kinks: ClassVar = (0.0,)

    def __post_init__(self) -> None:
        """Refuse exponents that overflow or give a contact without overlap a stiffness."""
        if not 1.0 < self.exponent <= LARGEST_EXPONENT:
            raise PotentialError(
                f"hertz_exponent is {self.exponent!r}. Give a number above 1, up to "
                f"{LARGEST_EXPONENT:g}, such as 1.5"
            )

    def energy(self, strain: ArrayLike) -> Array:
        """Return d^(p + 1)/(p + 1)."""
        power = self.exponent + 1.0
        return np.maximum(-np.asarray(strain, dtype=float), 0.0) ** power / power

    def as_keys(self) -> dict[str, Any]:
        """Return the parameters, including those of damping if there is damping."""
        keys = super().as_keys()
        return keys if self.damping > 0.0 else {"hertz_exponent": keys["hertz_exponent"]}

    @property
    def damping_power(self) -> float:
        """Power of the overlap in the damping force."""
        return self.exponent - 1.0 if self.damping_law == "viscoelastic" else 0.0

    @property
    def contact(self) -> PowerContact:
        """Contact law of the bodies, which is the same as between beads."""
        return PowerContact(1.0, self.exponent)

    def compressed_strain(self, energy: float) -> float:
        """Return the strain of a contact with a given energy."""
        return -self.contact.overlap(energy)

    def compressed_strains(self, energies: Array) -> Array:
        """Return the strains of contacts with given energies."""
        return np.array([self.compressed_strain(energy) for energy in energies.tolist()])

    def sound_stiffness(self, energy: float) -> float:
        """Return U'' of a contact with a given energy, because U'' is 0 without overlap."""
        return float(self.curvature(self.compressed_strain(energy)))

    def strain_range(self, energy: float) -> tuple[float, float]:
        """Return the range of strains at an energy; beads can separate to any distance."""
        return self.compressed_strain(energy), math.inf

    def _find_compressed_strain(self) -> float | None:
        return None
