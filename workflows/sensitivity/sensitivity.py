r"""
Compute the derivatives of eta with respect to all inputs in one pass back along the motion.

The restitution is :math:`\eta = (V_1/V_0)^2`, where V is the separation velocity of the bodies. The
derivative with respect to the final velocities is therefore known. The adjoint of the linearised
motion propagates this derivative back to the start (see ``loops``), and sums the contributions from
masses and forces. Two identities of the exact derivative show its error: eta is constant along the
motion, and the motion stays the same if masses are multiplied by c and velocities are divided by
:math:`\sqrt c`.
"""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.formula import Formula
from chaincor.lammps_inputs.bonds.named_bond import NamedBond
from chaincor.lammps_inputs.bonds.potentials import WHOLE_KEYS
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_KEYS
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.errors import SensitivityError
from chaincor.workflows.sensitivity.trace import Trace, trace

# The first step is this number divided by the angular frequency of the shortest bond. The scheme of
# order 8 then has errors of about 1e-10.
_USUAL_STEP = 0.1
# The step is halved until the error of the derivatives is below _WANTED, at most _MOST_HALVINGS
# times.
_WANTED, _MOST_HALVINGS = 1e-8, 6
# The residuals of the two identities show only a part of the error. They are therefore multiplied
# by this factor.
_RESERVE = 10.0
# Derivatives with a larger relative error are not returned.
_WORST = 0.1
# Variance of a rounding error, divided by the square of the rounded number. The variance is a
# twelfth of the squared unit in the last place. This unit squared is on average 0.54 (machine
# epsilon times the number)^2.
_ROUNDED = 0.54 / 12.0 * np.finfo(float).eps ** 2
# Bond parameters are varied by this fraction. The error of the differences is about the square of
# the fraction.
_VARIED = 1e-5


@dataclass(frozen=True)
class Sensitivity:
    r"""
    Derivatives of eta with respect to the initial state and the parameters of the bodies.

    Units are the natural bond length, the particle mass and the bond stiffness. Each derivative is
    taken with all other quantities fixed. For a mass, these include velocities and strains; for a
    bond parameter, strains and absolute speed.

    Attributes
    ----------
    velocity : float
        :math:`d\eta/dv_0`, where the velocities of all particles of the chain change equally.
    masses : ndarray of shape (n,)
        Derivatives with respect to each mass of the chain.
    target_masses : ndarray of shape (M,), or None
        Derivatives with respect to each mass of a free target, from the contact outward.
    parameters : dict
        Derivatives with respect to the bond's parameters, by their keys in the scene or names in
        the formula.
    contact : dict
        Derivative with respect to the strength K of a soft contact, by its key in the scene. The
        key is also an attribute, whose value is None for hard bodies.
    wall_place : float
        Derivative with respect to the position of the wall or free target, along x towards the
        chain. The derivative is 0 if the bonds of the chain have their natural length before the
        impact and the chain does not vibrate.
    strains, velocities : ndarray of shape (n - 1,) and (n,)
        Derivatives with respect to each initial bond length and each initial velocity in the chain.
    amplification : float
        Norm of the derivatives with respect to gap, strains and velocities, times v0 and divided by
        eta. If each of these quantities has a random error of f v0, the relative error of eta is f
        times the amplification. The decimal logarithm of the amplification is the number of digits
        that the collision loses.
    rounding : float
        Standard deviation of eta due to all roundings of strains and velocities, in a
        double-precision run with the scheme of order 8 and the steps that are used here.
    error : float
        Error of the derivatives, relative to the largest derivative.
    """

    velocity: float
    masses: Array
    target_masses: Array | None
    parameters: dict[str, float]
    contact: dict[str, float]
    wall_place: float
    strains: Array
    velocities: Array
    amplification: float
    rounding: float
    error: float
    step: float = field(repr=False, default=0.0)

    def __getattr__(self, name: str) -> float | None:
        """Return the derivative for a key of the contact law; None if the law has another key."""
        if name in CONTACT_KEYS:
            return self.contact.get(name)
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def to_dict(self) -> dict[str, Any]:
        """Return all fields as plain values for JSON."""
        plain: dict[str, Any] = {}
        for name, value in vars(self).items():
            if name == "contact":
                plain |= value
            elif name != "step" and value is not None:
                plain[name] = value
        return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in plain.items()}


