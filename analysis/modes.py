r"""
Normal modes of the free chain and the energy in each.

Mode j = 0..n-1 has the shape :math:`\cos(\pi j (i - 1/2)/n)` and the frequency
:math:`\omega_j = 2\sqrt{k} \sin(\pi j / 2n)`; j = 0 is the translation. The paper prints
:math:`\sin(\pi j/n)`, which is not the frequency of its own chain.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from analysis.restitution import bond_strains
from lammps_inputs.potential import Potential


def mode_frequencies(particles: int, stiffness: float = 1.0) -> NDArray[np.float64]:
    r"""
    Return :math:`\omega_j = 2 \sqrt{k} \sin(\pi j/(2n))`.

    Parameters
    ----------
    particles : int
        Number of particles n.
    stiffness : float
        U''(1) = k.

    Returns
    -------
    numpy.ndarray of shape (n,)
        Angular frequencies, rising from 0.
    """
    return 2.0 * np.sqrt(stiffness) * np.sin(0.5 * np.pi * np.arange(particles) / particles)


def mode_amplitudes(values: ArrayLike) -> NDArray[np.float64]:
    r"""
    Return the orthonormal DCT-II: the amplitude of each mode, in O(n log n).

    :math:`q_j = \sqrt{(2 - \delta_{j0})/n} \sum_i u_i \cos(\pi j (i - 1/2)/n)`.

    Parameters
    ----------
    values : array_like of shape (..., n)
        Displacements or velocities.

    Returns
    -------
    numpy.ndarray of shape (..., n)
        Amplitudes q_j or p_j.
    """
    from scipy.fft import dct

    return dct(np.asarray(values, dtype=float), type=2, norm="ortho", axis=-1)


def mode_energies(
    displacements: ArrayLike, velocities: ArrayLike, stiffness: float = 1.0
) -> NDArray[np.float64]:
    r"""
    Return :math:`E_j = (p_j^2 + \omega_j^2 q_j^2)/2` for every mode, in O(n log n).

    p is the DCT-II of the velocities. :math:`\omega_j q_j` is taken from the bond strains, as
    :math:`-\sqrt{k}` times their DST-I, which is the same thing without the division: the
    translation, large after a collision, costs no digits.

    Parameters
    ----------
    displacements : array_like of shape (..., n)
        u_i = x_i - (i - 1); leading axes are frames.
    velocities : array_like of shape (..., n)
        Particle velocities.
    stiffness : float
        U''(1).

    Returns
    -------
    numpy.ndarray of shape (..., n)
        Energies; j = 0 is the translation. For harmonic bonds the sum over j >= 1 is exactly the
        vibrational energy; for others see :func:`anharmonic_remainder`.
    """
    from scipy.fft import dst

    energies = 0.5 * mode_amplitudes(velocities) ** 2
    if energies.shape[-1] > 1:
        strains = bond_strains(displacements)
        energies[..., 1:] += 0.5 * stiffness * dst(strains, type=1, norm="ortho", axis=-1) ** 2
    return energies


def anharmonic_remainder(displacements: ArrayLike, bond: Potential) -> NDArray[np.float64]:
    r"""
    Return the bond energy that the modes leave out, :math:`\sum_i (U(s_i) - k s_i^2/2)`.

    Parameters
    ----------
    displacements : array_like of shape (..., n)
        u_i = x_i - (i - 1).
    bond : Potential
        The bonds' potential.

    Returns
    -------
    numpy.ndarray of shape (...)
        Vibrational energy less the sum of E_j over j >= 1: zero for harmonic bonds, negative
        where the bonds soften.
    """
    strains = bond_strains(displacements)
    return np.sum(bond.energy(strains) - 0.5 * bond.stiffness * strains**2, axis=-1)
