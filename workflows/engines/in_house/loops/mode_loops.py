"""The loops over the modes of a harmonic body; imported where they run, for they bring Numba."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from chaincor.workflows.engines.in_house.contact_search import first_root

# Terms of the Taylor series, see ``mode_flight``.
TERMS = 26

Array = NDArray[np.float64]

_first_root = njit(cache=True, error_model="numpy")(first_root)


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def expand_path(
    strain_modes: Array,
    velocity_modes: Array,
    omega: Array,
    shape: Array,
    wall_distance: float,
    moving: Array,
) -> Array:
    """
    Expand the path of particle 1 in time.

    Parameters
    ----------
    strain_modes, velocity_modes : ndarray of shape (n,)
        e_j and p_j.
    omega, shape : ndarray of shape (n,)
        Frequencies and shapes at particle 1.
    wall_distance : float
        x of particle 1.
    moving : ndarray of shape (2, n)
        Scratch.

    Returns
    -------
    ndarray of shape (TERMS,)
        Taylor coefficients.
    """
    coefficients = np.empty(TERMS)
    coefficients[0] = wall_distance
    for j in range(omega.shape[0]):
        moving[0, j] = shape[j] * velocity_modes[j]
        moving[1, j] = -shape[j] * omega[j] * strain_modes[j]
    factorial = 1.0
    for m in range(1, TERMS):
        factorial *= m
        row = (m - 1) % 2
        total = 0.0
        for j in range(omega.shape[0]):
            total += moving[row, j]
            moving[row, j] *= -omega[j] * omega[j]
        coefficients[m] = total / factorial
    return coefficients


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def rotate(strain_modes: Array, velocity_modes: Array, omega: Array, time: float) -> None:
    """
    Let all modes move freely, in place.

    Parameters
    ----------
    strain_modes, velocity_modes : ndarray of shape (n,)
        e_j and p_j.
    omega : ndarray of shape (n,)
        Frequencies.
    time : float
        How long.
    """
    for j in range(omega.shape[0]):
        cosine = np.cos(omega[j] * time)
        sine = np.sin(omega[j] * time)
        strain = strain_modes[j]
        strain_modes[j] = strain * cosine + velocity_modes[j] * sine
        velocity_modes[j] = velocity_modes[j] * cosine - strain * sine


@njit(cache=True, error_model="numpy")
def fly(
    strain_modes: Array,
    velocity_modes: Array,
    omega: Array,
    shape: Array,
    wall_distance: float,
    window: float,
    flown: float,
    longest: float,
) -> tuple[float, float, float]:
    """
    Move the chain to its next contact, or for a given time.

    Parameters
    ----------
    strain_modes, velocity_modes : ndarray of shape (n,)
        e_j and p_j; changed in place, the reflection not included.
    omega, shape : ndarray of shape (n,)
        Frequencies and shapes at particle 1.
    wall_distance : float
        x of particle 1; zero for a departure.
    window : float
        How long the Taylor series holds.
    flown : float
        Time flown before, by earlier calls.
    longest : float
        When to stop looking; whole windows are flown.

    Returns
    -------
    flown : float
        Time flown in all.
    wall_distance : float
        x of particle 1; zero at a contact.
    incoming : float
        Velocity of particle 1 at the contact; positive where there is none.
    """
    moving = np.empty((2, omega.shape[0]))
    while flown < longest:
        path = expand_path(strain_modes, velocity_modes, omega, shape, wall_distance, moving)
        root = _first_root(path, window)
        if root >= 0.0:
            rotate(strain_modes, velocity_modes, omega, root)
            incoming = 0.0
            for j in range(omega.shape[0]):
                incoming += shape[j] * velocity_modes[j]
            return flown + root, 0.0, -abs(incoming)
        wall_distance = 0.0
        for m in range(TERMS - 1, -1, -1):
            wall_distance = wall_distance * window + path[m]
        rotate(strain_modes, velocity_modes, omega, window)
        flown += window
    return flown, wall_distance, 1.0
