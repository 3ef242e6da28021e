r"""
Move many chains side by side in SIMD lanes, each with its own time step.

A chain of twenty particles is too short for the vector units of a processor, because its loops
spend most of their time at their beginnings and ends. Here each chain has a SIMD lane. Element i of
lane k is stored at the index :math:`i L + k`, and loops run through all lanes. The arithmetic for
each chain has the same order as in ``stages`` and ``schemes``. A chain in a lane therefore moves
exactly like a single chain, to the last bit.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.reference.line_traits import KernelSpec, read_parameters
from chaincor.workflows.engines.schemes import StepCoefficients

# The number L of lanes is a multiple of the width of every SIMD unit. Loops then have no scalar
# remainder.
LANES = 16

# A chain in motion has the status MOVING. The other statuses give the reason why a chain stopped: a
# reason from ``bookkeeping``, an end that the loop proved (PROVED), no end within the allowed
# simulated time (ENDLESS), or an end that is already recorded (ENDED).
MOVING = -1
PROVED, ENDLESS, ENDED = 5, 6, 7

# States of the next move of a chain: it is unknown whether a contact ends the move (OPEN); a
# contact ends the move (MEETS); no contact ends the move (FREE); no contact ends the move, whose
# first attempt had to be undone (REPEATED).
OPEN, MEETS, FREE, REPEATED = range(4)

# A chain moves by whole steps; a contact divides its step into several moves.
MOVE: Any = np.dtype(
    (
        np.record,
        [
            ("begun", "f8"),  # time at which the step of the chain began
            ("left", "f8"),  # time left in this step
            ("duration", "f8"),  # duration of the next move
            ("known", "i8"),  # state of this move: OPEN, MEETS, FREE or REPEATED
        ],
    )
)

Counts = NDArray[np.int64]


class LaneState(NamedTuple):
    """State of chains side by side."""

    strain: Array  #: Bond lengths less one; of shape ((n - 1) L,).
    velocity: Array  #: Velocities, positive away from the wall; of shape (n L,).
    distance: Array  #: Distance of particle 1 from the wall; of shape (L,).

    @classmethod
    def of(cls, particles: int) -> "LaneState":
        """Return the state of chains without motion."""
        bonds = (particles - 1) * LANES
        return cls(np.zeros(bonds), np.zeros(bonds + LANES), np.zeros(LANES))


class Room(NamedTuple):
    """Scratch arrays for the steps of chains side by side."""

    trial: LaneState  #: State within a step.
    #: Step H of each lane; of shape (L,).
    steps: Array
    share: Array  #: Length of a part of the step in each lane; of shape (L,).
    parts: Array  #: Length of the part, repeated for each particle; of shape (n L,).
    forces: Array  #: Forces of the bonds, with zeros before and after; of shape ((n + 1) L,).
    #: Inverse masses, of shape (n L,); not used if all masses are 1.
    weights: Array


class Lanes(NamedTuple):
    """Chains side by side, with the arrays of their steps."""

    #: State before a step.
    old: LaneState
    new: LaneState  #: State after a step.
    room: Room  #: Scratch arrays of a step.

    @classmethod
    def of(cls, inverse: Array) -> "Lanes":
        """Return lanes for chains of the given inverse masses, of shape (n,)."""
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
    """Arrays for the chains of a batch; each row belongs to one chain."""

    run_states: np.recarray  #: Scalar variables, see ``bookkeeping``; of shape (chains,).
    moves: np.recarray  #: Present move of each chain, see `MOVE`; of shape (chains,).
    #: Current strains; of shape (chains, n - 1).
    strains: Array
    velocities: Array  #: Current velocities; of shape (chains, n).
    #: Strains right after the last contact; of shape (chains, n - 1).
    last_strains: Array
    last_velocities: Array  #: Velocities right after the last contact; of shape (chains, n).
    #: Times, closing speeds and impulses of the contacts; of shape (chains, 3, capacity).
    contacts: Array
    energies: Array  #: Initial energy of each chain; of shape (chains,).
    steps: Array  #: Step H of each chain; of shape (chains,).
    target_steps: Counts  #: Number of steps at which the chain stops; of shape (chains,).
    statuses: Counts  #: MOVING, or the reason why the chain has stopped; of shape (chains,).


class Queue(NamedTuple):
    """Stack of chains: last in, first out."""

    chains: Counts  #: Indices of the chains, with room for all chains; of shape (chains,).
    held: Counts  #: Number of chains on the stack; of shape (1,).

    @classmethod
    def of(cls, chains: int) -> "Queue":
        """Return an empty stack with room for all chains."""
        return cls(np.zeros(chains, np.int64), np.zeros(1, np.int64))


class Places(NamedTuple):
    """Places at which the chains of a batch are processed."""

    waiting: Queue  #: Chains that wait for a search for a contact.
    found: Queue  #: Chains for which a contact has been found or excluded.
    whose: Counts  #: Chain in each lane; -1 for none; of shape (L,).
    #: Smallest present strain of the chain in each lane; of shape (L,).
    low: Array
    high: Array  #: Largest present strain of the chain in each lane; of shape (L,).
    #: Chain whose contact is searched for in each lane; -1 for none; of shape (L,).
    searched: Counts

    @classmethod
    def of(cls, chains: int) -> "Places":
        """Return the places before any chain has begun."""
        nobody, low, high = np.full(LANES, -1), np.zeros(LANES), np.zeros(LANES)
        return cls(Queue.of(chains), Queue.of(chains), nobody, low, high, nobody.copy())


def build_lane_step(source: KernelSpec, split: bool) -> Callable:
    """
    Return the function that takes one split or extrapolated step in all lanes.

    ``step(lanes, wanted, rule)`` computes the new states from the old states, see `Lanes`. The
    caller needs only the first `wanted` bonds after the step.
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
        # If the chain has further bonds, the new velocity of the last particle is wrong and is not
        # used.
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
