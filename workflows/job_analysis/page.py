"""Write a page about an analysis: results, their meaning, figures and data files."""

from collections.abc import Mapping
from pathlib import Path

from chaincor.analysis.observables import TERMS, TERMS_OF_DUMPS, rows_of
from chaincor.analysis.results import CollisionAnalysis
from chaincor.analysis.showing.numbers import known_digits, root_of_known
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem
from chaincor.workflows.job_analysis.description import describe_in_units
from chaincor.workflows.pages.page import drawn_figures, files_written, listed_file, write_page
from chaincor.workflows.versions import processor, versions

PAGE = "analysis.html"

FIGURES = {
    "trajectories": (
        "World lines",
        "Each line shows one particle, with magnified displacements. Dots on "
        "the wall mark contacts of particle 1. The dashed line shows the sound "
        "that the first contact sends through the chain.",
    ),
    "contacts": (
        "Contacts",
        "The upper panel shows the time from each contact to the next, and the "
        "lower panel the incoming speed of particle 1. The lines are the "
        "values for two particles at low speed.",
    ),
    "energy": (
        "Energy of translation and vibration",
        "The curves show the translational energy of the chain and its "
        "vibrational energy, as fractions of the energy at impact. The "
        "translational fraction after the last contact is eta.",
    ),
    "bonds": (
        "Bond lengths",
        "The curves show the shortest and the longest bond in each frame. If "
        "the longest bond keeps growing, the chain has broken.",
    ),
    "spectrum": (
        "Energy of the modes",
        "The points show the energy of mode j after the last frame, with the "
        "longest wave first. The line is the theory of Basile and Dumont, in "
        "which all contacts are alike.",
    ),
    "target_spectrum": (
        "Energy of the target's modes",
        "The points show the energy of mode j of the free target after the "
        "last frame, with the longest wave first.",
    ),
    "mode_heat_map": (
        "Energy of the modes in time",
        "The map shows how each contact feeds the modes, with the longest waves at the bottom.",
    ),
    "target_mode_heat_map": (
        "Energy of the target's modes in time",
        "The map shows how each contact feeds the modes of the free target.",
    ),
}

HOLDS = {
    "analysis.json": "all numbers of this page, with lists of contacts and modes",
    "arrays.npz": "masses, contacts, modes, and the motion, as NumPy arrays",
    "contacts.csv": "each contact: time, interval, incoming speed",
    "modes.csv": "each mode: frequency, energy, its share, and the theory of equal contacts",
    "history.csv": "each frame: momentum, energies, shortest and longest bond",
    "*.png": "figure",
}


def write_analysis_page(
    analysis: CollisionAnalysis, folder: Path, beside: Mapping[Path, str], units: UnitSystem
) -> None:
    """
    Write ``analysis.html`` into the folder to which `write_analysis` has written.

    `beside` describes each other file in the folder, and `units` are the units of the dump.
    """
    statistics = analysis.contact_statistics
    error = analysis.restitution_error
    known = max(error or 0.0, analysis.data_error)
    job = analysis.job
    assert job is not None
    scene = job.loaded_scene
    terms = TERMS | TERMS_OF_DUMPS
    settings = {
        "contacts found by": analysis.detection.method,
        "frames": f"{analysis.frames}, from t = {analysis.time_start:.6g} to "
        f"{analysis.time_end:.6g} (0: first contact)",
        "time step of the dump": "the dump carries the time"
        if analysis.timestep is None
        else f"{analysis.timestep:.12g}",
    }
    if scene is not None:
        settings |= {f"scene: {key}": str(value) for key, value in scene.canonical_fields.items()}
        settings["scene: SHA-256"] = scene.sha256
    if units != CHAIN_UNITS:
        settings["in the dump's units"] = describe_in_units(analysis, units)
    contents = {
        "heading": analysis.heading,
        "eta": known_digits(analysis.restitution, max(known, 1e-12)),
        "eta_error": None if error is None else f"{error:.1e}",
        "data_error": f"{analysis.data_error:.1e}",
        "kinematic": root_of_known(analysis.kinematic_restitution, known),
        "contacts": f"{'≥ ' if analysis.contacts is None else ''}{statistics.count}",
        "rows": [(name, text, terms[name]) for name, text in rows_of(analysis, dump=True)],
        "terms": {name: terms[name] for name in _BESIDE},
        "contradictions": analysis.contradictions,
        "notes": [each for each in analysis.caveats if each not in analysis.contradictions],
        "figures": drawn_figures(folder, FIGURES, analysis.heading),
        "settings": settings | {"processor of the analysis": processor()},
        "versions": versions(),
        "read": [listed_file(path, kind) for kind, path in job.files],
        "written": files_written(folder, HOLDS),
        "beside": [listed_file(path, what) | {"name": str(path)} for path, what in beside.items()],
    }
    write_page(folder / PAGE, "chaincor.workflows.job_analysis", contents)


# The page also explains these labels, although they are no names of observables.
_BESIDE = ("v*", "frames", "format and reading", "anharmonic remainder")
