"""Build the stages of a Verlet step as NumPy expressions, for forces that cannot be compiled."""

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.workflows.engines.reference.damped_contact import build_mean_force
from chaincor.workflows.engines.reference.line_traits import PLAIN, LineTraits, unregistered
from chaincor.workflows.engines.reference.stages import (
    Parameters,
    State,
    VerletKernels,
    strain_scans,
)


def array_stages(bond: Potential, kind: LineTraits = PLAIN) -> VerletKernels:
    """Return the stages in NumPy, for forces that cannot be compiled."""
    drag = kind.law.drag_kernel
    mean_force = None if drag is None else build_mean_force(drag, unregistered)

    def start(
        old: State,
        strain: Array,
        velocity: Array,
        bonds: int,
        drift: float,
        kick: float,
        parameters: Parameters,
    ) -> None:
        copy(*old, State(strain, velocity), bonds)
        stage(strain, velocity, bonds, drift, kick, parameters)

    def stage(
        strain: Array,
        velocity: Array,
        bonds: int,
        time: float,
        kick: float,
        parameters: Parameters,
    ) -> None:
        drift(strain, velocity, bonds, time)
        if kind.unit:
            impulse = kick * bond.force(strain[:bonds])
            velocity[:bonds] -= impulse
            velocity[1 : bonds + 1] += impulse
            return
        forces = strain[:bonds].copy()
        if kind.at_wall:
            forces = bond.force(forces)
        else:
            gap = parameters.gap
            forces[:gap], forces[gap + 1 :] = (
                bond.force(forces[:gap]),
                bond.force(forces[gap + 1 :]),
            )
            pushed = kind.law.force_kernel(strain[gap], parameters.contact)
            if mean_force is not None:
                around = np.concatenate(([0.0], forces[:gap], [0.0], forces[gap + 1 :], [0.0]))
                before, after = parameters.inverse[gap], parameters.inverse[gap + 1]
                pushed = mean_force(
                    pushed,
                    strain[gap],
                    velocity[gap + 1] - velocity[gap],
                    -(after * around[gap + 2] + before * around[gap]),
                    before + after,
                    kick,
                    parameters.contact,
                )
            forces[gap] = pushed
        pushes = np.concatenate((-forces, [0.0])) + np.concatenate(([0.0], forces))
        velocity[: bonds + 1] += kick * parameters.inverse[: bonds + 1] * pushes

    def drift(strain: Array, velocity: Array, bonds: int, time: float) -> None:
        strain[:bonds] += time * np.diff(velocity[: bonds + 1])

    def copy(strain: Array, velocity: Array, new: State, bonds: int) -> None:
        new_strain, new_velocity = new
        new_strain[:bonds] = strain[:bonds]
        new_velocity[: bonds + 1] = velocity[: bonds + 1]

    def mix(
        state: State, old: State, mixture: State, bonds: int, drift: float, weight: float
    ) -> None:
        strain, velocity = state[0][:bonds], state[1][: bonds + 1]
        old_strain, old_velocity = old[0][:bonds], old[1][: bonds + 1]
        moved = strain + drift * np.diff(velocity)
        mixture[0][:bonds] += weight * (moved - old_strain)
        mixture[1][: bonds + 1] += weight * (velocity - old_velocity)

    def count_outside(strain: Array, bonds: int, low: float, high: float) -> int:
        strain = strain[:bonds]
        return int(np.count_nonzero(~((strain >= low) & (strain <= high))))

    def extremes(strain: Array, bonds: int) -> tuple[float, float]:
        low, high = np.min(strain[:bonds], initial=np.inf), np.max(strain[:bonds], initial=-np.inf)
        return float(low), float(high)

    looks = strain_scans(count_outside, extremes, kind, unregistered)
    return VerletKernels(start, stage, drift, copy, mix, *looks)
