r"""
The compiled loops of the linearised motion: follow a chain, and pull a derivative back.

All lines are one kind here: N particles and N - 1 strains, of which one is the gap, and a rigid
wall is a particle of inverse mass 0. A step is split into drifts and kicks, whose derivatives are

.. math:: ds_i \to ds_i + d\,(dv_{i+1} - dv_i), \qquad
    dv_i \to dv_i + (k/m_i)\,(U''_i\,ds_i - U''_{i-1}\,ds_{i-1}).

At a hard contact the moment of the impact changes, too, by :math:`d\tau = dg/w` for a gap g that
closes with the speed w. The change of the state jumps by what the motion before and after differ in
(saltation): the mirror image of the gap, :math:`-dg`, the changes of momentum that the impact makes
of :math:`dw + (a_p - a_{p+1})\,d\tau`, and beside the gap :math:`ds = J\,d\tau/m`, J the impulse.
Where soft bodies touch and part the force is continuous, and nothing jumps.
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

# Of a force whose curvature has no formula: difference over so much strain to either side.
_DIFFERENCE = 1e-5


class Substeps(NamedTuple):
    """What a stretch of the motion was made of."""

    times: Array  #: Duration of each substep; of shape (L,).
    #: 1 where a hard contact ends it, 2 where soft bodies touch or part then, else 0; of shape
    #: (L,).
    hits: Array
    #: Fractions of the scheme; of shape (K + 1,) and (K,).
    drifts: Array
    kicks: Array  #: See ``drifts``.


class Tape(NamedTuple):
    """What a stretch of the motion leaves for its derivatives."""

    strains: Array  #: At each kick; of shape (L, K, N - 1).
    #: Of substeps that end with a hard contact its speed, and the accelerations of both particles;
    #: of shape (L, 3).
    impacts: Array
    #: The forces then; on the way back what eta changes by with each; of shape (L, K, N - 1).
    weights: Array


class Loops(NamedTuple):
    """The loops for one bond; `line` is `LineParameters`."""

    #: ``follow(strain, velocity, substeps, tape, line)``: carries the state, in place, and
    #: writes the tape.
    follow: Callable
    #: ``pull(strain, velocity, lightness, substeps, tape, line)``: carries the derivative of
    #: a number by the state back, in place, and adds to that by the inverse masses.
    pull: Callable
    #: ``impulse(strains, weights, line)``: the sum of weights times forces of the bonds,
    #: whose derivative by a parameter of the bonds is that of the number.
    impulse: Callable
    parameters: tuple  #: Of the bond's kernel.


def loops_for(bond: Potential, law: type[ContactLaw]) -> Loops | None:
    """Return the loops for a bond and a contact; None where the bond cannot be compiled."""
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
    bend = register(curvature or differences_of(force))
    return Loops(
        compiled(_build_follow(force, law, register)),
        compiled(_build_pull(bend, law, register)),
        compiled(_build_impulse(force)),
        (),
    )


def differences_of(force: Callable) -> Callable:
    """Return U'' of a force, by central differences."""

    def curvature(strain: float, parameters: Any) -> float:
        below, above = strain - _DIFFERENCE, strain + _DIFFERENCE
        fall: float = force(below, parameters) - force(above, parameters)
        return fall / (above - below)

    return curvature


# Both loops are made of loops with few arrays each, or there would be no vectors. These take all
# bonds alike, then the gap among them: a question at each would cost more than its force.
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
    """Add what bonds that push with some forces for a time `kick` give to the velocities."""
    bonds = forces.shape[0]
    velocity[0] -= kick * inverse[0] * forces[0]
    for i in range(1, bonds):
        velocity[i] += kick * inverse[i] * (forces[i - 1] - forces[i])
    velocity[bonds] += kick * inverse[bonds] * forces[bonds - 1]


def _build_pull(bend: Callable, law: type[ContactLaw], register: Callable) -> Callable:
    press_bend = register(law.curvature_kernel)

    @register
    def soften(at: Array, change: Array, forces: Array, line: LineParameters) -> None:
        # Subtracts U'' times a change.
        gap = line.gap
        softer = press_bend(at[gap], line.contact) * change[gap]
        softer = forces[gap] - softer
        for i in range(at.shape[0]):
            forces[i] -= bend(at[i], line.bond) * change[i]
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
        # Weights come in the place of forces, which tell what inverse masses do.
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
        # All forces change with the parameters of the bond, those of the gap apart.
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
