"""A result in lines of text, as ``chaincor run`` prints it."""

import math
from typing import TYPE_CHECKING

from chaincor.analysis.showing.numbers import (
    impact_speed,
    named_lines,
    root_of_known,
    with_error,
)

if TYPE_CHECKING:
    from chaincor.workflows.result import Collision

_ENDINGS = {
    "proved": "energy and momentum rule out another contact",
    "argued": "the collision is very likely over, but this is not proved",
    "open": "another contact may still come; the error bar allows for it",
}


def describe(result: "Collision") -> str:
    """Describe a result for people."""
    return "\n".join([*heading(result), "", *named_lines(rows(result)), "", *closing(result)])


def describe_shortly(result: "Collision") -> str:
    """Describe a result in three lines: what collided, what came out, how it was run."""
    asked = ""
    if result.tolerance_met is False:
        asked = f"; tolerance {result.tolerance:g} NOT MET: {result.reason}"
    return "\n".join(
        [
            ", ".join(heading(result)),
            f"eta = {with_error(result.restitution, result.restitution_error)}, "
            f"e = {root_of_known(result.kinematic_restitution, result.restitution_error)}, "
            f"{result.contacts} contact{'s' if result.contacts != 1 else ''}, the last at "
            f"t = {result.last_contact_time:.6g}",
            f"{closing(result)[0]}; end {result.ending}{asked}",
        ]
    )


def heading(result: "Collision") -> list[str]:
    """Say what collided."""
    speed = impact_speed(result.velocity, result.v_star)
    return [
        f"{_count(result.particles)}, {result.potential} bonds, {speed}",
        *_bodies_before(result),
    ]


def rows(result: "Collision") -> list[tuple[str, str]]:
    """Return what came out, each with its name; `terms` explains the names."""
    relative = "" if result.target_particles is None else ", of the relative motion"
    eta = with_error(result.restitution, result.restitution_error)
    root = root_of_known(result.kinematic_restitution, result.restitution_error)
    found = [
        ("restitution (energy)", f"eta = {eta}{relative}"),
        ("restitution (speed)", f"e   = {root}{relative}"),
        ("contacts", f"{result.contacts}, the last at t = {result.last_contact_time:.6g}"),
        ("end", f"{result.ending}: {_ENDINGS[result.ending]}"),
        *_bodies_after(result),
        ("bond lengths", _bond_lengths(result)),
        ("energy drift", f"{result.energy_drift:.1e}"),
        ("momentum residual", f"{result.momentum_residual:.1e} of the initial momentum"),
    ]
    if result.fragments > 1:
        found.append(("fragments", f"{result.fragments} at the last contact: bonds broke"))
    if result.crossed:
        found.append(("crossed", "particles passed through each other, which atoms cannot"))
    return found


def closing(result: "Collision") -> list[str]:
    """Say how it was run, and how long that took."""
    step = "" if result.timestep is None else f", H = {result.timestep:.4g}"
    table = "" if result.table is None else f", {result.table} table of {result.table_points} rows"
    return [
        f"run by {result.engine}: {_meeting(result)}, {result.scheme}{step}{table}",
        f"time {result.seconds:.3g} s for this run, "
        f"{result.seconds_total:.3g} s with set-up and checks",
    ]


# More masses than these are not all shown.
_MOST_MASSES = 6


def _list(masses: tuple[float, ...]) -> str:
    shown = ", ".join(f"{mass:.6g}" for mass in masses[:_MOST_MASSES])
    return shown if len(masses) <= _MOST_MASSES else f"{shown}, ... ({len(masses)} in all)"


def _count(particles: int) -> str:
    return "1 particle" if particles == 1 else f"{particles} particles"


def _bodies_before(result: "Collision") -> list[str]:
    """Describe what the scene has more than a cold chain of unit masses and a hard wall."""
    lines = []
    if result.masses is not None:
        lines.append(f"masses {_list(result.masses)} from the contact outward")
    if result.target_particles is not None:
        masses = _list(result.target_masses or (1.0,))
        lines.append(f"onto a free target: {_count(result.target_particles)}, masses {masses}")
    if result.contact is not None:
        lines.append(
            f"soft contact: force K d^q of the overlap d, K = {result.contact_stiffness:.6g}, "
            f"q = {result.contact_exponent:.6g}"
        )
    if result.initial is not None:
        lines.append(f"initial state of {result.initial}")
    if result.compression is not None:
        kind = "shorter" if result.compression > 0.0 else "longer"
        lines.append(f"bonds {kind} by {abs(result.compression):.6g} at first")
    if result.temperature is not None:
        lines.append(f"warm at first: T = {result.temperature:.6g}, seed {result.seed}")
    return lines


def _bodies_after(result: "Collision") -> list[tuple[str, str]]:
    """Say where momentum and energy went; nothing for a plain scene, whose eta says it."""
    rows = []
    for name, owner in (("chain", ""), ("target", "target_")):
        keys = ("velocity_after", "translational_energy", "vibrational_energy")
        velocity, translation, vibration = (getattr(result, f"{owner}{key}") for key in keys)
        if velocity is not None:
            rows.append((name, body_text(velocity, translation, vibration)))
    return rows


def body_text(velocity: float, translation: float | None, vibration: float | None) -> str:
    """Say how a body goes; where its bond is not known, nothing of its energies."""
    text = f"velocity {velocity:.6g}"
    if translation is None:
        return text
    return f"{text}, energy of translation {translation:.6g}, of vibration {vibration:.6g}"


def _meeting(result: "Collision") -> str:
    """Name what particle 1 meets: a wall only where there is one."""
    kind = "soft" if result.contact is not None else result.wall
    return f"{kind} wall" if result.target_particles is None else f"{kind} contact"


def _bond_lengths(result: "Collision") -> str:
    """Say between what lengths bonds were, to the digits that looking at steps leaves."""
    error = result.bond_error
    digits = 4 if not error else min(max(math.ceil(-math.log10(error)), 2), 6)
    shown = f"{result.bond_min:.{digits}f} to {result.bond_max:.{digits}f}"
    return f"{shown} up to the last contact" + (f", +- {error:.1g}" if error else "")
