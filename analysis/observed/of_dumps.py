"""Functions that read observables from the analysis of a dump, if no attribute has them."""

from typing import TYPE_CHECKING, Any

from chaincor.analysis.showing import lines

if TYPE_CHECKING:
    from chaincor.analysis.results import CollisionAnalysis


def energy_of_all(analysis: "CollisionAnalysis", name: str) -> float | None:
    """Return the energy of all bodies; None if the bond is unknown."""
    parts = [getattr(body, name) for body in analysis.bodies.values()]
    return None if None in parts else sum(float(part.total) for part in parts)


def body_line(analysis: "CollisionAnalysis", owner: str) -> str | None:
    """Return the printed line about a body of a dump; None if the line would only repeat eta."""
    if (analysis.target is None and not analysis.soft) or owner not in analysis.bodies:
        return None
    body = analysis.bodies[owner]
    energy = body.energy_end
    parts = (None, None) if energy is None else (energy.translation, energy.vibration)
    return lines.body_text(body.velocity_after, *map(_float, parts))


def _float(value: Any) -> float | None:
    return None if value is None else float(value)


def energy_of(owner: str, part: str) -> Any:
    """Return a function that reads a part of a body's energy in the last frame."""

    def read(analysis: "CollisionAnalysis") -> float | None:
        body = analysis.bodies.get(owner)
        energy = None if body is None else body.energy_end
        return None if energy is None else float(getattr(energy, part))

    return read


def of_target(name: str, absent: Any) -> Any:
    """Return a function that reads an attribute of a dump's free target."""
    return lambda a: absent if a.target is None else getattr(a.target, name)


def contacts_line(analysis: "CollisionAnalysis") -> str:
    """Return the number of contacts in a dump, and the time of the last contact, as text."""
    if analysis.soft:
        return "not reported for soft bodies"
    found = analysis.contact_statistics
    count = f"at least {found.count}" if analysis.contacts is None else found.count
    return f"{count}, the last at t = {lines.number_or_dash(found.last_time)}"


def warm_at_first(analysis: "CollisionAnalysis") -> bool:
    """Return whether the chain vibrated in the first frame."""
    return analysis.restitution_bound is None or analysis.restitution_bound > 1.0 + 1e-9


def vibration(analysis: "CollisionAnalysis") -> str | None:
    """Return the line about the vibration of a chain that hit a hard wall."""
    if analysis.target is not None or analysis.soft or analysis.energy_end is None:
        return None
    share = 100.0 * float(analysis.energy_end.vibration / analysis.energy_end.total)
    left_out = f"anharmonic remainder {analysis.anharmonic_remainder:.3g}"
    return f"{share:.4g} % of the energy, {left_out}"


def interval(analysis: "CollisionAnalysis") -> str | None:
    """Return the line about the times between contacts."""
    found = analysis.contact_statistics
    if found.mean_interval is None:
        return None
    return f"{found.mean_interval:.6g} on average, median {found.median_interval:.6g}"


def incoming_speed(analysis: "CollisionAnalysis") -> str | None:
    """Return the line about the speeds before contacts."""
    mean = lines.number_or_dash(analysis.contact_statistics.mean_speed)
    return None if analysis.soft else f"{mean} v0 on average"
