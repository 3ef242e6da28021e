"""Write a result as lines of text for ``chaincor run``."""

from chaincor.analysis.observables import Observed, rows_of
from chaincor.analysis.showing.lines import count_text, last_contact, masses_text
from chaincor.analysis.showing.numbers import (
    impact_speed,
    named_lines,
    root_of_known,
    with_error,
)
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_KEYS, contact_of


def describe_result(result: Observed) -> str:
    """Describe a result in lines of text."""
    return "\n".join([*heading(result), "", *named_lines(rows_of(result)), "", *closing(result)])


def describe_shortly(result: Observed) -> str:
    """Describe a result in three lines: the bodies, the numbers, and the run."""
    counted = count_text(result.contacts, result.contacts_range)
    asked = ""
    if result.tolerance_met is False:
        asked = f"; tolerance {result.tolerance:g} NOT MET: {result.reason}"
    return "\n".join(
        [
            ", ".join(heading(result)),
            f"eta = {with_error(result.restitution, result.restitution_error)}, "
            f"e = {root_of_known(result.kinematic_restitution, result.restitution_error)}, "
            f"{counted} contact{'' if counted == '1' else 's'}, "
            f"{last_contact(result.last_contact_time, soft=result.contact is not None)}",
            f"{closing(result)[0]}; end {result.ending}{asked}",
        ]
    )


def heading(result: Observed) -> list[str]:
    """Describe the bodies that collided."""
    speed = impact_speed(result.velocity, result.v_star)
    return [
        f"{_count(result.particles)}, {result.potential} bonds, {speed}",
        *_bodies_before(result),
    ]


def closing(result: Observed) -> list[str]:
    """Describe the run and how long it took."""
    return [f"{label} {text}" for label, text in rows_of(result, closing=True)]


def _count(particles: int) -> str:
    return "1 particle" if particles == 1 else f"{particles} particles"


def _bodies_before(result: Observed) -> list[str]:
    """Describe how the scene differs from an unperturbed chain of unit masses and a hard wall."""
    lines = []
    if result.masses is not None:
        lines.append(f"masses {masses_text(result.masses)} from the contact outward")
    if result.target_particles is not None:
        masses = masses_text(result.target_masses or (1.0,))
        lines.append(f"onto a free target: {_count(result.target_particles)}, masses {masses}")
    if result.contact is not None:
        given = {key: getattr(result, key) for key in CONTACT_KEYS}
        lines.append(contact_of(result.contact, given).description)
    if result.initial is not None:
        lines.append(f"initial state of {result.initial}")
    if result.compression is not None:
        kind = "shorter" if result.compression > 0.0 else "longer"
        lines.append(f"bonds {kind} by {abs(result.compression):.6g} at first")
    if result.temperature is not None:
        lines.append(f"warm at first: T = {result.temperature:.6g}, seed {result.seed}")
    return lines
