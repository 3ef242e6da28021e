"""An analysis in lines of text, as ``chaincor analyze`` prints it."""

from chaincor.analysis.results import CollisionAnalysis
from chaincor.analysis.showing.numbers import eta_of_dump, named_lines, root_of_known
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.units.unit_system import UnitSystem
from chaincor.workflows.showing.text import body_text

# A chain whose inner motion is more than so much of its energy came warm.
_WARM = 1.0 + 1e-9


def describe(analysis: CollisionAnalysis) -> str:
    """Describe the results for people, in some lines with the caveats at the end."""
    notes = [f"note: {caveat}" for caveat in analysis.caveats]
    return "\n".join([analysis.heading, "", *named_lines(rows(analysis)), "", *notes])


def rows(analysis: CollisionAnalysis) -> list[tuple[str, str]]:
    """Return what came out, each with its name; ``workflows.showing.terms`` explains the names."""
    statistics = analysis.contact_statistics
    contacts = f"at least {statistics.count}" if analysis.contacts is None else statistics.count
    eta = eta_of_dump(analysis.restitution, analysis.restitution_error, analysis.data_error)
    known = max(analysis.restitution_error or 0.0, analysis.data_error)
    found = [
        ("restitution (energy)", f"eta = {eta}"),
        ("restitution (speed)", f"e   = {root_of_known(analysis.kinematic_restitution, known)}"),
    ]
    if analysis.soft:
        found.append(("contacts", "not told"))
    else:
        found += [
            ("contacts", f"{contacts}, the last at t = {_number(statistics.last_time)}"),
            ("f/n", f"{statistics.per_particle:.4g}"),
        ]
    if statistics.mean_interval is not None:
        text = f"{statistics.mean_interval:.6g} on average, median {statistics.median_interval:.6g}"
        found.append(("interval", text))
    if not analysis.soft:
        found.append(("incoming speed", f"{_number(statistics.mean_speed)} v0 on average"))
    found.append(("momentum residual", f"{analysis.momentum_residual:.1e} of that at impact"))
    if analysis.target is not None or analysis.soft:
        found += _of_bodies(analysis)
    elif analysis.energy_end is not None:
        share = 100.0 * float(analysis.energy_end.vibration / analysis.energy_end.total)
        left_out = f"anharmonic remainder {analysis.anharmonic_remainder:.3g}"
        found.append(("vibration", f"{share:.4g} % of the energy, {left_out}"))
    if analysis.energy_drift is not None:
        found.append(("energy drift", f"{analysis.energy_drift:.1e}"))
    if analysis.particles > 1:
        if analysis.restitution_bound is None or analysis.restitution_bound > _WARM:
            found.append(("strongest at first", _strongest(analysis.mode_energies_start)))
        found += [
            ("strongest modes", _strongest(analysis.mode_energies)),
            ("bond lengths", f"{analysis.bond_min:.4g} to {analysis.bond_max:.4g}"),
        ]
    return found


def describe_in_units(analysis: CollisionAnalysis, units: UnitSystem) -> str:
    """Say the main results in the user's units."""
    last = analysis.contact_statistics.last_time
    text = f"in units {units.style}: v0 = {analysis.velocity * units.speed:.6g}"
    if last is not None:
        text += f", the last contact at t = {last * units.time:.6g}"
    return f"{text}; lengths x {units.length:g}, times x {units.time:.6g}"


def _of_bodies(analysis: CollisionAnalysis) -> list[tuple[str, str]]:
    """Return velocity and energy of the chain, and of a free target."""
    found = []
    for owner, body in analysis.bodies.items():
        energy = body.energy_end
        parts = (None, None) if energy is None else (energy.translation, energy.vibration)
        found.append(("target" if owner else "chain", body_text(body.velocity_after, *parts)))
    return found


def _strongest(energies: Array) -> str:
    """Return the three modes of most energy, with their shares of that of all."""
    strongest = sorted(enumerate(energies[1:], start=1), key=lambda e: -e[1])[:3]
    total = float(energies.sum())
    return ", ".join(f"j = {j}: {100.0 * energy / total:.3g} %" for j, energy in strongest)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"
