"""Shapes of the modes of a free harmonic chain of any masses, each frequency to all its digits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array


@dataclass(frozen=True, eq=False)
class FreeModes:
    r"""Modes of a free harmonic chain of any masses, j = 1..n-1, without the translation."""

    frequencies: Array  #: :math:`\omega_j`; of shape (n - 1,).
    #: Orthonormal shapes :math:`b_j` of the strains, in columns; of shape (n - 1, n - 1).
    strains: Array
    #: Orthonormal shapes :math:`a_j` of :math:`\sqrt{m_i} u_i`, in columns, with :math:`B M^{-1/2}
    #: a_j = \omega_j b_j/\sqrt{k}`; of shape (n, n - 1).
    particles: Array


def free_modes(masses: ArrayLike, stiffness: float = 1.0) -> FreeModes:
    r"""
    Return frequencies and shapes of a free chain, each frequency to a few epsilon of itself.

    The tridiagonal matrix of the strains knows slow modes only to an epsilon of the fastest. In
    Jacobi coordinates, each particle relative to the centre of mass of all before it, the strains
    are a bidiagonal matrix instead,

    .. math:: R_{ii} = \mu_i^{-1/2}, \quad R_{i,i+1} = -\frac{\mu_i^{1/2}}{m_{i+1}}, \quad
              \frac{1}{\mu_i} = \frac{1}{m_{i+1}} + \frac{1}{m_1 + \dots + m_i},

    whose entries are free of cancellation, and whose singular values, however small, the QR
    iteration of LAPACK finds to all digits (Demmel and Kahan, 1990). O(n^3), 0.7 s for n = 300.
    `masses` are of shape (n,), `stiffness` is U''(1); the modes come by rising frequency.
    """
    from scipy.linalg import svd

    m = np.asarray(masses, dtype=float)
    before = np.cumsum(m)[:-1]
    diagonal = np.sqrt(1.0 / m[1:] + 1.0 / before)
    jacobi = np.diag(diagonal) - np.diag(1.0 / (m[1:-1] * diagonal[:-1]), 1)
    # A matrix that is bidiagonal already goes to the QR iteration as it is.
    left, values, right = svd(jacobi, lapack_driver="gesvd")
    rising = slice(None, None, -1)
    basis = np.triu(np.outer(np.sqrt(m), -1.0 / (before * diagonal)))
    basis[np.arange(1, len(m)), np.arange(len(m) - 1)] = 1.0 / (np.sqrt(m[1:]) * diagonal)
    return FreeModes(
        np.sqrt(stiffness) * values[rising], right[rising].T, (basis @ left)[:, rising]
    )
