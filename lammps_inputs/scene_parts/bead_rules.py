"""Rules for scenes of beads that only push, and for their LAMMPS runs."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from chaincor.lammps_inputs.bonds.hertz import HERTZ
from chaincor.lammps_inputs.problem import Problem

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene

# Largest number of different masses in a damped column in LAMMPS. Each pair of masses requires a
# command.
_MOST_MASSES = 20
# The only numerics that LAMMPS supports for beads, and the keys of numerics that may be given with
# fixed steps.
_GRANULAR = {"wall": "event", "scheme": "verlet", "table": "linear"}
_STEPS = (*_GRANULAR, "table_points", "timestep")


def check_beads(scene: "Scene") -> Iterator[str]:
    """Yield the mistakes in a scene with beads."""
    if scene.diameters is not None and (
        scene.bond.as_keys().get("hertz_exponent") != HERTZ or scene.target_particles is not None
    ):
        yield (
            "diameters set the stiffness of Hertz's law before a wall. Use potential 'hertz' with "
            f"exponent {HERTZ:g} and no target, or leave diameters out"
        )
    if not scene.bond.only_pushes:
        return
    if scene.compression is not None and scene.compression > 0.0:
        stored = (scene.particles - 1) * float(scene.bond.energy(np.array(-scene.compression)))
        if stored > 0.5 * float(np.sum(scene.line.chain_masses)) * scene.impact_velocity**2:
            yield (
                f"compression is {scene.compression:g}, at which beads fly apart with more energy "
                "than the impact has. Give less compression, or a higher velocity"
            )
    if scene.damping_law is not None and scene.damping is None:
        yield "damping_law has no effect without damping. Give damping, or remove damping_law"
    if scene.engine == "reference":
        for key in _STEPS:
            if getattr(scene, key) is not None:
                yield (
                    f"{key} is given, but the steps of {scene.label} beads adapt to their "
                    "overlaps. Give a tolerance instead"
                )
        return
    if refusal := granular_refusal(scene.problem):
        yield refusal
    if scene.table_points is not None and (scene.diameters or scene.damping):
        yield (
            "table_points replaces Hertz's law by a table, which has no diameters and no damping. "
            "Leave table_points out"
        )
    if scene.dump is not None:
        yield (
            "LAMMPS jobs of beads write no dump. Leave dump out, and read the motion in Python as "
            "`history` of a collision"
        )
    for key, known in _GRANULAR.items():
        if getattr(scene, key) not in (None, known):
            yield (
                f"{key} is {getattr(scene, key)}, but LAMMPS's granular styles have only Verlet "
                f"steps, a located wall and linear tables. Leave {key} out"
            )


def granular_refusal(problem: Problem) -> str | None:
    """Explain why `pair_style granular` cannot simulate a column; None if it can."""
    keys, contact = dict(problem.bond.as_keys()), problem.line.contact
    if keys.get("damping"):
        exponent = keys["hertz_exponent"]
        other = None if exponent == HERTZ else f"hertz_exponent is {exponent:g}"
        if contact.soft and not contact.is_hertzian:
            other = f"the contact is {contact.shape}"
        if other is not None:
            return (
                f"{other}, but LAMMPS's damping of beads comes with Hertz's law, 1.5, alone. Leave "
                "damping out, or set engine to 'reference'"
            )
    if problem.line.targets and contact != problem.bond.contact:
        return (
            "the contact with the target has another law than the beads, but LAMMPS's pair_style "
            "granular has one law for all. Leave contact out, or set engine to 'reference'"
        )
    line = problem.line
    masses: set[Any] = {*line.chain_masses.tolist(), *line.target_masses.tolist()}
    if line.diameters is not None:
        masses = {*zip(line.chain_masses.tolist(), line.diameters.tolist(), strict=True)}
    if keys.get("damping") and len(masses) > _MOST_MASSES:
        return (
            f"the beads have {len(masses)} masses, but LAMMPS's viscoelastic damping needs "
            f"numbers for each pair of masses. Give at most {_MOST_MASSES}, or set engine to "
            "'reference'"
        )
    return None
