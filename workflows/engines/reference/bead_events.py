"""Build the events of bead columns: begin and end of contacts, and end of the collision."""

from collections.abc import Callable
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array

# The search for the time of an event takes at most _MOST_EVALUATIONS steps; mostly rounding ends
# the search earlier. _RESOLUTION is the relative resolution that rounding allows.
_MOST_EVALUATIONS = 100
_RESOLUTION = 4e-16


def build_end(bond: Callable, register: Callable) -> Callable:
    """Return ``is_over(run_state, arrays, parameters)``: whether no further contact can come."""

    @register
    def is_over(run_state: Any, arrays: Any, parameters: Any) -> bool:
        state, masses, rising, gap = arrays.state, arrays.masses, arrays.rising, run_state.gap
        beads = masses.shape[0]
        if run_state.touching or state[1 + gap] < 0.0:
            return False
        # The w of a bead is the mean of two velocities: the largest velocity up to this bead, and
        # the smallest velocity from this bead on.
        first = 1 if masses[0] == np.inf else 0
        top = 0.0 if first else -np.inf
        for i in range(first, beads):
            top = max(top, state[beads + i])
            rising[i] = 0.5 * top
        low = np.inf
        for i in range(beads - 1, first - 1, -1):
            low = min(low, state[beads + i])
            rising[i] += 0.5 * (max(low, 0.0) if first else low)
        if first:
            rising[0] = 0.0
        energy = 0.0
        for i in range(first, beads):
            energy += 0.5 * masses[i] * (state[beads + i] - rising[i]) ** 2
        for i in range(beads - 1):
            if i != gap and state[1 + i] < 0.0:
                # The force times the overlap is at least U, because the force rises with the
                # overlap.
                push = parameters.stiffness[i] * bond(state[1 + i], parameters.bond)
                energy -= state[1 + i] * push
        faster = np.sqrt(2.0 * energy * parameters.inverse[gap])
        faster += np.sqrt(2.0 * energy * parameters.inverse[gap + 1])
        return rising[gap + 1] - rising[gap] > faster

    return is_over


def build_bead_contact(register: Callable) -> tuple[Callable, Callable, Callable]:
    """Return three functions: momentum of the chain, end of a contact, begin of a contact."""

    @register
    def chain_momentum(state: Array, masses: Array, gap: int) -> float:
        total = 0.0
        for i in range(gap + 1, masses.shape[0]):
            total += masses[i] * state[masses.shape[0] + i]
        return total

    @register
    def end(run_state: Any, arrays: Any, given: float) -> None:
        state, strains = arrays.state, arrays.masses.shape[0] - 1
        state[1 + run_state.gap] = 0.0
        run_state.touching = 0
        run_state.last_contact = run_state.time
        arrays.contacts[2, run_state.contacts - 1] = given
        np.positive(state, arrays.last)
        for i in range(strains):
            if i != run_state.gap:
                run_state.strain_min = min(run_state.strain_min, state[1 + i])
                run_state.strain_max = max(run_state.strain_max, state[1 + i])
        run_state.contact_min, run_state.contact_max = run_state.strain_min, run_state.strain_max

    @register
    def begin(run_state: Any, arrays: Any, parameters: Any) -> None:
        # The gap is zero and closes: soft bodies begin to overlap; a contact of hard bodies begins
        # and ends.
        state, gap, contacts = arrays.state, run_state.gap, arrays.contacts
        beads = arrays.masses.shape[0]
        speed = state[beads + gap] - state[beads + gap + 1]
        contacts[0, run_state.contacts] = run_state.time
        contacts[1, run_state.contacts] = speed
        run_state.contacts += 1
        state[1 + gap] = 0.0
        if run_state.soft:
            run_state.touching = 1
            run_state.momentum = chain_momentum(state, arrays.masses, gap)
            return
        inverse = parameters.inverse
        given = 2.0 * speed / (inverse[gap] + inverse[gap + 1])
        state[beads + gap] -= given * inverse[gap]
        state[beads + gap + 1] += given * inverse[gap + 1]
        end(run_state, arrays, given)

    return chain_momentum, end, begin


def build_moment(take: Callable, register: Callable) -> Callable:
    """
    Return ``moment_of(step, sign, path)``: the time within a step at which sign*gap gets positive.

    `take` takes one step of any length.
    """

    @register
    def moment_of(step: float, sign: float, path: Any) -> float:
        # At first sign*gap is negative. Newton's method with a bracket finds the time at which it
        # becomes positive.
        arrays, gap = path.arrays, path.parameters.gap
        beads = arrays.masses.shape[0]
        low, high = 0.0, step
        below, above = sign * arrays.kept[1 + gap], sign * arrays.state[1 + gap]
        middle = step * below / (below - above)
        for _ in range(_MOST_EVALUATIONS):
            if not low < middle < high:
                middle = 0.5 * (low + high)
            take(arrays.kept, arrays.trial, arrays.trial_slopes, middle, path)
            found = sign * arrays.trial[1 + gap]
            rate = sign * (arrays.trial[beads + gap + 1] - arrays.trial[beads + gap])
            if found > 0.0:
                high = middle
            else:
                low = middle
            following = middle - found / rate if rate > 0.0 else low
            if abs(following - middle) <= _RESOLUTION * step or high - low <= _RESOLUTION * step:
                break
            middle = following
        return middle

    return moment_of
