"""Observables that only the analysis of a dump has."""

from dataclasses import asdict

from chaincor.analysis.observed import of_dumps
from chaincor.analysis.observed.observable import Observable, TextRow
from chaincor.analysis.showing import lines

OF_DUMPS_ALONE: dict[str, Observable] = {
    "data_error": Observable(
        "error of eta due to the limited digits and frames of the dump; it does not include the "
        "error of the run itself (steps, table, wall)",
        rows=(TextRow("format and reading", words=("data error",)),),
        dump=lambda a: a.data_error,
    ),
    "contact_statistics": Observable(
        "number of contacts, mean and median interval between contacts, mean incoming speed",
        dump=lambda a: asdict(a.contact_statistics),
        rows=(
            TextRow(
                "f/n",
                dump=lambda a: None if a.soft else f"{a.contact_statistics.per_particle:.4g}",
                definition="number of contacts divided by the number of particles in the chain; 1 "
                "for hard balls, about 0.87 for long chains of springs",
            ),
            TextRow(
                "interval",
                dump=of_dumps.interval,
                definition="time between successive contacts, in units of sqrt(mass/stiffness)",
            ),
            TextRow(
                "incoming speed",
                dump=of_dumps.incoming_speed,
                definition="speed of particle 1 just before a contact, in units of v0, the speed "
                "of the chain before its first contact",
            ),
        ),
    ),
    "contact_detection": Observable("how contacts were found", dump=lambda a: a.detection.method),
    "energy_start": Observable(
        "energy of all bodies in the first frame",
        unit="energy",
        dump=lambda a: of_dumps.energy_of_all(a, "energy_start"),
    ),
    "energy_end": Observable(
        "energy of all bodies in the last frame",
        unit="energy",
        dump=lambda a: of_dumps.energy_of_all(a, "energy_end"),
    ),
    "translation_end": Observable(
        "energy of the chain's translation in the last frame",
        unit="energy",
        dump=lambda a: float(a.mode_energies[0]),
    ),
    "vibration_end": Observable(
        "all other energy of the chain in the last frame",
        unit="energy",
        dump=of_dumps.energy_of("", "vibration"),
        rows=(
            TextRow(
                "vibration",
                dump=of_dumps.vibration,
                definition="share of the energy in the last frame that is not translational "
                "energy of the chain; in the line `chain`, it is this energy itself",
            ),
        ),
    ),
    "anharmonic_remainder": Observable(
        "bond energy in the last frame that belongs to no mode, because modes are exact only for "
        "springs",
        unit="energy",
        dump=lambda a: a.anharmonic_remainder,
        rows=(TextRow("anharmonic remainder"),),
    ),
    "finished": Observable(
        "whether the dump shows that no contact follows the last frame",
        dump=lambda a: a.finished,
    ),
    "frames": Observable(
        "number of frames read; a frame is the state of all particles, and the motion between two "
        "frames is computed from both",
        dump=lambda a: a.frames,
        rows=(TextRow("frames"),),
    ),
    "time_start": Observable(
        "time of the first frame; the first contact has the time 0",
        unit="time",
        dump=lambda a: a.time_start,
    ),
    "time_end": Observable(
        "time of the last frame; the first contact has the time 0",
        unit="time",
        dump=lambda a: a.time_end,
    ),
    "mode_energies_start": Observable(
        "energies of the modes in the first frame",
        unit="energy",
        shape="(n,)",
        dump=lambda a: a.mode_energies_start,
        rows=(
            TextRow(
                "strongest at first",
                dump=lambda a: (
                    lines.strongest_modes(a.mode_energies_start)
                    if a.particles > 1 and of_dumps.warm_at_first(a)
                    else None
                ),
                definition="the strongest modes in the first frame, if the chain vibrated in this "
                "frame",
            ),
            TextRow(
                "strongest modes",
                dump=lambda a: lines.strongest_modes(a.mode_energies) if a.particles > 1 else None,
                definition="the three vibrational modes with the most energy in the last frame, "
                "and their shares of the energy of all modes; mode j = 1 has the longest wave, "
                "of two chain lengths",
                words=("modes", "j"),
            ),
        ),
    ),
    "target_mode_energies_start": Observable(
        "energies of the target's modes in the first frame",
        unit="energy",
        shape="(M,)",
        rare=True,
        dump=of_dumps.of_target("mode_energies_start", ()),
    ),
    "contradictions": Observable(
        "findings that contradict physics, one sentence each",
        shape="(k,)",
        dump=lambda a: a.contradictions,
    ),
    "caveats": Observable(
        "contradictions and notes, one sentence each",
        shape="(k,)",
        dump=lambda a: a.caveats,
        rows=(
            TextRow(
                "note",
                definition="a limit of the results above; if a note calls something impossible, "
                "the exit status is 1, and none of the results can be trusted",
                words=("notes", "caveats"),
            ),
        ),
    ),
}
