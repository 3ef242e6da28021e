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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential

Array = NDArray[np.float64]
# What a force kernel is told: a NamedTuple, one kind for each potential.
Parameters = tuple[float, ...]

# Bytes that processors move between memory and caches at once.
LINE = 64
_ON_A_LINE = LINE // 8


class State(NamedTuple):
    """
    Bonds and particles of a chain; where particle 1 is, is told beside it.

    Attributes
    ----------
    strain : ndarray of shape (n - 1,)
        Bond lengths less one.
    velocity : ndarray of shape (n,)
        Velocities, positive away from the wall.
    """

    strain: Array
    velocity: Array

    @classmethod
    def room(cls, bonds: int) -> "State":
        """
        Return a state for so many bonds, whose numbers are still to come.

        Parameters
        ----------
        bonds : int
            One less than particles.

        Returns
        -------
        State
            Arrays that begin with a line of the processor's memory: what vectors write across two
            lines, the next stage waits for, and an extrapolated step takes half as long again.
        """
        after = bonds + -bonds % _ON_A_LINE
        numbers = np.empty(after + bonds + _ON_A_LINE)
        first = -numbers.ctypes.data % LINE // 8
        return cls(numbers[first : first + bonds], numbers[first + after :][: bonds + 1])

    def copied(self) -> "State":
        """Return a copy, as well placed."""
        copy = State.room(len(self.strain))
        copy.strain[:] = self.strain
        copy.velocity[:] = self.velocity
        return copy


class Stages(NamedTuple):
    """
    What steps are made of, for one potential; all work on the first `bonds`, and one velocity more.

    What is done at every stage takes arrays: to take a `State` apart counts references to them,
    which costs as much as ten bonds.

    Attributes
    ----------
    start : callable
        ``start(old, strain, velocity, bonds, drift, kick, parameters)``: a drift and a kick from
        an old `State` into arrays.
    stage : callable
        ``stage(strain, velocity, bonds, drift, kick, parameters)``: the same in place.
    drift : callable
        ``drift(strain, velocity, bonds, time)``: free motion, in place.
    copy : callable
        ``copy(strain, velocity, new, bonds)``: into the `State` `new`.
    mix : callable
        ``mix(state, old, mixture, bonds, drift, weight)``: adds to the mixture, weighted, how the
        state differs from an old one after a drift.
    count_outside : callable
        ``count_outside(strain, bonds, low, high)``: strains outside a range; what is not a number
        is outside.
    extremes : callable
        ``extremes(strain, bonds)``: smallest and largest strain; no number where one is none.
    """

    start: Callable
    stage: Callable
    drift: Callable
    copy: Callable
    mix: Callable
    count_outside: Callable
    extremes: Callable


