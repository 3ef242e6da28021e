r"""
The equations of motion of the adaptive engine, as a loop for the compiler and as NumPy expressions.

The state is one array, :math:`(x_1, y_1 \dots y_{n-1}, v_1 \dots v_n)`. The coordinate y of a bond
is its strain or, for bonds that shrink without bound, the logarithm of its length:

.. math:: \dot x_1 = v_1, \qquad \dot y_i = \frac{v_{i+1} - v_i}{dr/dy}, \qquad
          \dot v_i = F(y_{i-1}) - F(y_i).
"""

from collections.abc import Callable

import numpy as np

from chaincor.workflows.engines.in_house.stages import Array, Parameters


def strain_bond(kernel: Callable) -> Callable:
    """
    Return what moves a bond whose coordinate is its strain.

    Parameters
    ----------
    kernel : callable
        -dU/dr of one strain, ``kernel(strain, parameters)``.

    Returns
    -------
    callable
        ``bond(strain, parameters)``: force and 1/(dr/dy), here 1.
    """

    def bond(strain: float, parameters: Parameters) -> tuple[float, float]:
        return kernel(strain, parameters), 1.0

    return bond


def looped_rates(bond: Callable) -> Callable:
    """
    Return the equations of motion as a loop, for a compiler.

    Parameters
    ----------
    bond : callable
        ``bond(y, parameters)``: force and 1/(dr/dy).

    Returns
    -------
    callable
        ``rates(state, out, parameters)``.
    """

    def rates(state: Array, out: Array, parameters: Parameters) -> None:
        bonds = state.shape[0] // 2 - 1
        velocity = bonds + 1
        out[0] = state[velocity]
        behind = 0.0
        for i in range(bonds):
            ahead, inverse_stretch = bond(state[1 + i], parameters)
            out[1 + i] = (state[velocity + i + 1] - state[velocity + i]) * inverse_stretch
            out[velocity + i] = behind - ahead
            behind = ahead
        out[velocity + bonds] = behind

    return rates


def array_rates(force: Callable) -> Callable:
    """
    Return the equations of motion in NumPy, for forces of the strain that cannot be compiled.

    Parameters
    ----------
    force : callable
        -dU/dr of an array of strains.

    Returns
    -------
    callable
        As :func:`looped_rates` returns it.
    """

    def rates(state: Array, out: Array, _parameters: Parameters) -> None:
        particles = state.shape[0] // 2
        velocity = state[particles:]
        forces = force(state[1:particles])
        out[0] = velocity[0]
        out[1:particles] = np.diff(velocity)
        out[particles:] = 0.0
        out[particles:-1] -= forces
        out[particles + 1 :] += forces

    return rates
