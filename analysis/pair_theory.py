r"""
Interval between the two contacts of a chain with two particles, exact and to first order.

The first contact stops the centre of mass, and the two particles then approach each other at the
speed 2 v0: :math:`\dot s^2/4 + U(s) = v_0^2`. Particle 1 is back at the wall when s = 0.
"""

import math

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError

_QUADRATURE_NODES = 64
# Strains are scaled by a characteristic compression of the bond. Bonds that soften on both sides
# have no such compression and use this strain.
_USUAL_STRAIN = 0.5


def pair_interval(bond: Potential, impact_velocity: float) -> float:
    r"""
    Return the interval between the two contacts of the n = 2 chain, by quadrature.

    .. math:: \Delta t = \int_{s_{min}}^0 \frac{ds}{\sqrt{v_0^2 - U(s)}}
              = \int_0^{\pi/2} \frac{2 v_0 \sin\theta}{|U'(s(\theta))|}\, d\theta,
              \qquad U(s(\theta)) = v_0^2 \sin^2\theta .

    The result is exact for any potential that rises smoothly on the compressed side. With 64
    Gauss-Legendre nodes the error is about 1e-13 at speeds of the order of v*.

    Parameters
    ----------
    bond : Potential
        The bond.
    impact_velocity : float
        Impact speed v0 > 0.

    Returns
    -------
    float
        Interval between the contacts; pi/sqrt(2 k) in the limit of low speed.

    Raises
    ------
    InputError
        If the energy of the compressed bond does not reach v0^2.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_QUADRATURE_NODES)
    angles = 0.25 * math.pi * (nodes + 1.0)
    total = 0.0
    for angle, weight in zip(angles, weights, strict=True):
        strain = compressed_strain(bond, (impact_velocity * math.sin(angle)) ** 2)
        force = float(bond.force(np.array(strain)))
        total += weight * 2.0 * impact_velocity * math.sin(angle) / force
    return 0.25 * math.pi * total


def pair_interval_slope(bond: Potential) -> float:
    r"""
    Return alpha of :math:`\Delta t = \pi/\sqrt{2k}\,(1 - \alpha (v_0/v^*)^{r-2} + \dots)`.

    This is NH eq. (15) for any order r. With U = k s^2/2 + c s^r and y = sign(s) sqrt(2 U/k) the
    strain is s = y - (c/k) y^(r-1), and the integral of :func:`pair_interval` becomes elementary:

    .. math:: \alpha = (-1)^r \frac{2}{\pi} \frac{c}{k} (r - 1)
              \left(v^* \sqrt{2/k}\right)^{r-2} \int_0^{\pi/2} \sin^{r-2}\theta\, d\theta .

    For lj bonds alpha is 0.8098 (0.808 in the paper).

    Parameters
    ----------
    bond : Potential
        A bond with an anharmonic term.

    Returns
    -------
    float
        alpha, positive if compression stiffens the bond.

    Raises
    ------
    InputError
        If the bond has no v*, such as a harmonic bond.
    """
    order, speed = bond.anharmonic_order, bond.natural_speed
    if order is None or speed is None:
        raise InputError(
            f"bond '{bond.name}' has no speed v*. Give an anharmonic bond, whose contact "
            "interval depends on the speed"
        )
    m = order - 2
    integral = 0.5 * math.sqrt(math.pi) * math.gamma(0.5 * (m + 1)) / math.gamma(0.5 * m + 1)
    scale = (speed * math.sqrt(2.0 / bond.stiffness)) ** m
    coefficient = anharmonic_coefficient(bond) / bond.stiffness
    return (-1) ** order * 2.0 / math.pi * coefficient * (order - 1) * scale * integral


def anharmonic_coefficient(bond: Potential) -> float:
    """
    Return c of U = k s^2/2 + c s^r + ..., r being the bond's lowest anharmonic order.

    The quotient (U''(s) - k)/(r (r - 1) s^(r-2)) tends to c. The mean of this quotient at +s and -s
    is even in s. Two Richardson steps therefore leave an error of order s^6. The strain s is a
    small fraction of the compression at which the anharmonic and the harmonic part of U are equal.

    Parameters
    ----------
    bond : Potential
        A bond with an anharmonic term.

    Returns
    -------
    float
        c, with a relative error of about 1e-8.

    Raises
    ------
    InputError
        If the bond has no anharmonic order.
    """
    order = bond.anharmonic_order
    if order is None:
        raise InputError(f"bond '{bond.name}' has no anharmonic term. Give an anharmonic bond")
    root = bond.compressed_root
    own = _USUAL_STRAIN if root is None else 1.0 - root
    # At higher orders the denominator is a higher power of s. Larger strains then lose fewer
    # digits.
    strains = own * (0.03 if order == 3 else 0.15) * np.array([1.0, 0.5, 0.25])

    def ratio(s: Array) -> Array:
        return (bond.curvature(s) - bond.stiffness) / (order * (order - 1) * s ** (order - 2))

    one, half, quarter = 0.5 * (ratio(strains) + ratio(-strains))
    return float((64.0 * quarter - 20.0 * half + one) / 45.0)


def compressed_strain(bond: Potential, energy: float) -> float:
    """
    Return the strain s < 0 at which a compressed bond stores an energy, U(s) = energy.

    Parameters
    ----------
    bond : Potential
        The bond.
    energy : float
        Energy > 0.

    Returns
    -------
    float
        Strain s.

    Raises
    ------
    InputError
        If the bond cannot store the energy.
    """
    strain = -bond.distance_at(energy, -1.0, -bond.strain_min)
    with np.errstate(all="ignore"):
        # At a slightly larger compression, the bond must store more than this energy.
        if not float(bond.energy(np.nextafter(strain, -math.inf))) > energy:
            raise InputError(
                f"bond '{bond.name}' cannot store the energy {energy:g} by compression. Give a "
                "bond that stiffens"
            )
    return strain
