r"""
Build the stages of a Verlet step as loops to be compiled.

The state consists of the distance of particle 1 from the wall, the bond strains :math:`s_i =
u_{i+1} - u_i` and the velocities :math:`v_i`. A slow chain then loses no digits to absolute
coordinates. The Verlet step has the position form, drift - kick - drift:

.. math:: s_i \to s_i + d\,(v_{i+1} - v_i), \qquad v_i \to v_i + (k/m_i)\,(F(s_{i-1}) - F(s_i)),

Here d and k are the durations of drift and kick, and F is the force -dU/dr. For two bodies, or a
soft wall, one of the strains is the gap. The force at the gap follows the contact law while the
bodies overlap, and is zero otherwise. The drifts of neighbouring steps merge. One stage of a
composition is therefore one drift and one kick, in a single pass through the bonds.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.damped_contact import build_mean_force
from chaincor.workflows.engines.reference.line_traits import (
    KernelSpec,
    LineTraits,
    read_parameters,
)

# Parameters are `LineParameters`, or the parameters of the force kernel if all masses are 1. Each
# potential has its own NamedTuple type for its parameters.
Parameters = Any

# Size of a cache line in bytes.
LINE = 64
_ON_A_LINE = LINE // 8


class State(NamedTuple):
    """State of bonds and particles; the position of particle 1 is stored separately."""

    strain: Array  #: Bond lengths less one; of shape (n - 1,).
    velocity: Array  #: Velocities, positive away from the wall; of shape (n,).

    @classmethod
    def room(cls, bonds: int) -> "State":
        """
        Return a state for a number of bonds, with uninitialised arrays.

        The arrays are aligned to cache lines. Vector stores across cache lines would delay the next
        stage, and an extrapolated step would take half as long again.
        """
        after = bonds + -bonds % _ON_A_LINE
        numbers = np.empty(after + bonds + _ON_A_LINE)
        first = -numbers.ctypes.data % LINE // 8
        return cls(numbers[first : first + bonds], numbers[first + after :][: bonds + 1])

    def copied(self) -> "State":
        """Return a copy with the same alignment in memory."""
        copy = State.room(len(self.strain))
        copy.strain[:] = self.strain
        copy.velocity[:] = self.velocity
        return copy


class VerletKernels(NamedTuple):
    """
    Functions for parts of a step; they act on `bonds` bonds and `bonds` + 1 velocities.

    The functions that are called in each stage take arrays, because unpacking a `State` would count
    references to its arrays, which costs as much as ten bonds.
    """

    #: ``start(old, strain, velocity, bonds, drift, kick, parameters)``: applies a drift and a kick
    #: to the `State` `old` and writes the result to the arrays.
    start: Callable
    #: ``stage(strain, velocity, bonds, drift, kick, parameters)``: applies a drift and a kick in
    #: place.
    stage: Callable
    drift: Callable  #: ``drift(strain, velocity, bonds, time)``: applies a drift in place.
    copy: Callable  #: ``copy(strain, velocity, new, bonds)``: copies into the `State` `new`.
    #: ``mix(state, old, mixture, bonds, drift, weight)``: applies a drift to `state`, and adds the
    #: difference from `old`, times the weight, to `mixture`.
    mix: Callable
    #: ``count_outside(strain, bonds, low, high, parameters)``: number of strains, without the gap,
    #: that are outside a range; a NaN is outside.
    count_outside: Callable
    #: ``extremes(strain, bonds, parameters)``: smallest and largest strain, without the gap; both
    #: are NaN if any strain is NaN.
    extremes: Callable
    #: ``are_allowed(run_state, strain, bonds, parameters)``: whether all strains are allowed;
    #: updates the smallest and largest strain in the run state.
    are_allowed: Callable


def looped_stages(source: KernelSpec) -> VerletKernels:
    """Return the stages as loops to be compiled."""
    register, wall = source.register, source.kind.at_wall
    read, push = read_parameters(source), source.register(source.kind.law.force_kernel)
    slice_parameters, force, over_mass = read.slice_parameters, read.force, read.over_mass
    drag = source.kind.law.drag_kernel
    damped = drag is not None
    mean_force = push if drag is None else build_mean_force(register(drag), register)

    def passing(in_place: bool) -> Callable:
        # One pass over the bonds computes each force once and uses it for both particles of the
        # bond. One pass needs less memory traffic than two passes, and LLVM can vectorise a loop
        # that reads ahead and writes behind. The in-place version is a separate function, because
        # LLVM does not vectorise a loop if its old and new arrays may be the same.
        @register
        def pass_bonds(
            bonds: int,
            behind: float,
            old: State,
            new: State,
            drift: float,
            kick: float,
            parameters: Parameters,
        ) -> float:
            strain, velocity = new
            old_strain, old_velocity = new if in_place else old
            for i in range(bonds):
                stretched = old_strain[i] + drift * (old_velocity[i + 1] - old_velocity[i])
                strain[i] = stretched
                ahead = force(stretched, parameters)
                velocity[i] = old_velocity[i] + over_mass(kick, i, parameters) * (behind - ahead)
                behind = ahead
            return behind

        # Bonds before the gap, the gap, and bonds behind the gap are treated separately, because a
        # branch at every bond would cost more than the force of the bond.
        @register
        def start(
            old: State,
            strain: Array,
            velocity: Array,
            bonds: int,
            drift: float,
            kick: float,
            parameters: Parameters,
        ) -> None:
            new = strain, velocity
            if not wall:
                old_strain, old_velocity = old
                gap = parameters.gap
                behind = pass_bonds(gap, 0.0, old, new, drift, kick, parameters)
                opened = old_strain[gap] + drift * (old_velocity[gap + 1] - old_velocity[gap])
                strain[gap] = opened
                ahead = push(opened, parameters.contact)
                if damped:
                    beyond = 0.0
                    if gap + 1 < bonds:
                        strain_rate = old_velocity[gap + 2] - old_velocity[gap + 1]
                        beyond = force(old_strain[gap + 1] + drift * strain_rate, parameters)
                    before, after = parameters.inverse[gap], parameters.inverse[gap + 1]
                    ahead = mean_force(
                        ahead,
                        opened,
                        old_velocity[gap + 1] - old_velocity[gap],
                        -(after * beyond + before * behind),
                        before + after,
                        kick,
                        parameters.contact,
                    )
                given = over_mass(kick, gap, parameters) * (behind - ahead)
                velocity[gap] = old_velocity[gap] + given
                # The loop runs over slices, because only loops that begin at 0 are vectorised. Any
                # other index might be negative and count from the end of an array.
                begin = gap + 1
                rest = bonds - begin
                old_rest = old_strain[begin:], old_velocity[begin:]
                new_rest = strain[begin:], velocity[begin:]
                light = slice_parameters(parameters, begin, bonds + 1)
                behind = pass_bonds(rest, ahead, old_rest, new_rest, drift, kick, light)
            else:
                behind = pass_bonds(bonds, 0.0, old, new, drift, kick, parameters)
            velocity[bonds] = old[1][bonds] + over_mass(kick, bonds, parameters) * behind

        return start

    start, in_place = passing(in_place=False), passing(in_place=True)

    @register
    def stage(
        strain: Array,
        velocity: Array,
        bonds: int,
        drift: float,
        kick: float,
        parameters: Parameters,
    ) -> None:
        in_place((strain, velocity), strain, velocity, bonds, drift, kick, parameters)

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

    looks = strain_scans(count_outside, register(bookkeeping.extremes), source.kind, register)
    return VerletKernels(start, stage, drift, copy, mix, *looks)


def strain_scans(count: Callable, spread: Callable, kind: LineTraits, register: Callable) -> tuple:
    """Return functions that scan all strains except the gap, made from scans of all strains."""
    wall, widen = kind.at_wall, register(bookkeeping.widen)

    @register
    def extremes(strain: Array, bonds: int, parameters: Parameters) -> tuple[float, float]:
        if wall:
            return spread(strain, bonds)
        place = parameters.gap
        low, high = spread(strain[:place], place)
        lower, higher = spread(strain[place + 1 :], bonds - place - 1)
        # The result is NaN if any strain is NaN.
        low = low if low <= lower or low != low else lower
        high = high if high >= higher or high != high else higher
        return low, high

    @register
    def count_outside(
        strain: Array, bonds: int, low: float, high: float, parameters: Parameters
    ) -> int:
        if wall:
            return count(strain, bonds, low, high)
        place = parameters.gap
        before = count(strain[:place], place, low, high)
        return before + count(strain[place + 1 :], bonds - place - 1, low, high)

    @register
    def are_allowed(run_state: Any, strain: Array, bonds: int, parameters: Parameters) -> bool:
        if count_outside(strain, bonds, run_state.strain_min, run_state.strain_max, parameters) > 0:
            low, high = extremes(strain, bonds, parameters)
            return widen(run_state, low, high)
        return True

    return count_outside, extremes, are_allowed