def looped_stages(force: Callable, register: Callable) -> Stages:
    """
    Return the stages as loops, for a compiler.

    Parameters
    ----------
    force : callable
        -dU/dr of one strain: ``force(strain, parameters)``; known to the compiler.
    register : callable
        Makes a function known to the compiler, or leaves it as it is.

    Returns
    -------
    Stages
        The loops.
    """

    # The force of the bond behind is carried along: reading ahead and writing behind is a pattern
    # that LLVM vectorises, and one pass costs less memory traffic than two.
    @register
    def start(
        old: State,
        new_strain: Array,
        new_velocity: Array,
        bonds: int,
        drift: float,
        kick: float,
        parameters: Parameters,
    ) -> None:
        strain, velocity = old
        behind = 0.0
        for i in range(bonds):
            stretched = strain[i] + drift * (velocity[i + 1] - velocity[i])
            new_strain[i] = stretched
            ahead = force(stretched, parameters)
            new_velocity[i] = velocity[i] + kick * (behind - ahead)
            behind = ahead
        new_velocity[bonds] = velocity[bonds] + kick * behind

    @register
    def stage(
        strain: Array,
        velocity: Array,
        bonds: int,
        drift: float,
        kick: float,
        parameters: Parameters,
    ) -> None:
        behind = 0.0
        for i in range(bonds):
            stretched = strain[i] + drift * (velocity[i + 1] - velocity[i])
            strain[i] = stretched
            ahead = force(stretched, parameters)
            velocity[i] += kick * (behind - ahead)
            behind = ahead
        velocity[bonds] += kick * behind

    @register
    def drift(strain: Array, velocity: Array, bonds: int, time: float) -> None:
        for i in range(bonds):
            strain[i] += time * (velocity[i + 1] - velocity[i])

    @register
    def copy(strain: Array, velocity: Array, new: State, bonds: int) -> None:
        new_strain, new_velocity = new
        for i in range(bonds):
            new_strain[i] = strain[i]
            new_velocity[i] = velocity[i]
        new_velocity[bonds] = velocity[bonds]

    @register
    def mix(
        state: State, old: State, mixture: State, bonds: int, drift: float, weight: float
    ) -> None:
        strain, velocity = state
        old_strain, old_velocity = old
        mix_strain, mix_velocity = mixture
        for i in range(bonds):
            moved = strain[i] + drift * (velocity[i + 1] - velocity[i])
            mix_strain[i] += weight * (moved - old_strain[i])
        for i in range(bonds + 1):
            mix_velocity[i] += weight * (velocity[i] - old_velocity[i])

    @register
    def count_outside(strain: Array, bonds: int, low: float, high: float) -> int:
        outside = 0
        for i in range(bonds):
            outside += not (low <= strain[i] <= high)
        return outside

    @register
    def extremes(strain: Array, bonds: int) -> tuple[float, float]:
        low = high = strain[0]
        for i in range(1, bonds):
            # Also true of what is not a number, which stays.
            if not low <= strain[i] and low == low:
                low = strain[i]
            if not high >= strain[i] and high == high:
                high = strain[i]
        return low, high

    return Stages(start, stage, drift, copy, mix, count_outside, extremes)


def array_stages(bond: Potential) -> Stages:
    """
    Return the stages in NumPy, for forces that cannot be compiled.

    Parameters
    ----------
    bond : Potential
        Its `force` is called with arrays.

    Returns
    -------
    Stages
        The same as NumPy expressions.
    """

    def start(
        old: State,
        strain: Array,
        velocity: Array,
        bonds: int,
        drift: float,
        kick: float,
        parameters: Parameters,
    ) -> None:
        copy(old.strain, old.velocity, State(strain, velocity), bonds)
        stage(strain, velocity, bonds, drift, kick, parameters)

    def stage(
        strain: Array,
        velocity: Array,
        bonds: int,
        time: float,
        kick: float,
        _parameters: Parameters,
    ) -> None:
        drift(strain, velocity, bonds, time)
        impulse = kick * bond.force(strain[:bonds])
        velocity[:bonds] -= impulse
        velocity[1 : bonds + 1] += impulse

    def drift(strain: Array, velocity: Array, bonds: int, time: float) -> None:
        strain[:bonds] += time * np.diff(velocity[: bonds + 1])

    def copy(strain: Array, velocity: Array, new: State, bonds: int) -> None:
        new.strain[:bonds] = strain[:bonds]
        new.velocity[: bonds + 1] = velocity[: bonds + 1]

    def mix(
        state: State, old: State, mixture: State, bonds: int, drift: float, weight: float
    ) -> None:
        near, ends = slice(bonds), slice(bonds + 1)
        moved = state.strain[near] + drift * np.diff(state.velocity[ends])
        mixture.strain[near] += weight * (moved - old.strain[near])
        mixture.velocity[ends] += weight * (state.velocity[ends] - old.velocity[ends])

    def count_outside(strain: Array, bonds: int, low: float, high: float) -> int:
        strain = strain[:bonds]
        return int(np.count_nonzero(~((strain >= low) & (strain <= high))))

    def extremes(strain: Array, bonds: int) -> tuple[float, float]:
        return float(np.min(strain[:bonds])), float(np.max(strain[:bonds]))

    return Stages(start, stage, drift, copy, mix, count_outside, extremes)
