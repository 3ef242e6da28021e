"""What pictures and tables show of an analysis, of both bodies together."""

import numpy as np

from chaincor.analysis.modes import are_equal
from chaincor.analysis.results import CollisionAnalysis
from chaincor.analysis.theory import measured_contacts_energies
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import stiffness_of


def describe(analysis: CollisionAnalysis) -> str:
    """Return the scene in a few words, such as ``lj, n = 100, v0 = 0.4 v*``."""
    bond = analysis.bond
    if bond is None or bond.natural_speed is None:
        speed = f"$v_0$ = {analysis.velocity:.4g}"
    else:
        speed = f"$v_0$ = {analysis.velocity / bond.natural_speed:.4g} $v^*$"
    name = "bond not known" if bond is None else bond.name
    unequal = "" if are_equal(analysis.masses) else ", unequal masses"
    return f"{name}, $n$ = {analysis.particles}{unequal}{analysis.against}, {speed}"


def energy_series(analysis: CollisionAnalysis) -> tuple[Array, ...]:
    """
    Return translation, vibration, shortest and longest bond of all frames, of both bodies.

    Translation is that of the bodies against each other; what both do as one body stays.
    """
    history = analysis.history
    own = history.translation, history.vibration, history.bond_min, history.bond_max
    if analysis.target is None:
        return own
    other = analysis.target.history
    total, others = float(np.sum(analysis.masses)), float(np.sum(analysis.target.masses))
    # The mirrored target's momentum counts the other way.
    relative = history.momentum / total + other.momentum / others
    return (
        0.5 * relative**2 / (1.0 / total + 1.0 / others),
        history.vibration + other.vibration,
        np.fmin(history.bond_min, other.bond_min),
        np.fmax(history.bond_max, other.bond_max),
    )


def along_the_line(analysis: CollisionAnalysis) -> tuple[Array, Array]:
    """Return displacements and velocities along x of all frames, a target's before the chain's."""
    history = analysis.history
    if analysis.target is None:
        return history.displacements, history.velocities
    other = analysis.target.history
    pairs = (
        (other.displacements, history.displacements),
        (other.velocities, history.velocities),
    )
    found = [np.concatenate((-far[:, ::-1], near), axis=1) for far, near in pairs]
    return found[0], found[1]


def mode_theory(analysis: CollisionAnalysis) -> Array | None:
    """Return the Basile-Dumont energies with this collision's count, mean interval and speed."""
    # The formula has the modes of equal masses, and a wall.
    if not are_equal(analysis.masses) or analysis.target is not None:
        return None
    return measured_contacts_energies(
        analysis.particles,
        analysis.contact_statistics,
        analysis.velocity,
        stiffness=stiffness_of(analysis.bond),
        mass=float(analysis.masses[0]),
    )


def energy_at_impact(analysis: CollisionAnalysis) -> float:
    """Return the translational energy before, and for a chain that came vibrating, all energy."""
    bound = analysis.restitution_bound or 1.0
    mass = float(np.sum(analysis.masses))
    if analysis.target is not None:
        mass /= 1.0 + mass / float(np.sum(analysis.target.masses))
    return 0.5 * mass * analysis.velocity**2 * bound
