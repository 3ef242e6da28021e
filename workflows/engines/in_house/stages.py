r"""
One Verlet step of the chain, as loops for the compiler and as NumPy expressions.

State is the distance of particle 1 from the wall, the bond strains :math:`s_i = u_{i+1} - u_i` and
the velocities :math:`v_i`: a slow chain then loses no digits to its absolute coordinates. The step
is the position form, drift - kick - drift:

.. math:: s_i \to s_i + d\,(v_{i+1} - v_i), \qquad v_i \to v_i + k\,(F(s_{i-1}) - F(s_i)),

in which the drifts of neighbouring steps merge, so that one stage of a composition is one drift
and one kick, done in a single pass over the chain.
"""

from collections.abc import Callable

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential


def looped_stage(force: Callable) -> Callable:
    """
    Return one stage as a loop over the bonds, for a compiler.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain: ``force(strain, parameters)``.

    Returns
    -------
    callable
        ``stage(strain, velocity, bonds, drift, kick, parameters)``: changes the first `bonds` of
        its arrays in place, and one velocity more.
    """

    def stage(strain, velocity, bonds, drift, kick, parameters):
        # The force of the bond behind is carried along: reading ahead and writing behind is a
        # pattern that LLVM vectorises, and one pass costs less memory traffic than two.
        behind = 0.0
        for i in range(bonds):
            stretched = strain[i] + drift * (velocity[i + 1] - velocity[i])
            strain[i] = stretched
            ahead = force(stretched, parameters)
            velocity[i] += kick * (behind - ahead)
            behind = ahead
        velocity[bonds] += kick * behind

    return stage


def looped_copy(strain, velocity, new_strain, new_velocity, bonds):
    """
    Copy a state, as a loop.

    Parameters
    ----------
    strain, velocity, new_strain, new_velocity : ndarray
        The state and its copy.
    bonds : int
        How many of the bonds, and one velocity more.
    """
    for i in range(bonds):
        new_strain[i] = strain[i]
        new_velocity[i] = velocity[i]
    new_velocity[bonds] = velocity[bonds]


def looped_drift(strain, velocity, bonds, drift):
    """
    Move the particles freely, as a loop.

    Parameters
    ----------
    strain : ndarray of shape (n - 1,)
        Changed in place.
    velocity : ndarray of shape (n,)
        Velocities.
    bonds : int
        How many of the bonds.
    drift : float
        Time.
    """
    for i in range(bonds):
        strain[i] += drift * (velocity[i + 1] - velocity[i])


def looped_start(force: Callable) -> Callable:
    """
    Return one stage from one state into another, as a loop over the bonds.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain: ``force(strain, parameters)``.

    Returns
    -------
    callable
        ``start(strain, velocity, new_strain, new_velocity, bonds, drift, kick, parameters)``.
    """

    def start(strain, velocity, new_strain, new_velocity, bonds, drift, kick, parameters):
        behind = 0.0
        for i in range(bonds):
            stretched = strain[i] + drift * (velocity[i + 1] - velocity[i])
            new_strain[i] = stretched
            ahead = force(stretched, parameters)
            new_velocity[i] = velocity[i] + kick * (behind - ahead)
            behind = ahead
        new_velocity[bonds] = velocity[bonds] + kick * behind

    return start


def looped_mix(
    strain, velocity, old_strain, old_velocity, bonds, drift, weight, mix_strain, mix_velocity
):
    """
    Let the particles move freely and add the change since an old state, weighted, to a mixture.

    Parameters
    ----------
    strain, velocity : ndarray of shape (n - 1,) and (n,)
        State before the drift; not changed.
    old_strain, old_velocity : ndarray of shape (n - 1,) and (n,)
        The old state.
    bonds : int
        How many of the bonds, and one velocity more.
    drift, weight : float
        Time and weight.
    mix_strain, mix_velocity : ndarray of shape (n - 1,) and (n,)
        The mixture, changed in place.
    """
    for i in range(bonds):
        moved = strain[i] + drift * (velocity[i + 1] - velocity[i])
        mix_strain[i] += weight * (moved - old_strain[i])
    for i in range(bonds + 1):
        mix_velocity[i] += weight * (velocity[i] - old_velocity[i])


def looped_outside(strain, bonds, low, high):
    """
    Count the strains outside a range, as a loop; what is not a number is outside.

    Parameters
    ----------
    strain : ndarray of shape (n - 1,)
        Strains.
    bonds : int
        How many of them.
    low, high : float
        The range.

    Returns
    -------
    int
        How many are outside.
    """
    outside = 0
    for i in range(bonds):
        outside += not (low <= strain[i] <= high)
    return outside


def array_stage(bond: Potential) -> Callable:
    """
    Return one stage in NumPy, for forces that cannot be compiled.

    Parameters
    ----------
    bond : Potential
        Its `force` is called with arrays.

    Returns
    -------
    callable
        As :func:`looped_stage` returns it.
    """

    def stage(strain, velocity, bonds, drift, kick, _parameters):
        array_drift(strain, velocity, bonds, drift)
        impulse = kick * bond.force(strain[:bonds])
        velocity[:bonds] -= impulse
        velocity[1 : bonds + 1] += impulse

    return stage


def array_start(bond: Potential) -> Callable:
    """
    Return one stage from one state into another, in NumPy.

    Parameters
    ----------
    bond : Potential
        Its `force` is called with arrays.

    Returns
    -------
    callable
        As :func:`looped_start` returns it.
    """
    stage = array_stage(bond)

    def start(strain, velocity, new_strain, new_velocity, bonds, drift, kick, parameters):
        array_copy(strain, velocity, new_strain, new_velocity, bonds)
        stage(new_strain, new_velocity, bonds, drift, kick, parameters)

    return start


def array_mix(
    strain, velocity, old_strain, old_velocity, bonds, drift, weight, mix_strain, mix_velocity
):
    """
    Let the particles move freely and add the change since an old state, weighted, to a mixture.

    Parameters
    ----------
    strain, velocity, old_strain, old_velocity, bonds, drift, weight, mix_strain, mix_velocity
        As in :func:`looped_mix`.
    """
    near, ends = slice(bonds), slice(bonds + 1)
    moved = strain[near] + drift * np.diff(velocity[ends])
    mix_strain[near] += weight * (moved - old_strain[near])
    mix_velocity[ends] += weight * (velocity[ends] - old_velocity[ends])


def array_copy(strain, velocity, new_strain, new_velocity, bonds):
    """
    Copy a state, in NumPy.

    Parameters
    ----------
    strain, velocity, new_strain, new_velocity, bonds
        As in :func:`looped_copy`.
    """
    new_strain[:bonds] = strain[:bonds]
    new_velocity[: bonds + 1] = velocity[: bonds + 1]


def array_drift(strain, velocity, bonds, drift):
    """
    Move the particles freely, in NumPy.

    Parameters
    ----------
    strain : ndarray of shape (n - 1,)
        Changed in place.
    velocity : ndarray of shape (n,)
        Velocities.
    bonds : int
        How many of the bonds.
    drift : float
        Time.
    """
    strain[:bonds] += drift * np.diff(velocity[: bonds + 1])


def array_outside(strain, bonds, low, high):
    """
    Count the strains outside a range, in NumPy; what is not a number is outside.

    Parameters
    ----------
    strain : ndarray of shape (n - 1,)
        Strains.
    bonds : int
        How many of them.
    low, high : float
        The range.

    Returns
    -------
    int
        How many are outside.
    """
    strain = strain[:bonds]
    return int(np.count_nonzero(~((strain >= low) & (strain <= high))))
