"""Observables of the outcome of a collision."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from chaincor.analysis.observed.observable import TextRow, observable
from chaincor.analysis.observed.of_dumps import body_line, contacts_line, energy_of, of_target
from chaincor.analysis.run_record import impulse_residual
from chaincor.analysis.showing import lines


def _energy(definition: str, body: str, part: str) -> Any:
    """Declare a part of the energy of the chain or the target."""
    prefix = "" if body == "chain" else f"{body}_"
    return observable(
        definition,
        unit="energy",
        rare=True,
        shared=True,
        run=lambda r: r.energy(body, part),
        dump=energy_of(prefix, part),
    )


@dataclass(frozen=True, repr=False, kw_only=True)
class MeasuredOutcome:
    """Observables of the outcome of a collision."""

    restitution: float = observable(
        "K_r/K_i, the ratio of the final to the initial kinetic energy of the centre of mass; "
        "with a free target, the ratio of these energies of the relative motion",
        TextRow(
            "restitution (energy)",
            lambda o: lines.restitution_text(
                o.restitution,
                o.restitution_error,
                relative=o.target_particles is not None,
                statistical=o.wall == "reflect",
            ),
            lambda a: lines.restitution_of_dump(a.restitution, a.restitution_error, a.data_error),
            also=("restitution_error",),
            words=("eta", "restitution", "error bar", "K_r/K_i"),
        ),
        symbol="eta",
        run=lambda r: r.restitution,
        dump=lambda a: a.restitution,
        axis=r"restitution $\eta = K_r/K_i$",
    )
    restitution_error: float | None = observable(
        "error bar, the largest expected difference between eta and its exact value; null if no "
        "error bar was requested",
        symbol="+-",
        run=lambda r: r.bar.total,
        dump=lambda a: a.restitution_error,
        in_dumps="error bar of eta; null if neither the log of the run nor a second run gives it",
        axis=r"error bar of $\eta$",
    )
    kinematic_restitution: float = observable(
        "sqrt(eta), the ratio of the final to the initial speed of the centre of mass, which most "
        "other texts call the coefficient of restitution",
        TextRow(
            "restitution (speed)",
            lambda o: lines.root_text(
                o.kinematic_restitution,
                o.restitution_error,
                relative=o.target_particles is not None,
            ),
            lambda a: lines.root_text(
                a.kinematic_restitution, max(a.restitution_error or 0.0, a.data_error)
            ),
            words=("e", "kinematic restitution"),
        ),
        symbol="e",
        run=lambda r: float(np.sqrt(r.restitution)),
        dump=lambda a: a.kinematic_restitution,
        axis=r"kinematic restitution $e = \sqrt{\eta}$",
    )
    contacts: int = observable(
        "number of times that particle 1 hits the wall or the target, including the first contact",
        TextRow(
            "contacts",
            lambda o: (
                f"{lines.count_text(o.contacts, o.contacts_range)}, "
                f"{lines.last_contact(o.last_contact_time, soft=o.contact is not None)}"
            ),
            contacts_line,
            also=("contacts_range", "last_contact_time"),
            words=("t", "last contact", "hits"),
        ),
        run=lambda r: len(r.outcome.contact_times),
        dump=lambda a: a.contacts,
        in_dumps="number of times that particle 1 hits the wall or the target, including the "
        "first contact; null if the frames are too far apart to count contacts",
    )
    contacts_range: tuple[int, int] | None = observable(
        "smallest and largest number of contacts in the runs for the error bar, if these numbers "
        "differ",
        rare=True,
        run=lambda r: r.contacts_range,
    )
    last_contact_time: float = observable(
        "time from the first contact to the beginning of the last contact, in units of "
        "sqrt(mass/stiffness)",
        unit="time",
        symbol="t",
        run=lambda r: float(r.outcome.contact_times[-1]),
        dump=lambda a: a.contact_statistics.last_time,
    )
    last_contact_error: float | None = observable(
        "error bar of the time of the last contact, if known",
        unit="time",
        symbol="+-",
        rare=True,
        run=lambda r: r.last_contact_error,
    )
    largest_overlap: float | None = observable(
        "largest overlap of soft bodies at their contact, by the reference engine",
        unit="length",
        rare=True,
        run=lambda r: r.outcome.tracked.get("largest_overlap"),
    )
    ending: str = observable(
        "whether another contact can come: proved (energy and momentum exclude another contact), "
        "argued (another contact is very unlikely), or open (another contact may still come; "
        "the error bar allows for it)",
        TextRow(
            "end",
            lambda o: lines.ending_text(o.ending, missed=o.tolerance_met is False),
            words=("proved", "argued", "open", "ending"),
        ),
        run=lambda r: r.outcome.ending.kind,
        dump=lambda a: a.ending,
        in_dumps="whether a contact can follow the last frame: proved (none can), argued (very "
        "unlikely), or null",
    )
    velocity_after: float | None = observable(
        "velocity of the chain's centre of mass after the collision, or in a dump's last frame",
        TextRow(
            "chain",
            lambda o: lines.body_text(
                o.velocity_after, o.translational_energy, o.vibrational_energy
            ),
            lambda a: body_line(a, ""),
            also=("translational_energy", "vibrational_energy"),
            words=("translation",),
        ),
        unit="speed",
        rare=True,
        shared=True,
        run=lambda r: r.velocity_after("chain"),
        dump=lambda a: a.velocity_after,
    )
    translational_energy: float | None = _energy(
        "kinetic energy of the motion of the chain's centre of mass", "chain", "translation"
    )
    vibrational_energy: float | None = _energy(
        "all other energy of the chain", "chain", "vibration"
    )
    target_velocity_after: float | None = observable(
        "velocity of the free target's centre of mass after the collision",
        TextRow(
            "target",
            lambda o: lines.body_text(
                o.target_velocity_after,
                o.target_translational_energy,
                o.target_vibrational_energy,
            ),
            lambda a: body_line(a, "target_"),
            also=("target_translational_energy", "target_vibrational_energy"),
        ),
        unit="speed",
        rare=True,
        shared=True,
        run=lambda r: r.velocity_after("target"),
        dump=of_target("velocity_after", None),
    )
    target_translational_energy: float | None = _energy(
        "kinetic energy of the motion of the target's centre of mass", "target", "translation"
    )
    target_vibrational_energy: float | None = _energy(
        "all other energy of the target", "target", "vibration"
    )
    bond_min: float = observable(
        "shortest bond length at the end of any step from the first contact to the last contact; "
        "the natural length is 1",
        TextRow(
            "bond lengths",
            lambda o: lines.bond_lengths(
                o.bond_min, o.bond_max, o.bond_error, soft=o.contact is not None
            ),
            lambda a: f"{a.bond_min:.4g} to {a.bond_max:.4g}" if a.particles > 1 else None,
            also=("bond_max", "bond_error"),
        ),
        unit="length",
        run=lambda r: r.bond_length(0),
        dump=lambda a: a.bond_min,
        in_dumps="shortest bond in any frame",
    )
    bond_max: float = observable(
        "longest bond length at the end of any of these steps",
        unit="length",
        run=lambda r: r.bond_length(1),
        dump=lambda a: a.bond_max,
        in_dumps="longest bond in any frame",
    )
    bond_error: float | None = observable(
        "largest amount by which bonds may have been shorter or longer between the ends of steps; "
        "null if steps have no fixed length",
        unit="length",
        symbol="+-",
        run=lambda r: r.bond_error(),
    )
    bond_range_source: str = observable(
        "run that gives the shortest and longest bond length",
        shared=True,
        run=lambda r: r.bond_range_source,
    )
    energy_drift: float = observable(
        "(E_end - E_start)/E_start, where the total energy E includes the energy dissipated by "
        "damping; 0 for exact motion",
        TextRow(
            "energy drift",
            "{0.energy_drift:.1e}",
            lambda a: None if a.energy_drift is None else f"{a.energy_drift:.1e}",
        ),
        run=lambda r: r.energy_drift,
        dump=lambda a: a.energy_drift,
    )
    dissipated_energy: float | None = observable(
        "energy that the damping of beads has dissipated by the end of the last contact; with "
        "LAMMPS, the energy that is missing at this time",
        TextRow("damping took", lambda o: f"{o.dissipated_energy:.6g}", words=("dissipated",)),
        unit="energy",
        rare=True,
        shared=True,
        run=lambda r: r.outcome.dissipated,
    )
    momentum_residual: float = observable(
        "difference between the final momentum and the momentum that the contacts explain, "
        "divided by the initial momentum, which is n v0 for unit masses; 0 for exact motion",
        TextRow(
            "momentum residual",
            "{0.momentum_residual:.1e} of the initial momentum",
            "{0.momentum_residual:.1e} of the initial momentum",
            words=("momentum", "residual", "n v0", "initial momentum"),
        ),
        run=lambda r: impulse_residual(r.line, r.outcome, r.scene.impact_velocity),
        dump=lambda a: a.momentum_residual,
    )
    fragments: int = observable(
        "number of pieces of the chain; a bond is broken if its two sides move apart with more "
        "energy than is needed to break it",
        TextRow(
            "fragments",
            lambda o: (
                f"{o.fragments} at the last contact: bonds broke" if o.fragments > 1 else None
            ),
            words=("broken",),
        ),
        run=lambda r: r.outcome.fragments,
    )
    crossed: bool = observable(
        "whether particles passed through each other, which the formulas of some bonds allow, but "
        "which real atoms cannot do",
        TextRow(
            "crossed",
            lambda o: (
                "particles passed through each other, which atoms cannot" if o.crossed else None
            ),
        ),
        run=lambda r: r.outcome.crossed,
    )
    reference_restitution: float | None = observable(
        "eta computed by the reference engine, for a LAMMPS run with a tolerance",
        TextRow(
            "reference engine",
            lambda o: lines.restitution_text(
                o.reference_restitution,
                o.reference_error,
                relative=o.target_particles is not None,
            ),
            also=("reference_error",),
        ),
        rare=True,
        shared=True,
        run=lambda r: r.details.get("choice", {}).get("reference_restitution"),
    )
    reference_error: float | None = observable(
        "error bar of the reference engine's eta",
        rare=True,
        shared=True,
        run=lambda r: r.details.get("choice", {}).get("reference_error"),
    )
