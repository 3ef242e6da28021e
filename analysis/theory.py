r"""
Theoretical results that need no simulation, with their sources and limits of validity.

NH is Nagahiro and Hayakawa, Phys. Rev. E 67, 036609 (2003); equation numbers are from this paper.
If the paper has an error, the docstring says so and the function uses the corrected formula. Units:
bond length and particle mass 1; energies of modes are given for impact speed v0.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.contacts import ContactStatistics
from chaincor.analysis.modes import mode_frequencies
from chaincor.lammps_inputs.arrays import Array

# NH eqs. (8)-(10) give the interval between contacts, the number of contacts per particle and the
# incoming speed for the n = 2 chain. The theory assumes these results for every contact of a long
# chain.
PAIR_INTERVAL = math.pi / math.sqrt(2.0)
PAIR_CONTACTS_PER_PARTICLE = 2.0 * math.sqrt(2.0) / math.pi
PAIR_SPEED = math.pi / (2.0 * math.sqrt(2.0))

# The constant is (8/pi^2) (pi/24^(1/3)) I with the integral I of sin^2(y^3)/y^2, I = -2^(1/3)
# Gamma(-1/3) cos(pi/6)/6.
HARMONIC_DISSIPATION_COEFFICIENT = (
    (8.0 / math.pi**2)
    * (math.pi / 24.0 ** (1.0 / 3.0))
    * (-(2.0 ** (1.0 / 3.0)) * math.gamma(-1.0 / 3.0) * math.cos(math.pi / 6.0) / 6.0)
)


def contact_mode_energies(
    particles: int, contact_times: ArrayLike, contact_speeds: ArrayLike
) -> Array:
    r"""
    Return the mode energies that a list of contacts leaves in a harmonic chain (k = 1).

    Contact q gives the momentum 2 v_q to particle 1, and :math:`2 v_q \sqrt{2/n} \cos(\pi j/2n)` to
    mode j. Free motion changes only the phases of the modes:

    .. math:: E_j = \frac{4}{n} \cos^2\frac{\pi j}{2n}
              \left| \sum_q v_q e^{i \omega_j t_q} \right|^2, \qquad j \ge 1.

    NH eq. (7) is this formula for equal speeds and intervals. The formula is exact for harmonic
    bonds if all contacts are given. The cost is O(f n).

    Parameters
    ----------
    particles : int
        Number of particles n.
    contact_times, contact_speeds : array_like of shape (f,)
        Times at which particle 1 hits the wall, and its incoming speeds.

    Returns
    -------
    numpy.ndarray of shape (n - 1,)
        E_j for j = 1..n-1.
    """
    j = np.arange(1, particles)
    omega = mode_frequencies(particles)[1:]
    speeds = np.asarray(contact_speeds, dtype=float)
    total = np.zeros(particles - 1, dtype=complex)
    for time, speed in zip(np.asarray(contact_times, dtype=float), speeds, strict=True):
        total += speed * np.exp(1j * omega * time)
    return 4.0 / particles * np.cos(0.5 * np.pi * j / particles) ** 2 * np.abs(total) ** 2


def basile_dumont_energies(
    particles: int,
    impact_velocity: float = 1.0,
    interval: float = PAIR_INTERVAL,
    contacts: float | None = None,
    contact_speed: float | None = None,
    frequencies: ArrayLike | None = None,
) -> Array:
    r"""
    Return the mode energies of Basile and Dumont, for contacts with equal intervals and speeds.

    .. math:: E_j = \frac{4}{n} v^2 \cos^2\frac{\pi j}{2n}
              \frac{\sin^2(\omega_j f \Delta t/2)}{\sin^2(\omega_j \Delta t/2)}

    This is NH eq. (7), after Basile and Dumont (2000), with :math:`\omega_j = 2\sin(\pi j/2n)`
    instead of the paper's :math:`\sin(\pi j/n)`. With the shorter interval of
    :func:`~chaincor.analysis.pair_theory.pair_interval` it is NH eq. (16), the low-speed theory.

    The formula is valid for harmonic bonds if intervals and incoming speeds are constant.

    Parameters
    ----------
    particles : int
        Number of particles n.
    impact_velocity : float
        Impact speed v0.
    interval : float
        Time between contacts; by default that of the n = 2 chain.
    contacts : float, optional
        Number f of contacts; 0.900 n by default, from the n = 2 chain.
    contact_speed : float, optional
        Incoming speed v at each contact; 1.111 v0 by default.
    frequencies : array_like of shape (n,), optional
        Frequencies omega_j; by default those of the harmonic chain. With the leading order pi j/n
        of the frequencies, all energies vanish, because f dt = 2n is a whole number of periods of
        every mode.

    Returns
    -------
    numpy.ndarray of shape (n - 1,)
        E_j for j = 1..n-1.
    """
    count = PAIR_CONTACTS_PER_PARTICLE * particles if contacts is None else contacts
    speed = PAIR_SPEED * impact_velocity if contact_speed is None else contact_speed
    shape = np.cos(0.5 * np.pi * np.arange(1, particles) / particles) ** 2
    omega = mode_frequencies(particles) if frequencies is None else np.asarray(frequencies)
    half_phase = 0.5 * omega[1:] * interval
    # The quotient count * sinc(count x)/sinc(x) is finite also if both sines vanish.
    ratio = count * np.sinc(count * half_phase / np.pi) / np.sinc(half_phase / np.pi)
    return 4.0 / particles * speed**2 * shape * ratio**2


def measured_contacts_energies(
    particles: int,
    statistics: ContactStatistics,
    impact_velocity: float,
    *,
    stiffness: float = 1.0,
    mass: float = 1.0,
) -> Array | None:
    """
    Return the mode energies of Basile and Dumont for the contacts of a collision.

    Parameters
    ----------
    particles : int
        Number of particles n, of equal masses.
    statistics : ContactStatistics
        Number of contacts, their mean interval and their mean incoming speed.
    impact_velocity : float
        Impact speed v0.
    stiffness, mass : float
        U'' of a bond at its natural length, and mass of a particle.

    Returns
    -------
    numpy.ndarray of shape (n - 1,) or None
        E_j for j = 1..n-1; None for a single contact, which has no interval.
    """
    if statistics.mean_interval is None or statistics.mean_speed is None:
        return None
    # The formula assumes mass and stiffness 1. All times are proportional to sqrt(mass/stiffness).
    return mass * basile_dumont_energies(
        particles,
        interval=statistics.mean_interval * (stiffness / mass) ** 0.5,
        contacts=statistics.count,
        contact_speed=statistics.mean_speed * impact_velocity,
    )


def harmonic_dissipation_law(particles: ArrayLike) -> Array:
    r"""
    Return :math:`1 - \eta \approx 0.652\, n^{-2/3}`, NH eq. (12).

    This is the large-n form of :func:`basile_dumont_energies` with the interval, number and speed
    of contacts from the n = 2 chain. With :math:`\omega_j \approx (\pi j/n)(1 - \pi^2 j^2/24 n^2)`
    the sum over j becomes :math:`\int_0^\infty (8/\pi^2 j^2) \sin^2(\pi^3 j^3/24 n^2)\,dj`. The
    result is the limit of this approximation and not of the chain: simulated chains have n^(2/3) (1
    - eta) of about 0.69 at n = 200..2000.

    Parameters
    ----------
    particles : array_like
        Number of particles n.

    Returns
    -------
    numpy.ndarray
        1 - eta.
    """
    return HARMONIC_DISSIPATION_COEFFICIENT * np.asarray(particles, dtype=float) ** (-2.0 / 3.0)


def harmonic_dissipation_limit() -> float:
    r"""
    Return the limit of :math:`n^{2/3} (1 - \eta)` of harmonic chains, 0.56258.

    A front starts at the wall. After a path of 2n its profile is an integral of the Airy function
    with the width :math:`(n/4)^{1/3}`. The wall pushes until the returning front has risen to half
    its height, at :math:`\int_{z_0}^\infty \mathrm{Ai} = 1/2`. The momentum balance then gives the
    limit :math:`4^{2/3} |\mathrm{Ai}'(z_0)|`. The derivation is in
    ``docs/explanation/slow_chains.md``. Contacts after that moment are neglected.

    Returns
    -------
    float
        The limit, with all digits of float64.

    Examples
    --------
    >>> round(harmonic_dissipation_limit(), 5)
    0.56258
    """
    import mpmath

    def half(z: Any) -> Any:
        return mpmath.mpf(1) / 3 - mpmath.quad(mpmath.airyai, [0, z]) - mpmath.mpf(1) / 2

    return float(4 ** (2 / 3) * abs(mpmath.airyai(mpmath.findroot(half, -0.41), derivative=1)))


def low_speed_dissipation_slope(alpha: float) -> float:
    r"""
    Return C = 4 alpha of :math:`1 - \eta = C v_0/v^*` in the low-speed theory.

    This corrects NH eq. (18), :math:`C = 32\alpha/\pi^2` (2.61 for lj). The paper omits the factor
    :math:`v^2 = (\pi^2/8) v_0^2`, which its own 0.652 contains; with this factor C is 4 alpha
    (3.24). Neither constant describes the chain, whose simulated slope is 0.66 (NH). The theory has
    the right power of v0, but a wrong constant.

    Parameters
    ----------
    alpha : float
        Result of ``pair_interval_slope``.

    Returns
    -------
    float
        C.
    """
    return 4.0 * alpha


@dataclass(frozen=True)
class HardSphereLimit:
    """Collision of a chain of hard spheres: the limit v0 >> v*."""

    restitution: float  #: Restitution, exactly 1, because velocities are only exchanged.
    #: Number of contacts, n. The wall reverses each of the n velocities once.
    contacts: int
    events: int  #: Number of contacts and exchanges of velocities, n(n + 1)/2 in total.


def hard_sphere_limit(particles: int) -> HardSphereLimit:
    """
    Return restitution and numbers of events for a chain of hard spheres, NH section III.

    Each of the n velocities changes from -v0 to +v0 by one contact with the wall, and each pair of
    particles exchanges velocities once. Bonds with a hard core reach this limit at infinite speed.

    Parameters
    ----------
    particles : int
        Number of particles n.

    Returns
    -------
    HardSphereLimit
        eta = 1, n contacts with the wall and n(n + 1)/2 events.
    """
    return HardSphereLimit(1.0, particles, particles * (particles + 1) // 2)
