"""The result of a collision, put together from what an engine found and its error bar."""

import math
import time
from typing import Any, cast

import numpy as np

from chaincor.analysis.modes import mode_energies
from chaincor.analysis.restitution import centre_of_mass_velocity, energy_split
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.formula import Formula
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.given_bodies import (
    given_bodies,
    seed_of,
)
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.bounded_run import BoundedRun
from chaincor.workflows.accuracy.reference_runs import eta_of
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference import adaptive, modal
from chaincor.workflows.engines.replay import Replay
from chaincor.workflows.result import Collision
from chaincor.workflows.versions import versions

# Stiffnesses and lengths are told apart from 1 beyond what a bond's own differences are good to.
_ROUNDED = 1e-9


def result_of(
    scene: Scene, bounded_run: BoundedRun, started: float, energies: Array | None = None
) -> Collision:
    """
    Return the result of a collision from the run and error bar in `bounded_run`.

    Work on it began at `started`, by ``time.perf_counter``; `energies`, of shape (n,), are those of
    its vibration modes, where they are known already.
    """
    outcome, bar, found = bounded_run.outcome, bounded_run.bar, bounded_run.details
    if energies is None:
        state = outcome.displacements, outcome.velocities
        energies = mode_energies(*state, scene.bond.stiffness, scene.line.chain_masses)
    v0, v_star = scene.impact_velocity, scene.bond.natural_speed
    eta = eta_of(scene, outcome)
    certificate = outcome.details.get("table")
    scouted = found.get("scouting")
    bond_min, bond_max, source = outcome.bond_min, outcome.bond_max, "every step"
    if outcome.engine == "lammps":
        source = "LAMMPS, at contacts and at looks between them"
        if scouted is not None:
            bond_min = min(bond_min, scouted["bond_min"])
            bond_max = max(bond_max, scouted["bond_max"])
            source = "in-house scouting run, every step, and LAMMPS at contacts"
    step = outcome.timestep if scouted is None else scouted["timestep"]
    longer = scene.bond.natural_length - 1.0
    total, asked = bar.total, scene.asked_tolerance
    met = None if asked is None or total is None else total <= asked
    return Collision(
        restitution=eta,
        restitution_error=total,
        kinematic_restitution=math.sqrt(eta),
        contacts=len(outcome.contact_times),
        last_contact_time=float(outcome.contact_times[-1]),
        engine=outcome.engine,
        wall=outcome.wall,
        scheme=outcome.scheme,
        timestep=outcome.timestep,
        table=certificate["style"] if certificate else None,
        table_points=certificate["rows"] if certificate else None,
        potential=scene.label,
        particles=scene.particles,
        velocity=v0,
        speed=None if v_star is None else v0 / v_star,
        v_star=v_star,
        bond_min=bond_min + longer,
        bond_max=bond_max + longer,
        bond_range_source=source,
        bond_error=_between_steps(scene, (bond_min - 1.0, bond_max - 1.0), step),
        energy_drift=(outcome.energy_end - outcome.energy_start) / outcome.energy_start,
        momentum_residual=impulse_residual(scene.line, outcome, v0),
        ending=outcome.ending.kind,
        duration=outcome.duration,
        fragments=outcome.fragments,
        crossed=outcome.crossed,
        tolerance=asked,
        tolerance_met=met,
        reason=bounded_run.reason,
        error_parts=bar,
        seconds=outcome.seconds,
        seconds_total=time.perf_counter() - started,
        scene_sha256=scene.sha256,
        versions=versions(),
        contact_times=outcome.contact_times,
        contact_speeds=outcome.contact_speeds,
        mode_energies=energies,
        velocities=outcome.velocities,
        displacements=outcome.displacements,
        details=outcome.details | found,
        **_bond_fields(scene.bond),
        replay=_replay(scene, outcome, found),
        **_bodies_after(scene, outcome),
    )


