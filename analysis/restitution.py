"""Coefficient of restitution, and the division of energy into translation and vibration."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential


def centre_of_mass_velocity(velocities: ArrayLike, masses: ArrayLike | None = None) -> Array:
    r"""
    Return :math:`\bar v = \sum_i m_i v_i / \sum_i m_i`.

    Parameters
    ----------
    velocities : array_like of shape (..., n)
        Particle velocities.
    masses : array_like of shape (n,), optional
        Particle masses; 1 by default.

    Returns
    -------
    numpy.ndarray of shape (...)
        Velocity of the centre of mass.
    """
    v = np.asarray(velocities, dtype=float)
    if masses is None:
        return np.mean(v, axis=-1)
    m = np.asarray(masses, dtype=float)
    return np.sum(m * v, axis=-1) / np.sum(m)


def kinematic_restitution(
    velocities: ArrayLike, impact_velocity: float, masses: ArrayLike | None = None
) -> Array:
    r"""
    Return the kinematic coefficient :math:`e = \bar v / v_0`, a ratio of speeds.

    For a chain that has left the wall :math:`e = \sqrt\eta`; while it still approaches, e < 0.

    Parameters
    ----------
    velocities : array_like of shape (..., n)
        Particle velocities, positive away from the wall.
    impact_velocity : float
        Impact speed v0 > 0.
    masses : array_like of shape (n,), optional
        Particle masses; 1 by default.

    Returns
    -------
    numpy.ndarray of shape (...)
        Velocity of the centre of mass divided by the impact speed.
    """
    return centre_of_mass_velocity(velocities, masses) / impact_velocity


def restitution(
    velocities: ArrayLike, impact_velocity: float, masses: ArrayLike | None = None
) -> Array:
    r"""
    Return the coefficient of restitution :math:`\eta = (\bar v / v_0)^2`, a ratio of energies.

    This is K_r/K_i of Nagahiro and Hayakawa, Phys. Rev. E 67, 036609 (2003), eq. (1): the final
    kinetic energy of the centre of mass divided by the initial one. eta does not change after the
    last contact. Other authors call the ratio of speeds restitution; see
    :func:`kinematic_restitution`.

    Parameters
    ----------
    velocities : array_like of shape (..., n)
        Particle velocities at any moment after the last contact.
    impact_velocity : float
        Impact speed v0 > 0.
    masses : array_like of shape (n,), optional
        Particle masses; 1 by default.

    Returns
    -------
    numpy.ndarray of shape (...)
        Coefficient of restitution, at least 0, and at most 1 for a chain that was cold before the
        collision.
    """
    return np.square(kinematic_restitution(velocities, impact_velocity, masses))


@dataclass(frozen=True)
class EnergySplit:
    """Parts of the energy of a chain, in units of mass times speed squared."""

    #: Kinetic energy of the centre of mass, M V^2/2, with the mass M of the chain; of shape (...).
    translation: Array
    internal_kinetic: Array  #: Kinetic energy relative to the centre of mass; of shape (...).
    bonds: Array  #: Potential energy of all bonds; of shape (...).

    @property
    def vibration(self) -> Array:
        """Internal energy: all energy except the translational energy."""
        return self.internal_kinetic + self.bonds

    @property
    def total(self) -> Array:
        """Translation and vibration together."""
        return self.translation + self.vibration


def bond_strains(displacements: ArrayLike) -> Array:
    """
    Return the strains s_i = u_(i+1) - u_i of all bonds.

    Parameters
    ----------
    displacements : array_like of shape (..., n)
        u_i = x_i - (i - 1).

    Returns
    -------
    numpy.ndarray of shape (..., n - 1)
        Bond lengths minus 1.
    """
    return np.diff(np.asarray(displacements, dtype=float), axis=-1)


def energy_split(
    displacements: ArrayLike,
    velocities: ArrayLike,
    bond: Potential,
    masses: ArrayLike | None = None,
) -> EnergySplit:
    """
    Split the energy of a chain into translation and vibration.

    Parameters
    ----------
    displacements : array_like of shape (..., n)
        u_i = x_i - (i - 1).
    velocities : array_like of shape (..., n)
        Particle velocities.
    bond : Potential
        The bonds' potential.
    masses : array_like of shape (n,), optional
        Particle masses; 1 by default.

    Returns
    -------
    EnergySplit
        Parts of the energy in each frame.
    """
    v = np.asarray(velocities, dtype=float)
    m = np.ones(v.shape[-1]) if masses is None else np.asarray(masses, dtype=float)
    mean = centre_of_mass_velocity(v, m)
    return EnergySplit(
        translation=0.5 * float(np.sum(m)) * mean**2,
        internal_kinetic=0.5 * np.sum(m * (v - mean[..., None]) ** 2, axis=-1),
        bonds=np.sum(bond.energy(bond_strains(displacements)), axis=-1),
    )


def momentum_residual(
    velocities: ArrayLike,
    impact_velocity: float,
    contact_speeds: ArrayLike,
    masses: ArrayLike | None = None,
) -> float:
    """
    Return the momentum that the impulses of the contacts do not explain, in units of M v0.

    Contact q reverses the velocity of particle 1, and so gives the chain the momentum 2 m_1 v_q.
    For any bonds, the expected momentum is therefore P = -M v0 + 2 m_1 sum(v_q).

    Parameters
    ----------
    velocities : array_like of shape (n,)
        Velocities after the contacts.
    impact_velocity : float
        Impact speed v0.
    contact_speeds : array_like of shape (contacts,)
        Incoming speeds of particle 1 at all contacts, including the first; all positive.
    masses : array_like of shape (n,), optional
        Particle masses, particle 1 first; 1 by default.

    Returns
    -------
    float
        (P - expected P)/(M v0), which is a rounding error if the list of contacts is complete.
    """
    v = np.asarray(velocities, dtype=float)
    m = np.ones(v.size) if masses is None else np.asarray(masses, dtype=float)
    total = float(np.sum(m))
    expected = -total * impact_velocity + 2.0 * m[0] * np.sum(contact_speeds)
    return float((np.sum(m * v) - expected) / (total * impact_velocity))
