r"""
Compile loops that follow a chain and propagate a derivative back along its linearised motion.

A line has N particles and N - 1 strains. One of the strains is the gap between the bodies. A rigid
wall is a particle with inverse mass 0. A step consists of drifts and kicks, whose derivatives are

.. math:: ds_i \to ds_i + d\,(dv_{i+1} - dv_i), \qquad
    dv_i \to dv_i + (k/m_i)\,(U''_i\,ds_i - U''_{i-1}\,ds_{i-1}).

At a hard contact, the perturbation of the state jumps (saltation), because the time of the impact
also changes. For a gap g that closes with the speed w, the time changes by :math:`d\tau = dg/w`.
The perturbation of the gap changes sign, :math:`-dg`. The perturbation of the velocities, :math:`dw
+ (a_p - a_{p+1})\,d\tau`, is mapped like the velocities themselves. Strains beside the gap change
by :math:`ds = J\,d\tau/m` with the impulse J. When soft bodies touch or part, the force is
continuous, and no perturbation jumps.
"""

from collections.abc import Callable
from functools import lru_cache
from typing import Any, NamedTuple

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.workflows.engines.reference.compile import (
    KEPT,
    LoopCompiler,
    scalar_force,
)
from chaincor.workflows.engines.reference.line_traits import LineParameters

# If U'' has no formula, it is a difference quotient of the forces at strains that are smaller and
# larger by this amount.
_DIFFERENCE = 1e-5


class Substeps(NamedTuple):
    """Substeps within a section of the motion."""

    times: Array  #: Duration of each substep, of shape (L,).
    #: 1 if a hard contact ends the substep, 2 if soft bodies touch or part at its end, otherwise 0,
    #: of shape (L,).
    hits: Array
    #: Drift fractions of the scheme, of shape (K + 1,).
    drifts: Array
    kicks: Array  #: Kick fractions of the scheme, of shape (K,).


class Tape(NamedTuple):
    """Data of a section of the motion that the derivatives need."""

    strains: Array  #: Strains at each kick, of shape (L, K, N - 1).
    #: For a hard contact at the end of a substep: its speed, and the accelerations of both
    #: particles, of shape (L, 3).
    impacts: Array
    #: Forces at each kick, of shape (L, K, N - 1). They are later replaced by the derivatives of
    #: eta with respect to these forces.
    weights: Array


class Loops(NamedTuple):
    """
    Compiled loops for one bond.

    The argument `line` of each loop is a `LineParameters`.
    """

    #: ``follow(strain, velocity, substeps, tape, line)`` propagates the state in place, and writes
    #: the tape.
    follow: Callable
    #: ``pull(strain, velocity, lightness, substeps, tape, line)`` propagates the derivative of a
    #: quantity with respect to the state back in time, in place. It adds to `lightness`, the
    #: derivative with respect to the inverse masses.
    pull: Callable
    #: ``impulse(strains, weights, line)`` returns the sum of weights times bond forces. The
    #: derivative of this sum with respect to a bond parameter is the derivative of the quantity.
    impulse: Callable
    parameters: tuple  #: Parameters of the bond's kernel.


def loops_for(bond: Potential, law: type[ContactLaw]) -> Loops | None:
    """Return the loops for a bond and a contact law; None if the bond cannot be compiled."""
    force = scalar_force(bond)
    if force is None:
        return None
    loops = _compiled(force.function, force.keep, bond.curvature_kernel, law)
    return loops._replace(parameters=force.parameters)


@lru_cache(maxsize=KEPT)
def _compiled(
    function: Callable, keep: bool, curvature: Callable | None, law: type[ContactLaw]
) -> Loops:
    compiler = LoopCompiler.for_force(function, keep, f".sensitivity.{law.name}")
    register, compiled = compiler.register, compiler.compile
    force = register(function)
    bond_curvature = register(curvature or differences_of(force))
    return Loops(
        compiled(_build_follow(force, law, register)),
        compiled(_build_pull(bond_curvature, law, register)),
        compiled(_build_impulse(force)),
        (),
    )


def differences_of(force: Callable) -> Callable:
    """Return a function that computes U'' by central differences of a force."""

    def curvature(strain: float, parameters: Any) -> float:
        below, above = strain - _DIFFERENCE, strain + _DIFFERENCE
        fall: float = force(below, parameters) - force(above, parameters)
        return fall / (above - below)

    return curvature


