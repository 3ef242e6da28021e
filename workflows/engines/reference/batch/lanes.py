r"""
The chains of a batch, and their steps side by side, extrapolated or split, each of its own size.

A chain of twenty is too short for the vector units of a processor: its loops begin and end more
than they run. Here each chain has a SIMD lane: number i of lane k lies at :math:`i L + k`, and
loops run over all lanes. What is done to each number is what ``stages`` and ``schemes``
do, in the same order, so that a chain moves as it does alone, to the last bit.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.reference.line_traits import KernelSpec, read_parameters
from chaincor.workflows.engines.schemes import StepCoefficients

# L: a multiple of the width of every SIMD unit, so that there is no scalar remainder loop.
LANES = 16

# Not left yet; otherwise why it was, see ``bookkeeping``. Beyond that: its end was proved by the
# loop, none is found, one was.
MOVING = -1
PROVED, ENDLESS, ENDED = 5, 6, 7

# What is known of a chain's next move: nothing; that a contact ends it, or none; and that none
# does, which the same move had to show.
OPEN, MEETS, FREE, REPEATED = range(4)

Counts = NDArray[np.int64]


class LaneState(NamedTuple):
    """Chains side by side."""

    strain: Array  #: Bond lengths less one; of shape ((n - 1) L,).
    velocity: Array  #: Velocities, positive away from the wall; of shape (n L,).
    distance: Array  #: Of particle 1 from the wall; of shape (L,).

    @classmethod
    def of(cls, particles: int) -> "LaneState":
        """Return chains at rest."""
        bonds = (particles - 1) * LANES
        return cls(np.zeros(bonds), np.zeros(bonds + LANES), np.zeros(LANES))


class Room(NamedTuple):
    """Room for the steps of chains side by side."""

    trial: LaneState  #: What a step tries.
    #: The step H of each lane, and a part of it; of shape (L,).
    steps: Array
    share: Array  #: See ``steps``.
    parts: Array  #: That part repeated along the chain; of shape (n L,).
    forces: Array  #: Of the bonds, between zeros; of shape ((n + 1) L,).
    #: Inverse masses; 1 where all masses are, which nobody reads then; of shape (n L,).
    weights: Array


class Lanes(NamedTuple):
    """Chains side by side, and what they are moved with."""

    #: Before and after a step.
    old: LaneState
    new: LaneState  #: See ``old``.
    room: Room  #: For a step.

    @classmethod
    def of(cls, inverse: Array) -> "Lanes":
        """Return lanes for chains of these inverse masses, of shape (n,)."""
        particles = len(inverse)
        old, new, trial = (LaneState.of(particles) for _ in range(3))
        numbers = particles * LANES
        return cls(
            old,
            new,
            Room(
                trial=trial,
                steps=np.zeros(LANES),
                share=np.zeros(LANES),
                parts=np.zeros(numbers),
                forces=np.zeros(numbers + LANES),
                weights=np.repeat(inverse, LANES),
            ),
        )


class ChainRows(NamedTuple):
    """The chains of a batch, a row for each."""

    ledgers: np.recarray  #: See ``bookkeeping``; of shape (chains,).
    #: Now; of shape (chains, n - 1) and (chains, n).
    strains: Array
    velocities: Array  #: See ``strains``.
    #: The same right after the last contact.
    last_strains: Array
    last_velocities: Array  #: See ``last_strains``.
    #: Times, closing speeds, and the momentum given to the chain; of shape (chains, 3, capacity).
    contacts: Array
    energies: Array  #: Of each chain; of shape (chains,).
    steps: Array  #: H of each; of shape (chains,).
    goals: Counts  #: How many steps shall be done of each; of shape (chains,).
    statuses: Counts  #: Whether it moves, or why it does not; of shape (chains,).


class Queue(NamedTuple):
    """Some chains; the last to come is the first to go."""

    chains: Counts  #: Which, and room for all; of shape (chains,).
    held: Counts  #: How many; of shape (1,).

    @classmethod
    def of(cls, chains: int) -> "Queue":
        """Return an empty one with room for all."""
        return cls(np.zeros(chains, np.int64), np.zeros(1, np.int64))


class Places(NamedTuple):
    """Which chains are where in a batch."""

    waiting: Queue  #: Those whose contacts have to be searched.
    found: Queue  #: Those of which these are found.
    whose: Counts  #: Which chain is in a lane; -1 for none; of shape (L,).
    #: Its smallest and largest strain now; of shape (L,).
    low: Array
    high: Array  #: See ``low``.
    searched: Counts  #: Which chain's contact is searched in a lane; -1 for none; of shape (L,).

    @classmethod
    def of(cls, chains: int) -> "Places":
        """Return those of so many chains, none of which has begun."""
        nobody, low, high = np.full(LANES, -1), np.zeros(LANES), np.zeros(LANES)
        return cls(Queue.of(chains), Queue.of(chains), nobody, low, high, nobody.copy())


def build_lane_step(source: KernelSpec, split: bool) -> Callable:
    """
    Return one step of all lanes, which is split or else extrapolated.

    ``step(lanes, wanted, rule)`` leads from old states to new ones, see `Lanes`; of the bonds the
    first `wanted` are needed.
    """
    force, register = read_parameters(source).force, source.register
    if source.kind.unit:

        @register
        def pushed(j: int, kick: float, parts: Array, _weights: Array, force: float) -> float:
            return (kick * parts[j]) * force

    else:

        @register
        def pushed(j: int, kick: float, parts: Array, weights: Array, force: float) -> float:
            return (kick * parts[j]) * weights[j] * force

    @register
    def stage(
        state: LaneState, room: Room, drift: float, kick: float, bonds: int, parameters: Any
    ) -> None:
        # What the last particle is given is wrong where more bonds follow: then nobody needs it.
        strain, velocity, distance = state
        _, _, _, parts, forces, weights = room
        for k in range(LANES):
            distance[k] += (drift * parts[k]) * velocity[k]
        for j in range(bonds * LANES):
            stretched = strain[j] + (drift * parts[j]) * (velocity[j + LANES] - velocity[j])
            strain[j] = stretched
            forces[j + LANES] = force(stretched, parameters)
        for j in range((bonds + 1) * LANES):
            velocity[j] += pushed(j, kick, parts, weights, forces[j] - forces[j + LANES])

    @register
    def copy(old: Array, new: Array) -> None:
        for j in range(old.shape[0]):
            new[j] = old[j]

    @register
    def repeat(one: Array, along: Array) -> None:
        for i in range(along.shape[0] // LANES):
            for k in range(LANES):
                along[i * LANES + k] = one[k]

    def split_step(lanes: Lanes, wanted: int, rule: StepCoefficients) -> None:
        old, new, room = lanes
        drifts, kicks = rule.fractions
        strain, velocity, distance = new
        bonds = strain.shape[0] // LANES
        copy(old[0], strain)
        copy(old[1], velocity)
        copy(old[2], distance)
        repeat(room.steps, room.parts)
        for row in range(kicks.shape[0]):
            reach = min(bonds, wanted + kicks.shape[0] - row)
            stage(new, room, drifts[row], kicks[row], reach, rule.parameters)
        last = drifts[-1]
        for k in range(LANES):
            distance[k] += (last * room.steps[k]) * velocity[k]
        for j in range(strain.shape[0]):
            strain[j] += (last * room.parts[j]) * (velocity[j + LANES] - velocity[j])

    def extrapolated_step(lanes: Lanes, wanted: int, rule: StepCoefficients) -> None:
        old, new, room = lanes
        shares, counts = rule.fractions
        trial, steps, share, parts, _, _ = room
        first_strain, first_velocity, first_distance = old
        new_strain, new_velocity, moved = new
        strain, velocity, distance = trial
        bonds = strain.shape[0] // LANES
        copy(first_strain, new_strain)
        copy(first_velocity, new_velocity)
        moved[:] = 0.0
        for row in range(shares.shape[0]):
            weight, count = shares[row], int(counts[row])
            for k in range(LANES):
                share[k] = steps[k] / count
            repeat(share, parts)
            copy(first_strain, strain)
            copy(first_velocity, velocity)
            distance[:] = 0.0
            stage(trial, room, 0.5, 1.0, min(bonds, wanted + count), rule.parameters)
            for left in range(count - 1, 0, -1):
                stage(trial, room, 1.0, 1.0, min(bonds, wanted + left), rule.parameters)
            for k in range(LANES):
                distance[k] += (0.5 * parts[k]) * velocity[k]
                moved[k] += weight * distance[k]
            for j in range(wanted * LANES):
                drifted = strain[j] + (0.5 * parts[j]) * (velocity[j + LANES] - velocity[j])
                new_strain[j] += weight * (drifted - first_strain[j])
            for j in range((wanted + 1) * LANES):
                new_velocity[j] += weight * (velocity[j] - first_velocity[j])
        for k in range(LANES):
            moved[k] += first_distance[k]

    return split_step if split else extrapolated_step
