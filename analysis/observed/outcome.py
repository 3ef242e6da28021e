"""Observables of the outcome of a collision."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.observed.observable import TextRow, observable
from chaincor.analysis.observed.of_dumps import body_line, contacts_line, energy_of, of_target
from chaincor.analysis.run_record import impulse_residual
from chaincor.analysis.showing import lines

FloatArray = NDArray[np.float64]


def _energy(definition: str, body: str, part: str) -> Any:
    """Declare a part of the energy of the chain or the target."""
    prefix = "" if body == "chain" else f"{body}_"
    return observable(
        definition,
        unit="energy",
        rare=True,
        run=lambda r: r.energy(body, part),
        dump=energy_of(prefix, part),
    )


@dataclass(frozen=True, repr=False, kw_only=True)
class MeasuredOutcome:
    """Observables of the outcome of a collision."""

    restitution: float = observable(
        "K_r/K_i, final over initial kinetic energy of the centre of mass; with a free target, of "
        "the relative motion",
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
        "error bar, how far eta may be from the exact number; null where it was not asked for",
        symbol="+-",
        run=lambda r: r.bar.total,
        dump=lambda a: a.restitution_error,
        in_dumps="error bar of eta; null where neither the run's log nor a second run tells it",
        axis=r"error bar of $\eta$",
    )
    kinematic_restitution: float = observable(
        "sqrt(eta), final over initial speed of the centre of mass; most other texts mean this one",
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
        "how often particle 1 meets the wall or the target, the first time included",
        TextRow(
            "contacts",
            lambda o: (
                f"{lines.count_text(o.contacts, o.contacts_range)}, the last at "
                f"t = {o.last_contact_time:.6g}"
            ),
            contacts_line,
            also=("contacts_range", "last_contact_time"),
            words=("t", "last contact", "hits"),
        ),
        run=lambda r: len(r.outcome.contact_times),
        dump=lambda a: a.contacts,
        in_dumps="how often particle 1 meets the wall or the target, the first time included; null "
        "where the frames are too far apart to count",
    )
    contacts_range: tuple[int, int] | None = observable(
        "fewest and most contacts of the runs that were compared, where these disagree",
        rare=True,
        run=lambda r: r.contacts_range,
    )
    last_contact_time: float = observable(
        "time of the last contact, counted from the first, in units of sqrt(mass/stiffness)",
        unit="time",
        symbol="t",
        run=lambda r: float(r.outcome.contact_times[-1]),
        dump=lambda a: a.contact_statistics.last_time,
    )
    last_contact_error: float | None = observable(
        "error bar of the time of the last contact, where it is known",
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
        "how sure it is that no further contact comes: proved (energy and momentum rule it out), "
        "argued (it is very unlikely), or open (another contact may still come; the error bar "
        "allows for it)",
        TextRow(
            "end",
            lambda o: lines.ending_text(o.ending, missed=o.tolerance_met is False),
            words=("proved", "argued", "open", "ending"),
        ),
        run=lambda r: r.outcome.ending.kind,
        dump=lambda a: a.ending,
        in_dumps="how sure it is that no contact follows the last frame: proved, argued, or null",
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
        "shortest bond from the first contact to the last, at the ends of steps, 1 at rest",
        TextRow(
            "bond lengths",
            lambda o: lines.bond_lengths(o.bond_min, o.bond_max, o.bond_error),
            lambda a: f"{a.bond_min:.4g} to {a.bond_max:.4g}" if a.particles > 1 else None,
            also=("bond_max", "bond_error"),
        ),
        unit="length",
        run=lambda r: r.bond_length(0),
        dump=lambda a: a.bond_min,
        in_dumps="shortest bond in any frame",
    )
    bond_max: float = observable(
        "longest bond in the same time",
        unit="length",
        run=lambda r: r.bond_length(1),
        dump=lambda a: a.bond_max,
        in_dumps="longest bond in any frame",
    )
    bond_error: float | None = observable(
        "how much shorter and longer bonds may have been between the ends of steps; null where "
        "steps have no fixed length",
        unit="length",
        symbol="+-",
        run=lambda r: r.bond_error(),
    )
    bond_range_source: str = observable(
        "which run tells the shortest and longest bond", run=lambda r: r.bond_range_source
    )
    energy_drift: float = observable(
        "(E_end - E_start)/E_start of the total energy E, with the energy that damping took; 0 for "
        "exact motion",
        TextRow(
            "energy drift",
            "{0.energy_drift:.1e}",
            lambda a: None if a.energy_drift is None else f"{a.energy_drift:.1e}",
        ),
        run=lambda r: r.energy_drift,
        dump=lambda a: a.energy_drift,
    )
    dissipated_energy: float | None = observable(
        "energy that the damping of beads took until the last contact ended; by LAMMPS, the energy "
        "that is missing then",
        TextRow("damping took", lambda o: f"{o.dissipated_energy:.6g}", words=("dissipated",)),
        unit="energy",
        rare=True,
        run=lambda r: r.outcome.dissipated,
    )
    momentum_residual: float = observable(
        "distance of the momentum at the end from what the contacts explain, as a share of the "
        "initial momentum, which is n v0 for unit masses; 0 for exact motion",
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
        "number of pieces of the chain; a bond is broken where the two sides move apart with more "
        "energy than the bond can hold",
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
        "whether particles passed through each other, as the formula of their bonds allows; atoms "
        "cannot",
        TextRow(
            "crossed",
            lambda o: (
                "particles passed through each other, which atoms cannot" if o.crossed else None
            ),
        ),
        run=lambda r: r.outcome.crossed,
    )
    reference_restitution: float | None = observable(
        "eta by the reference engine, for a run by LAMMPS with a tolerance",
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
        run=lambda r: r.details.get("choice", {}).get("reference_restitution"),
    )
    reference_error: float | None = observable(
        "error bar of eta by the reference engine",
        rare=True,
        run=lambda r: r.details.get("choice", {}).get("reference_error"),
    )
    contact_times: FloatArray = observable(
        "times of the contacts",
        unit="time",
        shape="(contacts,)",
        run=lambda r: r.outcome.contact_times,
        dump=lambda a: a.contact_times,
    )
    contact_speeds: FloatArray = observable(
        "speeds at which particle 1 comes in, relative to a free target's first particle",
        unit="speed",
        shape="(contacts,)",
        run=lambda r: r.outcome.contact_speeds,
        dump=lambda a: a.contact_speeds,
    )
    mode_energies: FloatArray = observable(
        "harmonic energies E_j of the free chain's modes after the last contact; j = 0 is the "
        "translation",
        unit="energy",
        shape="(n,)",
        run=lambda r: r.mode_energies,
        dump=lambda a: a.mode_energies,
        in_dumps="energies E_j of the modes in the last frame; modes whose frequencies agree to "
        "rounding share theirs evenly",
    )
    velocities: FloatArray = observable(
        "velocities after the last contact, positive away from the wall",
        unit="speed",
        shape="(n,)",
        run=lambda r: r.outcome.velocities,
    )
    displacements: FloatArray = observable(
        "displacements u_i = x_i - (i - 1) after the last contact",
        unit="length",
        shape="(n,)",
        run=lambda r: r.outcome.displacements,
    )
    target_mode_energies: FloatArray | None = observable(
        "energies of the free target's modes",
        unit="energy",
        shape="(M,)",
        rare=True,
        run=lambda r: r.target_mode_energies(),
        dump=of_target("mode_energies", ()),
    )
    target_velocities: FloatArray | None = observable(
        "velocities of the free target from the contact outward",
        unit="speed",
        shape="(M,)",
        rare=True,
        run=lambda r: r.of_target("velocities"),
    )
    target_displacements: FloatArray | None = observable(
        "displacements of the free target: its particle k is at 1 - k + u_k",
        unit="length",
        shape="(M,)",
        rare=True,
        run=lambda r: r.of_target("displacements"),
    )
