"""Format the lines that results of runs and of dumps print."""

import math
from collections.abc import Sequence

import numpy as np

from chaincor.analysis.showing.numbers import eta_of_dump, root_of_known, with_error

ENDINGS = {
    "proved": "energy and momentum rule out another contact",
    "argued": "the collision is very likely over, but this is not proved",
    "open": "another contact may still come; the error bar allows for it",
}
# Largest number of masses in a line.
_MOST_MASSES = 6


def restitution_text(
    value: float, error: float | None, *, relative: bool, statistical: bool = False
) -> str:
    """Return eta with its error bar; `statistical` marks the error bar of the stock wall."""
    level = ", statistical bar, 99.5 %" if statistical and error is not None else ""
    return f"eta = {with_error(value, error)}{_of(relative)}{level}"


def restitution_of_dump(value: float, error: float | None, data_error: float) -> str:
    """Return eta from a dump, with the error due to printed digits."""
    return f"eta = {eta_of_dump(value, error, data_error)}"


def root_text(value: float, error: float | None, *, relative: bool = False) -> str:
    """Return e, without digits below the error of eta."""
    return f"e   = {root_of_known(value, error)}{_of(relative)}"


def count_text(count: int, of_runs: Sequence[int] | None) -> str:
    """Return the number of contacts, or a range if runs disagree."""
    return str(count) if of_runs is None else f"{of_runs[0]} to {of_runs[1]}"


def ending_text(ending: str, *, missed: bool) -> str:
    """Return how certain the end of the collision is, less so if the tolerance was missed."""
    certain = f"{ending} for this run" if missed and ending == "proved" else ending
    return f"{certain}: {ENDINGS[ending]}"


def _of(relative: bool) -> str:
    return ", of the relative motion" if relative else ""


def last_contact(time: float, *, soft: bool) -> str:
    """Return the time of the last contact as text; soft bodies then begin to overlap."""
    return f"the last {'begins ' if soft else ''}at t = {time:.6g}"


def bond_lengths(low: float, high: float, error: float | None, *, soft: bool) -> str:
    """Return the shortest and longest bond, without digits that the time step leaves uncertain."""
    digits = 4 if not error else min(max(math.ceil(-math.log10(error)), 2), 6)
    until = "end of the last contact" if soft else "last contact"
    shown = f"{low:.{digits}f} to {high:.{digits}f} up to the {until}"
    return shown + (f", +- {error:.1g}" if error else "")


def body_text(
    velocity: float | None, translation: float | None, vibration: float | None
) -> str | None:
    """Return the motion of a body as text, with its energies if the bond is known."""
    if velocity is None:
        return None
    text = f"velocity {velocity:.6g}"
    if translation is None:
        return text
    return f"{text}, energy of translation {translation:.6g}, of vibration {vibration:.6g}"


def run_text(
    engine: str, contact: str, scheme: str, timestep: float | None, table: str | None
) -> str:
    """Return the engine, numerics and effort of a run as text."""
    step = "" if timestep is None else f", H = {timestep:.4g}"
    return f"{engine}: {contact}, {scheme}{step}" + ("" if table is None else f", {table}")


def contact_kind(wall: str, *, soft: bool, target: bool) -> str:
    """Return the kind of contact of particle 1, such as a wall."""
    return f"{'soft' if soft else wall} {'contact' if target else 'wall'}"


def masses_text(masses: Sequence[float]) -> str:
    """Return the first few masses as text."""
    shown = ", ".join(f"{mass:.6g}" for mass in masses[:_MOST_MASSES])
    return shown if len(masses) <= _MOST_MASSES else f"{shown}, ... ({len(masses)} in all)"


def strongest_modes(energies: Sequence[float]) -> str:
    """Return the three modes with the most energy, with their fractions of all modes' energy."""
    strongest = sorted(enumerate(energies[1:], start=1), key=lambda e: -e[1])[:3]
    total = float(np.sum(energies))
    return ", ".join(f"j = {j}: {100.0 * energy / total:.3g} %" for j, energy in strongest)


def number_or_dash(value: float | None) -> str:
    """Return a number with six digits, or a dash for None."""
    return "-" if value is None else f"{value:.6g}"