@dataclass(frozen=True)
class Gradient:
    """Derivatives of eta along a line."""

    restitution: float  #: Restitution eta.
    #: Derivatives with respect to the initial strains, including the gap, of shape (N - 1,).
    strains: Array
    #: Derivatives with respect to initial velocities, of shape (N,); 0 for a wall.
    velocities: Array
    masses: Array  #: Derivatives with respect to masses, of shape (N,); 0 for a wall.
    parameters: Array  #: Derivatives with respect to the varied parameters.
    strength: float  #: Derivative with respect to the strength of a soft contact.
    rounding: float  #: Standard deviation of eta due to roundings during the motion.
    residual: float  #: Residual of the identities, relative to the size of their terms.


class Variant(NamedTuple):
    """Kernel parameters of a bond with one parameter slightly decreased and increased."""

    name: str
    less: tuple
    more: tuple
    width: float


def sensitivity_of(
    scene: Scene, contacts: int, duration: float, shortest: float, restitution: float, error: float
) -> Sensitivity:
    """
    Return the derivatives of eta for a collision whose result is known.

    `duration` is the time from the first contact to the end of the last one, and `shortest` is the
    strain of the shortest bond. The restitution of the differentiated run must agree with
    `restitution` within its error bar. Raise SensitivityError if the motion cannot be linearised,
    or if no digit of the derivatives is certain.
    """
    step, variants = first_linearised_step(scene, shortest), variants_of(scene)
    best: tuple[Gradient, float] | None = None
    refusal: SensitivityError | None = None
    for _ in range(_MOST_HALVINGS):
        try:
            found = gradient(trace(scene, step, contacts, duration), variants)
        except SensitivityError as failure:
            refusal = failure
        else:
            if best is None or found.residual < 0.5 * best[0].residual:
                best = found, step
            else:
                break
            if best[0].residual < _WANTED:
                break
        step *= 0.5
    if best is None:
        assert refusal is not None
        raise refusal
    found, step = best
    off = abs(found.restitution - restitution)
    if not off <= 3.0 * error + 1e-9 * restitution or not _RESERVE * found.residual < _WORST:
        raise SensitivityError(
            f"the differentiated run gives eta = {found.restitution:.9g}, but the collision gave "
            f"{restitution:.9g}. The derivatives have a relative error of about "
            f"{_RESERVE * found.residual:.1g}; at most {_WORST:g} is allowed. This collision "
            "amplifies rounding too much. Take a lower speed or fewer particles"
        )
    return _with_names(scene, found, variants, step)


def _with_names(scene: Scene, found: Gradient, variants: list[Variant], step: float) -> Sensitivity:
    line = scene.line
    first, gap = line.first, line.gap
    size = math.hypot(np.linalg.norm(found.strains), np.linalg.norm(found.velocities))
    return Sensitivity(
        velocity=-float(np.sum(found.velocities[first:])),
        masses=found.masses[first:],
        target_masses=found.masses[:first][::-1] if line.targets else None,
        parameters={v.name: float(d) for v, d in zip(variants, found.parameters, strict=True)},
        contact={line.contact.strength_key: found.strength} if line.soft else {},
        wall_place=-float(found.strains[gap]),
        strains=found.strains[first:],
        velocities=found.velocities[first:],
        amplification=scene.impact_velocity * size / found.restitution,
        rounding=found.rounding,
        error=max(_RESERVE * found.residual, np.finfo(float).eps),
        step=step,
    )


def first_linearised_step(scene: Scene, shortest: float) -> float:
    """Return the first time step for bonds whose strain is at least `shortest`."""
    line, bond = scene.line, scene.bond
    sharpest = scene.problem.fast_stiffness * max(
        1.0, float(bond.curvature(shortest)) / bond.stiffness
    )
    if line.soft:
        sharpest = max(sharpest, line.contact_rate)
    return _USUAL_STEP / math.sqrt(sharpest)


