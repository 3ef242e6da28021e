"""Build one step of beads and its error, in loops that compilers can vectorise."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.adaptive_loops import build_estimate


def bead_rates(
    bond: Callable, contact: Callable, drag: Callable | None, register: Callable
) -> Callable:
    """
    Return the equations of motion ``rates(state, out, parameters)``.

    `drag` computes the damping of the contact law. Without `drag`, the contact has the damping of
    the bonds.
    """
    own = drag is not None
    drag_of = contact if drag is None else drag

    @partial(register, inline=False)
    def damp(state: Array, out: Array, parameters: Any) -> float:
        # Subtract the damping forces from the forces in out[1:], and return the rate at which
        # damping dissipates energy.
        beads = state.shape[0] // 2
        loss = 0.0
        for i in range(beads - 1):
            strain, ahead = state[1 + i], out[1 + i]
            factor = 0.0
            if own and i == parameters.gap:
                factor = drag_of(strain, parameters.contact)
            elif parameters.damping > 0.0 and strain < 0.0:
                factor = parameters.damping * (-strain) ** parameters.damping_power
            if factor > 0.0 and (i != parameters.gap or ahead > 0.0):
                opening = state[beads + i + 1] - state[beads + i]
                taken = min(factor * opening, ahead)  # beads that separate do not attract
                out[1 + i] = ahead - taken
                loss += taken * opening
        return loss

    def rates(state: Array, out: Array, parameters: Any) -> None:
        beads = state.shape[0] // 2
        gap = parameters.gap
        # The places of the rates of strains hold forces first.
        strains, forces, stiffness = state[1:beads], out[1:beads], parameters.stiffness
        for i in range(beads - 1):
            forces[i] = stiffness[i] * bond(strains[i], parameters.bond)
        forces[gap] = contact(strains[gap], parameters.contact)
        out[2 * beads] = 0.0
        if own or parameters.damping > 0.0:
            out[2 * beads] = damp(state, out, parameters)
        accelerations, inverse = out[beads : 2 * beads], parameters.inverse
        accelerations[0] = -forces[0] * inverse[0]
        for i in range(1, beads - 1):
            accelerations[i] = (forces[i - 1] - forces[i]) * inverse[i]
        accelerations[beads - 1] = forces[beads - 2] * inverse[beads - 1]
        velocities = state[beads : 2 * beads]
        out[0] = velocities[0]
        for i in range(beads - 1):
            forces[i] = velocities[i + 1] - velocities[i]

    return rates


def build_bead_step(rates: Callable, register: Callable) -> tuple[Callable, Callable]:
    """
    Return ``take``, one step of any size, and ``estimate``, the ratio of its error to the allowed.

    Both work on a `BeadPath`, as those of :func:`.adaptive_loops.build_step` work on its path.
    """
    extremes = register(bookkeeping.extremes)

    @partial(register, inline=False)
    def add(slopes: Array, weights: Array, step: float, result: Array) -> None:
        # Add the weighted slopes to the result, four in each pass; weights of zero are skipped.
        size, count = result.shape[0], weights.shape[0]
        j = 0
        while j < count:
            first, second, third, fourth = 0, 0, 0, 0
            a, b, c, d = 0.0, 0.0, 0.0, 0.0
            found = 0
            while j < count and found < 4:
                if weights[j] != 0.0:
                    if found == 0:
                        first, a = j, step * weights[j]
                    elif found == 1:
                        second, b = j, step * weights[j]
                    elif found == 2:
                        third, c = j, step * weights[j]
                    else:
                        fourth, d = j, step * weights[j]
                    found += 1
                j += 1
            p, q, r, s = slopes[first], slopes[second], slopes[third], slopes[fourth]
            for i in range(size):
                result[i] += (a * p[i] + b * q[i]) + (c * r[i] + d * s[i])

    @partial(register, inline=False)
    def take(start: Array, result: Array, slopes: Array, step: float, path: Any) -> None:
        # Take one step; slopes[0] must hold the rates at its start.
        a, b, parameters = path.method.a, path.method.b, path.parameters
        stages = b.shape[0]
        for s in range(1, stages):
            np.positive(start, result)
            add(slopes, a[s, :s], step, result)
            rates(result, slopes[s], parameters)
        np.positive(start, result)
        add(slopes, b, step, result)
        rates(result, slopes[stages], parameters)

    @register
    def largest(weights: Array, error: Array, path: Any) -> float:
        error[:] = 0.0
        add(path.arrays.slopes, weights, 1.0, error)
        np.abs(error, error)
        np.divide(error, path.arrays.scale, error)
        return extremes(error, error.shape[0])[1]

    return take, build_estimate(largest, register)
