r"""
Cosine and sine transforms along the last axis, by NumPy's Fourier transform.

SciPy has the same; to import it takes longer than to carry out most collisions.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def cosine_transform(values: Array) -> Array:
    r"""
    Return the orthonormal DCT-II.

    .. math:: \sqrt{(2 - \delta_{j0})/n} \sum_i u_i \cos(\pi j (i - 1/2)/n)

    Values of odd number, then those of even number from behind, have a Fourier transform V of
    which it is the real part of :math:`V_j e^{-i\pi j/2n}`. Source: Makhoul, IEEE Transactions on
    Acoustics, Speech, and Signal Processing 28, 27 (1980).

    Parameters
    ----------
    values : ndarray of shape (..., n)
        u_1 to u_n.

    Returns
    -------
    ndarray of shape (..., n)
        For j = 0 to n - 1.
    """
    n = values.shape[-1]
    j = np.arange(n // 2 + 1)
    turned = np.concatenate((values[..., ::2], values[..., 1::2][..., ::-1]), axis=-1)
    rotated = np.fft.rfft(turned) * np.exp(-0.5j * np.pi * j / n)
    found = np.empty(values.shape)
    found[..., : n // 2 + 1] = rotated.real
    found[..., n // 2 + 1 :] = -rotated.imag[..., (n - 1) // 2 : 0 : -1]
    found *= np.sqrt(2.0 / n)
    found[..., 0] *= np.sqrt(0.5)
    return found


def sine_transform(values: Array) -> Array:
    r"""
    Return the orthonormal DST-I, :math:`\sqrt{2/(m + 1)} \sum_i s_i \sin(\pi i j/(m + 1))`.

    Parameters
    ----------
    values : ndarray of shape (..., m)
        s_1 to s_m.

    Returns
    -------
    ndarray of shape (..., m)
        For j = 1 to m.
    """
    m = values.shape[-1]
    # Continued as an odd function, which has sines alone.
    odd = np.zeros((*values.shape[:-1], 2 * m + 2))
    odd[..., 1 : m + 1] = values
    odd[..., m + 2 :] = -values[..., ::-1]
    return np.fft.rfft(odd).imag[..., 1 : m + 1] * -np.sqrt(0.5 / (m + 1))
