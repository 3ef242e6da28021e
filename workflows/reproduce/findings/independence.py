"""What of a harmonic chain does not depend on its velocity: eta, contact time, shares of modes."""

from typing import TYPE_CHECKING

import numpy as np

from chaincor.workflows.reproduce.findings.finding import Finding
from chaincor.workflows.reproduce.measurements import Measurements, Point

if TYPE_CHECKING:
    from collections.abc import Callable

    from chaincor.workflows.reproduce.measurements import Answer

_KEYS = ("independence of v0", "independence of contact time", "independence of modes")


def independence_findings(measured: Measurements) -> dict[str, Finding]:
    """Return how much each quantity differs between velocities, by the key of its rule."""
    points = measured.select("harmonic_velocities", "harmonic")
    ours = [p for p in points if p.source == "lammps"]
    if len(ours) < 2:
        return dict.fromkeys(_KEYS, Finding(np.nan, np.nan, "fewer than two velocities"))
    velocities = [p.scene.impact_velocity for p in ours]
    where = (
        f"between {len(ours)} velocities from {min(velocities):g} to {max(velocities):g} speeds of "
        f"sound, n = {ours[0].particles}, LAMMPS"
    )
    etas = [p.restitution for p in ours]
    return {
        _KEYS[0]: Finding(
            float(np.ptp(etas)),
            2.0 * max(p.error for p in ours),
            f"largest difference of η {where}",
            points,
        ),
        _KEYS[1]: _compare(ours, _contact_time, f"largest difference of t_c/τ {where}"),
        _KEYS[2]: _compare(ours, _shares, f"largest difference of E_j/E of any mode {where}"),
    }


def _contact_time(point: Point, answer: "Answer") -> np.ndarray:
    assert answer.result is not None
    return np.array([answer.result["last_contact_time"] / (point.particles - 1.0)])


def _shares(point: Point, answer: "Answer") -> np.ndarray:
    energy = 0.5 * point.particles * point.scene.impact_velocity**2
    return np.asarray(answer.arrays["mode_energies"])[1:] / energy


def _compare(
    points: list[Point], quantity: "Callable[[Point, Answer], np.ndarray]", text: str
) -> Finding:
    """Compare what has no error bar of its own: the engines' difference stands for it."""
    both = [(p, p.lammps, p.in_house) for p in points if p.difference is not None]
    if len(both) < 2:
        return Finding(np.nan, np.nan, "no in-house result to compare with")
    ours, exact = (
        np.array([quantity(p, a) for p, a in pairs if a is not None])
        for pairs in ([(p, a) for p, a, _ in both], [(p, a) for p, _, a in both])
    )
    return Finding(
        float(np.max(np.ptp(ours, axis=0))),
        2.0 * float(np.max(np.abs(ours - exact))),
        f"{text}; ± twice the largest difference between the engines",
        points,
    )