# The inner loops of `follow` and `pull` use few arrays, so that the compiler can vectorise them.
# These loops treat the gap as a bond and correct it afterwards, because a branch for each bond
# would cost more than the force.
def _build_follow(force: Callable, law: type[ContactLaw], register: Callable) -> Callable:
    press, kick_by = register(law.force_kernel), register(kicked)

    @register
    def stretch(strain: Array, velocity: Array, time: float) -> None:
        for i in range(strain.shape[0]):
            strain[i] += time * (velocity[i + 1] - velocity[i])

    @register
    def forces_at(at: Array, forces: Array, line: LineParameters) -> None:
        for i in range(at.shape[0]):
            forces[i] = force(at[i], line.bond)
        forces[line.gap] = press(at[line.gap], line.contact)

    def follow(
        strain: Array, velocity: Array, substeps: Substeps, tape: Tape, line: LineParameters
    ) -> None:
        times, hits, drifts, kicks = substeps
        strains, impacts, forces = tape
        p, inverse, bonds, count = line.gap, line.inverse, strain.shape[0], kicks.shape[0]
        for n in range(times.shape[0]):
            for k in range(count):
                at, pushes = strains[n, k], forces[n, k]
                drift = drifts[k] * times[n]
                for i in range(bonds):
                    at[i] = strain[i] = strain[i] + drift * (velocity[i + 1] - velocity[i])
                forces_at(at, pushes, line)
                kick_by(velocity, pushes, inverse, kicks[k] * times[n])
            stretch(strain, velocity, drifts[count] * times[n])
            if hits[n] > 0.0:
                strain[p] = 0.0
            if hits[n] == 1.0:
                speed = velocity[p] - velocity[p + 1]
                impacts[n, 0] = speed
                impacts[n, 1] = inverse[p] * force(strain[p - 1], line.bond) if p > 0 else 0.0
                ahead = force(strain[p + 1], line.bond) if p + 1 < bonds else 0.0
                impacts[n, 2] = -inverse[p + 1] * ahead
                given = 2.0 * speed / (inverse[p] + inverse[p + 1])
                velocity[p] -= given * inverse[p]
                velocity[p + 1] += given * inverse[p + 1]

    return follow


def kicked(velocity: Array, forces: Array, inverse: Array, kick: float) -> None:
    """Add the effect of the bond forces during a time `kick` to the velocities."""
    bonds = forces.shape[0]
    velocity[0] -= kick * inverse[0] * forces[0]
    for i in range(1, bonds):
        velocity[i] += kick * inverse[i] * (forces[i - 1] - forces[i])
    velocity[bonds] += kick * inverse[bonds] * forces[bonds - 1]


def _build_pull(bond_curvature: Callable, law: type[ContactLaw], register: Callable) -> Callable:
    press_bend = register(law.curvature_kernel)

    @register
    def soften(at: Array, change: Array, forces: Array, line: LineParameters) -> None:
        # Each bond subtracts U'' times the change of its strain. The gap uses the contact law
        # instead of U''.
        gap = line.gap
        softer = press_bend(at[gap], line.contact) * change[gap]
        softer = forces[gap] - softer
        for i in range(at.shape[0]):
            forces[i] -= bond_curvature(at[i], line.bond) * change[i]
        forces[gap] = softer

    @register
    def stretch_back(strain: Array, velocity: Array, time: float) -> None:
        bonds = strain.shape[0]
        velocity[0] -= time * strain[0]
        for i in range(1, bonds):
            velocity[i] += time * (strain[i - 1] - strain[i])
        velocity[bonds] += time * strain[bonds - 1]

    @register
    def weigh(weights: Array, velocity: Array, light: Array, inverse: Array, kick: float) -> None:
        # The weights replace the forces, which are no longer needed after the derivatives with
        # respect to inverse masses.
        bonds, behind = weights.shape[0], 0.0
        for i in range(bonds):
            ahead = weights[i]
            light[i] += kick * velocity[i] * (behind - ahead)
            weights[i] = kick * (inverse[i + 1] * velocity[i + 1] - inverse[i] * velocity[i])
            behind = ahead
        light[bonds] += kick * velocity[bonds] * behind

    @register
    def jump_back(
        strain: Array, velocity: Array, light: Array, impact: Array, line: LineParameters
    ) -> None:
        p, inverse = line.gap, line.inverse
        speed = impact[0]
        both = inverse[p] + inverse[p + 1]
        share = 2.0 / both
        by_given = inverse[p + 1] * velocity[p + 1] - inverse[p] * velocity[p]
        of_masses = share * speed * (velocity[p] + velocity[p + 1]) / both
        light[p] -= inverse[p + 1] * of_masses
        light[p + 1] += inverse[p] * of_masses
        by_delay = share * by_given * (impact[1] - impact[2])
        if p > 0:
            by_delay += share * speed * inverse[p] * strain[p - 1]
        if p + 1 < strain.shape[0]:
            by_delay += share * speed * inverse[p + 1] * strain[p + 1]
        strain[p] = by_delay / speed - strain[p]
        velocity[p] += share * by_given
        velocity[p + 1] -= share * by_given

    def pull(
        strain: Array,
        velocity: Array,
        light: Array,
        substeps: Substeps,
        tape: Tape,
        line: LineParameters,
    ) -> None:
        times, hits, drifts, kicks = substeps
        strains, impacts, weights = tape
        count = kicks.shape[0]
        for n in range(times.shape[0] - 1, -1, -1):
            if hits[n] == 1.0:
                jump_back(strain, velocity, light, impacts[n], line)
            stretch_back(strain, velocity, drifts[count] * times[n])
            for k in range(count - 1, -1, -1):
                weight, kick = weights[n, k], kicks[k] * times[n]
                weigh(weight, velocity, light, line.inverse, kick)
                soften(strains[n, k], weight, strain, line)
                stretch_back(strain, velocity, drifts[k] * times[n])

    return pull


def _build_impulse(force: Callable) -> Callable:
    def impulse(strains: Array, weights: Array, line: LineParameters) -> float:
        # Bond parameters do not change the force in the gap.
        total = 0.0
        for n in range(strains.shape[0]):
            for k in range(strains.shape[1]):
                at, weight = strains[n, k], weights[n, k]
                for i in range(line.gap):
                    total += weight[i] * force(at[i], line.bond)
                for i in range(line.gap + 1, at.shape[0]):
                    total += weight[i] * force(at[i], line.bond)
        return total

    return impulse