def variants_of(scene: Scene) -> list[Variant]:
    """Return variants of a bond in which one parameter is slightly smaller or larger."""
    bond = scene.bond
    if isinstance(bond, Formula):
        given, names = bond.given, {}
    elif isinstance(bond, NamedBond):
        given, names = bond.as_keys(), bond.keys
    else:
        return []
    found = []
    for key, value in given.items():
        if key in WHOLE_KEYS:
            continue
        width = _VARIED * (abs(value) or 1.0)
        less, more = (_with(bond, names.get(key, key), value + k * width) for k in (-1.0, 1.0))
        found.append(Variant(key, less, more, 2.0 * width))
    return found


def _with(bond: Formula | NamedBond, name: str, value: float) -> tuple:
    if isinstance(bond, Formula):
        return Formula(bond.text, bond.given | {name: value}).parameters
    given = {each: getattr(bond, each) for each in bond.keys.values()} | {name: value}
    return type(bond)(**given).parameters


def gradient(traced: Trace, variants: list[Variant]) -> Gradient:
    """Return the derivatives of eta for a traced collision, with those for the `variants`."""
    line, loops, parameters = traced.line, traced.loops, traced.parameters
    weights, before = _separation_by_velocity(line), line.separation(line.velocities)
    impulses, strength, rounding = np.zeros(len(variants)), 0.0, 0.0
    strains, light = np.zeros(len(line.strains)), np.zeros(len(weights))
    velocities = end = np.empty(0)
    for stretch, tape, _, last_velocity in traced.backward():
        if not len(end):
            end = last_velocity
            velocities = 2.0 * line.separation(end) / before**2 * weights
        loops.pull(strains, velocities, light, stretch.substeps, tape, parameters)
        for k, variant in enumerate(variants):
            more, less = (
                loops.impulse(tape.strains, tape.weights, parameters._replace(bond=bond))
                for bond in (variant.more, variant.less)
            )
            impulses[k] += (more - less) / variant.width
        # Each stage of a step rounds all strains and velocities.
        rounded = np.append(strains * stretch.strain, velocities * stretch.velocity)
        stages = stretch.substeps.times.size * stretch.substeps.drifts.size
        rounding += stages * _ROUNDED * float(rounded @ rounded)
        if line.soft:
            at, given = tape.strains[..., line.gap], tape.weights[..., line.gap]
            strength += float(np.sum(given * line.contact.force_per_strength(at)))
    after = line.separation(end)
    eta = (after / before) ** 2
    masses = -light * line.inverse_masses**2
    for parted, v, share in ((after, end, 1.0), (before, line.velocities, -1.0)):
        masses += share * 2.0 * eta / parted * _separation_by_mass(line, v)
    accelerations = traced.accelerations(line.strains)
    along = np.concatenate((strains * np.diff(line.velocities), velocities * accelerations))
    size = np.linalg.norm(strains) * np.linalg.norm(np.diff(line.velocities))
    size += np.linalg.norm(velocities) * np.linalg.norm(accelerations)
    velocities = velocities - 2.0 * eta / before * weights
    if line.rigid:  # A rigid wall does not move.
        velocities[: line.first] = 0.0
    finite = np.where(np.isinf(line.masses), 0.0, line.masses)
    scaled = np.concatenate((finite * masses, -0.5 * line.velocities * velocities))
    scale = np.linalg.norm(scaled)
    # Both sizes are 0 if eta depends on nothing, for example for two equal masses.
    parts = ((np.sum(along), size), (np.sum(scaled), scale))
    residual = max(abs(failed) / of if of > 0.0 else 0.0 for failed, of in parts)
    return Gradient(
        eta, strains, velocities, masses, impulses, strength, math.sqrt(rounding), float(residual)
    )


def _separation_by_velocity(line: Line) -> Array:
    """Return the derivatives of the separation velocity with respect to all velocities."""
    shares = np.zeros(len(line.masses))
    shares[line.first :] = line.chain_masses / np.sum(line.chain_masses)
    if not line.rigid:
        shares[: line.first] = -line.masses[: line.first] / np.sum(line.masses[: line.first])
    return shares


def _separation_by_mass(line: Line, velocities: Array) -> Array:
    """Return the derivatives of the separation velocity with respect to all masses."""
    found = np.zeros(len(velocities))
    bodies = [(slice(line.first, None), 1.0)]
    if not line.rigid:
        bodies.append((slice(line.first), -1.0))
    for body, sign in bodies:
        m, v = line.masses[body], velocities[body]
        found[body] = sign * (v - m @ v / np.sum(m)) / np.sum(m)
    return found
