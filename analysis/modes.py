r"""
Normal modes of the free chain, and the energy in each mode.

Mode j = 0..n-1 has the shape :math:`\cos(\pi j (i - 1/2)/n)` and the frequency
:math:`\omega_j = 2\sqrt{k} \sin(\pi j / 2n)`; j = 0 is the translation. The paper prints
:math:`\sin(\pi j/n)`, which is not the frequency of its own chain.

Chains of unequal masses have other modes: the eigenvectors of :math:`M^{-1/2} K M^{-1/2}`, where K
= k B^T B and B turns displacements into strains. These modes are computed from the tridiagonal
matrix of the strains, :math:`k B M^{-1} B^T`, which has the same frequencies except the zero
frequency of the translation. The translation is therefore exact, and its energy does not reduce the
precision of other modes.

Frequencies may agree to rounding, for example of vibrations at the two ends of a chain with light
ends. Then any linear combination of their modes is a mode, and the last digit of a mass decides the
computed combination. The energy is then divided equally among these modes, because only the sum has
a meaning.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.restitution import bond_strains, centre_of_mass_velocity
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential

# Modes whose squared frequencies differ by less than this fraction of the largest squared frequency
# cannot be distinguished. If a mass changes by a relative epsilon, squared frequencies change by an
# epsilon of the largest squared frequency.
_INDISTINCT = 1e-12


def mode_frequencies(
    particles: int, stiffness: float = 1.0, masses: ArrayLike | None = None
) -> Array:
    r"""
    Return :math:`\omega_j = 2 \sqrt{k/m} \sin(\pi j/(2n))`; unequal masses have other frequencies.

    Parameters
    ----------
    particles : int
        Number of particles n.
    stiffness : float
        U''(1) = k.
    masses : array_like of shape (n,), optional
        Particle masses; 1 by default.

    Returns
    -------
    numpy.ndarray of shape (n,)
        Angular frequencies, rising from 0.
    """
    m = None if masses is None else np.asarray(masses, dtype=float)
    if m is not None and not are_equal(m):
        return np.concatenate(([0.0], _strain_modes(m, stiffness)[0]))
    mass = 1.0 if m is None else m[0]
    return 2.0 * np.sqrt(stiffness / mass) * np.sin(0.5 * np.pi * np.arange(particles) / particles)


def indistinct_modes(frequencies: ArrayLike) -> list[tuple[int, int]]:
    """
    Return the modes that cannot be distinguished, because frequencies agree to rounding.

    Parameters
    ----------
    frequencies : array_like of shape (n,)
        Frequencies in increasing order from 0, see :func:`mode_frequencies`.

    Returns
    -------
    list of tuple of int
        First and last mode of each group with equal frequencies; the translation, j = 0, is in no
        group.
    """
    squares = np.asarray(frequencies, dtype=float)[1:] ** 2
    if squares.size < 2:
        return []
    apart = np.flatnonzero(np.diff(squares) > _INDISTINCT * squares[-1])
    first = np.concatenate(([0], apart + 1)) + 1
    last = np.concatenate((apart, [squares.size - 1])) + 1
    return [(int(a), int(b)) for a, b in zip(first, last, strict=True) if b > a]


def mode_amplitudes(values: ArrayLike) -> Array:
    r"""
    Return the orthonormal DCT-II: the amplitude of each mode, in O(n log n).

    .. math:: q_j = \sqrt{(2 - \delta_{j0})/n} \sum_i u_i \cos(\pi j (i - 1/2)/n).

    NumPy computes the transform, because importing SciPy takes longer than most collisions. Let V
    be the Fourier transform of the odd-numbered values, followed by the even-numbered values in
    reverse. The result is the real part of :math:`V_j e^{-i\pi j/2n}`. Source: Makhoul, IEEE
    Transactions on Acoustics, Speech, and Signal Processing 28, 27 (1980).

    Parameters
    ----------
    values : array_like of shape (..., n)
        Displacements or velocities.

    Returns
    -------
    numpy.ndarray of shape (..., n)
        Amplitudes q_j or p_j.
    """
    u = np.asarray(values, dtype=float)
    n = u.shape[-1]
    j = np.arange(n // 2 + 1)
    turned = np.concatenate((u[..., ::2], u[..., 1::2][..., ::-1]), axis=-1)
    rotated = np.fft.rfft(turned) * np.exp(-0.5j * np.pi * j / n)
    found = np.empty(u.shape)
    found[..., : n // 2 + 1] = rotated.real
    found[..., n // 2 + 1 :] = -rotated.imag[..., (n - 1) // 2 : 0 : -1]
    found *= np.sqrt(2.0 / n)
    found[..., 0] *= np.sqrt(0.5)
    return found


def _sine_transform(values: Array) -> Array:
    r"""Return the orthonormal DST-I, :math:`\sqrt{2/(m + 1)} \sum_i s_i \sin(\pi i j/(m + 1))`."""
    m = values.shape[-1]
    # The values are extended to an odd function, whose Fourier series has only sines.
    odd = np.zeros((*values.shape[:-1], 2 * m + 2))
    odd[..., 1 : m + 1] = values
    odd[..., m + 2 :] = -values[..., ::-1]
    return np.fft.rfft(odd).imag[..., 1 : m + 1] * -np.sqrt(0.5 / (m + 1))


def mode_energies(
    displacements: ArrayLike,
    velocities: ArrayLike,
    stiffness: float = 1.0,
    masses: ArrayLike | None = None,
) -> Array:
    r"""
    Return :math:`E_j = (p_j^2 + \omega_j^2 q_j^2)/2` for every mode.

    For equal masses p is the DCT-II of the velocities, and :math:`\omega_j q_j` is
    :math:`-\sqrt{k}` times the DST-I of the bond strains. No digits are lost by divisions by small
    frequencies, or by the large translation after a collision. Both transforms cost O(n log n).

    For unequal masses :math:`p_j = \sum_i a_{ij} \sqrt{m_i} v_i` with the orthonormal eigenvectors
    a_j of the free chain, and :math:`\omega_j q_j` is computed from the strains with the
    eigenvectors b_j. If the modes are known, the cost is O(n^2) per frame.

    Parameters
    ----------
    displacements : array_like of shape (..., n)
        u_i = x_i - (i - 1); leading axes are frames.
    velocities : array_like of shape (..., n)
        Particle velocities.
    stiffness : float
        U''(1).
    masses : array_like of shape (n,), optional
        Particle masses; 1 by default.

    Returns
    -------
    numpy.ndarray of shape (..., n)
        Energies; j = 0 is the translation. For harmonic bonds the sum over j >= 1 is exactly the
        vibrational energy; for other bonds see :func:`anharmonic_remainder`. If bonds are broken or
        stretched far, these energies have no meaning: see :func:`kinetic_mode_energies`. All modes
        in a group of :func:`indistinct_modes` have the mean energy of this group.
    """
    if masses is not None and not are_equal(np.asarray(masses, dtype=float)):
        return _unequal_energies(displacements, velocities, stiffness, np.asarray(masses, float))
    mass = 1.0 if masses is None else float(np.asarray(masses, dtype=float)[0])
    energies = 0.5 * mass * mode_amplitudes(velocities) ** 2
    if energies.shape[-1] > 1:
        strains = bond_strains(displacements)
        energies[..., 1:] += 0.5 * stiffness * _sine_transform(strains) ** 2
    return energies


def kinetic_mode_energies(velocities: ArrayLike, masses: ArrayLike | None = None) -> Array:
    r"""
    Return the kinetic part of the mode energies, :math:`p_j^2/2`, which is valid for any bonds.

    The sum over j >= 1 is exactly the kinetic energy relative to the centre of mass. The kinetic
    part is also valid for strongly stretched or broken bonds, for which :func:`mode_energies` has
    no meaning. In harmonic vibration, the time average of the kinetic part is half of :math:`E_j`.

    Parameters
    ----------
    velocities : array_like of shape (..., n)
        Particle velocities.
    masses : array_like of shape (n,), optional
        Particle masses; 1 by default.

    Returns
    -------
    numpy.ndarray of shape (..., n)
        Energies; j = 0 is the translation.
    """
    v = np.asarray(velocities, dtype=float)
    # If all bonds have their natural length, modes have only kinetic energy.
    return mode_energies(np.zeros(v.shape), v, masses=masses)


def are_equal(masses: Array) -> bool:
    """Return whether all particles have the same mass."""
    return bool(np.all(masses == masses[0]))


def _strain_modes(masses: Array, stiffness: float) -> tuple[Array, Array]:
    """Return omega_j and the orthonormal strain shapes (columns) for j = 1..n-1."""
    from scipy.linalg import eigh_tridiagonal

    inverse = stiffness / masses
    squares, shapes = eigh_tridiagonal(inverse[:-1] + inverse[1:], -inverse[1:-1])
    return np.sqrt(squares), shapes


@lru_cache(maxsize=4)
def _kept_modes(masses: bytes, stiffness: float) -> tuple[Array, Array]:
    """Return `_strain_modes` from a cache, because each run of a collision needs these modes."""
    return _strain_modes(np.frombuffer(masses), stiffness)


def _unequal_energies(
    displacements: ArrayLike, velocities: ArrayLike, stiffness: float, masses: Array
) -> Array:
    v = np.asarray(velocities, dtype=float)
    omega, shapes = _kept_modes(masses.tobytes(), stiffness)
    energies = np.empty(v.shape)
    mean = centre_of_mass_velocity(v, masses)
    energies[..., 0] = 0.5 * float(np.sum(masses)) * mean**2
    # The rates of strain, projected on b_j, give p_j, because a_j = sqrt(k) M^(-1/2) B^T b_j /
    # omega_j.
    rates = np.sqrt(stiffness) * np.diff(v, axis=-1) @ shapes / omega
    strains = np.sqrt(stiffness) * bond_strains(displacements) @ shapes
    energies[..., 1:] = 0.5 * (rates**2 + strains**2)
    for first, last in indistinct_modes(np.concatenate(([0.0], omega))):
        group = slice(first, last + 1)
        energies[..., group] = np.mean(energies[..., group], axis=-1, keepdims=True)
    return energies


def anharmonic_remainder(displacements: ArrayLike, bond: Potential) -> Array:
    r"""
    Return the bond energy that is not in the modes, :math:`\sum_i (U(s_i) - k s_i^2/2)`.

    Parameters
    ----------
    displacements : array_like of shape (..., n)
        u_i = x_i - (i - 1).
    bond : Potential
        The bonds' potential.

    Returns
    -------
    numpy.ndarray of shape (...)
        Vibrational energy minus the sum of E_j over j >= 1; zero for harmonic bonds, and negative
        for bonds that soften.
    """
    strains = bond_strains(displacements)
    return np.sum(bond.energy(strains) - 0.5 * bond.stiffness * strains**2, axis=-1)


@dataclass(frozen=True, eq=False)
class FreeModes:
    r"""Modes of a free harmonic chain with any masses, j = 1..n-1, without the translation."""

    frequencies: Array  #: :math:`\omega_j`; of shape (n - 1,).
    #: Orthonormal shapes :math:`b_j` of the strains, in columns; of shape (n - 1, n - 1).
    strains: Array
    #: Orthonormal shapes :math:`a_j` of :math:`\sqrt{m_i} u_i`, in columns, with :math:`B M^{-1/2}
    #: a_j = \omega_j b_j/\sqrt{k}`; of shape (n, n - 1).
    particles: Array


def free_modes(masses: ArrayLike, stiffness: float = 1.0) -> FreeModes:
    r"""
    Compute the modes of a free chain, with a relative error of a few epsilon in each frequency.

    From the tridiagonal matrix of the strains, slow modes have an error of an epsilon of the
    fastest frequency. Jacobi coordinates give the position of each particle relative to the centre
    of mass of all earlier particles. In these coordinates, the strains are given by the bidiagonal
    matrix

    .. math:: R_{ii} = \mu_i^{-1/2}, \quad R_{i,i+1} = -\frac{\mu_i^{1/2}}{m_{i+1}}, \quad
              \frac{1}{\mu_i} = \frac{1}{m_{i+1}} + \frac{1}{m_1 + \dots + m_i},

    The entries are computed without cancellation. LAPACK's QR iteration finds even the smallest
    singular values of this matrix to all digits (Demmel and Kahan, 1990). The cost is O(n^3), 0.7 s
    for n = 300. `masses` have the shape (n,), and `stiffness` is U''(1). Modes are in order of
    increasing frequency.
    """
    from scipy.linalg import svd

    m = np.asarray(masses, dtype=float)
    before = np.cumsum(m)[:-1]
    diagonal = np.sqrt(1.0 / m[1:] + 1.0 / before)
    jacobi = np.diag(diagonal) - np.diag(1.0 / (m[1:-1] * diagonal[:-1]), 1)
    # LAPACK passes a matrix that is already bidiagonal to the QR iteration unchanged.
    left, values, right = svd(jacobi, lapack_driver="gesvd")
    rising = slice(None, None, -1)
    basis = np.triu(np.outer(np.sqrt(m), -1.0 / (before * diagonal)))
    basis[np.arange(1, len(m)), np.arange(len(m) - 1)] = 1.0 / (np.sqrt(m[1:]) * diagonal)
    return FreeModes(
        np.sqrt(stiffness) * values[rising], right[rising].T, (basis @ left)[:, rising]
    )