def _bond_fields(bond: Potential) -> dict[str, Any]:
    """Return what results say of bonds that are not in the usual units, or a formula."""
    fields: dict[str, Any] = {}
    if isinstance(bond, Formula):
        fields |= {"energy": bond.text, "parameters": dict(bond.given)}
    for name in ("stiffness", "natural_length"):
        if abs(getattr(bond, name) - 1.0) > _ROUNDED:
            fields[name] = float(getattr(bond, name))
    return fields


def _bodies_after(scene: Scene, outcome: Outcome) -> dict[str, Any]:
    """Return what a result says of both bodies; nothing for a plain scene."""
    line = scene.line
    if line.is_standard:
        return {}
    k = scene.bond.stiffness
    chain = energy_split(
        outcome.displacements, outcome.velocities, scene.bond, masses=line.chain_masses
    )
    found: dict[str, Any] = _as_given(scene) | {
        "velocity_after": float(centre_of_mass_velocity(outcome.velocities, line.chain_masses)),
        "translational_energy": float(chain.translation),
        "vibrational_energy": float(chain.vibration),
    }
    if line.rigid:
        return found
    masses, velocities = line.target_masses, outcome.target_velocities
    # From the contact outward a target goes towards -x: seen in a mirror, it is a chain.
    target = energy_split(-outcome.target_displacements, -velocities, scene.bond, masses=masses)
    return found | {
        "target_velocity_after": float(centre_of_mass_velocity(velocities, masses)),
        "target_translational_energy": float(target.translation),
        "target_vibrational_energy": float(target.vibration),
        "target_velocities": velocities,
        "target_displacements": outcome.target_displacements,
        "target_mode_energies": mode_energies(outcome.target_displacements, velocities, k, masses),
    }


def _as_given(scene: Scene) -> dict[str, Any]:
    given, state = given_bodies(scene), scene.initial_state
    if state is not None and state.masses is not None:
        given["masses"] = tuple(state.masses.tolist())
    if scene.temperature is not None:
        given["seed"] = seed_of(scene)
    if scene.line.soft:
        given |= scene.line.contact.as_keys()
    else:
        given.pop("contact", None)
    return given


def impulse_residual(line: Line, outcome: Outcome, impact_velocity: float) -> float:
    """
    Return how far the momenta of both bodies are from what the contacts gave, in units of M v0.

    Each contact gives the chain its impulse and the target the opposite one, whatever the bonds do.

    The larger of both residuals; of the chain alone before a wall, which takes any momentum.
    """
    given = float(np.sum(outcome.impulses))
    mass = float(np.sum(line.chain_masses))
    change = float(line.chain_masses @ outcome.velocities) + mass * impact_velocity
    residuals = [abs(change - given)]
    if not line.rigid:
        residuals.append(abs(float(line.target_masses @ outcome.target_velocities) + given))
    return max(residuals) / (mass * impact_velocity)


def _replay(scene: Scene, outcome: Outcome, found: dict[str, Any]) -> Replay:
    numerics, accuracy = outcome.numerics, None
    if numerics is None and outcome.timestep is not None:
        scheme = cast(StepSchemeName, outcome.scheme)
        numerics = Numerics(scheme=scheme, timestep=outcome.timestep)
    elif outcome.scheme == adaptive.SCHEME and "choice" in found:
        accuracy = found["choice"]["tries"][-1]["accuracy"]
    return Replay(scene, outcome.scheme, numerics, accuracy)


def _between_steps(scene: Scene, strains: tuple[float, float], step: float | None) -> float | None:
    r"""
    Return how much farther bonds may have gone between the ends of steps.

    An extreme is at most half a step h from an end, and a strain has :math:`|\ddot s| \le 4 F/m`
    with the largest force F and the lightest mass m: no farther than :math:`h^2 F/2m`. None where
    steps have no fixed length.
    """
    if scene.longest_body < 2:
        return 0.0
    if step is None:
        if not scene.line.is_standard or not scene.bond.is_harmonic:
            return None
        step = modal.SAMPLE_INTERVAL
    with np.errstate(all="ignore"):
        forces = np.abs(scene.bond.force(np.linspace(*strains, 65)))
    lightest = scene.line.lightest
    return float(0.5 * step**2 * np.nanmax(forces) / lightest)
