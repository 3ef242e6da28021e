"""The loops over modes of harmonic bodies; imported where they run, for they bring Numba."""

import math
from functools import lru_cache

import numpy as np
from numba import njit

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.in_house.loops.kept_loops import folder_of_loops
from chaincor.workflows.engines.in_house.loops.one_process import one_process
from chaincor.workflows.engines.in_house.polynomials import first_root

# Terms of the Taylor series, see ``mode_flight``.
TERMS = 26
# Why `bounce` came back: no contact can come, or it has done its share of work.
PROVED, MORE = range(2)

# What the Taylor series of the gap leaves out, relative to the speeds of all modes together.
_REST = 1e-19
_FACTORIAL = float(math.factorial(TERMS))
# More than roundings of the sum over all modes.
_PROOF_MARGIN = 1.0 + 1e-9
# A contact is as much work as so many windows.
_CONTACT_WORK = 2.0

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


@njit(cache=True, error_model="numpy")
def taylor_window(
    strain_modes: Array, velocity_modes: Array, omega: Array, shape: Array, wall_distance: float
) -> float:
    r"""
    Return how long a Taylor series of the gap holds.

    Its rest is below :math:`\sum_j |c_j| r_j (\omega_j t)^{m - 1} t/m!`, m terms being kept, where
    fast modes count as little as they move the gap.
    """
    fastest, total, share = 0.0, 0.0, 0.0
    for j in range(omega.shape[0]):
        fastest = max(fastest, omega[j])
    for j in range(omega.shape[0]):
        speed = abs(shape[j]) * np.hypot(strain_modes[j], velocity_modes[j])
        total += speed
        if omega[j] > 0.0:
            share += speed * (omega[j] / fastest) ** (TERMS - 1)
    if share > 0.0:
        return (_REST * _FACTORIAL * (total / share)) ** (1.0 / (TERMS - 1)) / fastest
    # Bodies that do not vibrate meet once, at a time that is plain.
    opening = shape[0] * velocity_modes[0]
    return 2.0 * wall_distance / -opening if opening < 0.0 < wall_distance else 1.0


@njit(cache=True, error_model="numpy")
def proof_time(
    strain_modes: Array, velocity_modes: Array, omega: Array, shape: Array, wall_distance: float
) -> float:
    """Return the time from when on no contact can come; inf where the bodies do not part."""
    opening = shape[0] * velocity_modes[0]
    if not opening > 0.0:
        return np.inf
    reach, mean_distance = 0.0, wall_distance
    for j in range(1, omega.shape[0]):
        reach += abs(shape[j]) * np.hypot(strain_modes[j], velocity_modes[j]) / omega[j]
        mean_distance -= shape[j] * strain_modes[j] / omega[j]
    return max((_PROOF_MARGIN * reach - mean_distance) / opening, 0.0)


@njit(cache=True, error_model="numpy")
def bounce(
    gap_modes: tuple[Array, Array, Array, Array],
    wall_distance: float,
    exchange: float,
    flown: float,
    work: float,
    record: tuple[Array, Array, Array, Array],
) -> tuple[int, int, float, float]:
    """
    Fly from contact to contact.

    Parameters
    ----------
    gap_modes : tuple of ndarray of shape (n,)
        e_j and p_j, changed in place; frequencies, and what each mode has of the gap. The first is
        the translation.
    wall_distance : float
        The gap.
    exchange : float
        Momentum exchanged at a contact, per speed of approach.
    flown : float
        Time since the last contact.
    work : float
        After so many windows, times modes, it stops.
    record : tuple of ndarray
        Is given how fast each contact closes and the time since the one before, both of shape
        (most,), and e_j and p_j right after each, of shape (most, n).

    Returns
    -------
    ended : int
        ``PROVED`` or ``MORE``.
    contacts : int
        New ones.
    flown, wall_distance : float
        As given.
    """
    strain_modes, velocity_modes, omega, shape = gap_modes
    speeds, flights, strain_record, velocity_record = record
    contacts = 0
    modes = omega.shape[0]
    while contacts < speeds.shape[0] and work > 0.0:
        window = taylor_window(strain_modes, velocity_modes, omega, shape, wall_distance)
        proof = proof_time(strain_modes, velocity_modes, omega, shape, wall_distance)
        if proof <= 0.0:
            return PROVED, contacts, flown, wall_distance
        longest = min(proof, window * max(work / modes, 1.0))
        time, wall_distance, velocity = fly(
            strain_modes, velocity_modes, omega, shape, wall_distance, window, 0.0, longest
        )
        flown += time
        work -= modes * (time / window + _CONTACT_WORK)
        if velocity > 0.0:
            if time >= proof:
                return PROVED, contacts, flown, wall_distance
            continue
        for j in range(modes):
            velocity_modes[j] -= exchange * velocity * shape[j]
        speeds[contacts] = -velocity
        flights[contacts] = flown
        strain_record[contacts] = strain_modes
        velocity_record[contacts] = velocity_modes
        contacts += 1
        flown = 0.0
    return MORE, contacts, flown, wall_distance


@lru_cache(maxsize=1)
def load_loop() -> None:
    """Load or compile the loop."""
    one, many = np.ones(1), np.ones((1, 1))
    with one_process(folder_of_loops(), "bounce"):
        bounce((one, one, one, one), 1.0, 1.0, 0.0, 0.0, (one, one, many, many))
