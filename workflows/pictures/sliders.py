"""A page for people who would rather play than read: collisions, precomputed, behind sliders."""

import base64
import json
import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.pictures.recording import record_motion

POTENTIALS = ("harmonic", "lj", "morse", "toda", "log")
SPEEDS = (0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0)
_FRAMES = 120
# Displacements and velocities travel as 16-bit whole numbers: a picture shows a thousand steps.
_LARGEST = 32767


def explore_page(
    particles: int = 20,
    potentials: Sequence[str] = POTENTIALS,
    speeds: Sequence[float] = SPEEDS,
    progress: Callable[[int, int], None] | None = None,
) -> str:
    """
    Compute all collisions and put them into one self-contained page.

    Speeds are in units of v*. Springs have no v*: their curve is flat, and one collision stands for
    all. `progress` is told the number of collisions done and to do.
    """
    chosen = [
        (potential, speed)
        for potential in potentials
        for speed in (speeds if potential != "harmonic" else (None,))
    ]
    collisions: dict[str, list[dict[str, Any]]] = {potential: [] for potential in potentials}
    for done, (potential, speed) in enumerate(chosen, start=1):
        collisions[potential].append(_collision(potential, particles, speed))
        if progress is not None:
            progress(done, len(chosen))
    data = {
        "particles": particles,
        "speeds": list(speeds),
        "levels": _levels([c["restitution"] for each in collisions.values() for c in each]),
        "collisions": collisions,
    }
    return _template().render(
        # A script ends at the first "</", wherever it stands.
        data=json.dumps(data, allow_nan=False).replace("</", "<\\/"),
        particles=particles,
        potentials=potentials,
        speeds=speeds,
    )


def _levels(restitutions: Sequence[float]) -> list[float]:
    """Return the marks of an axis, 1 the last, that holds all: chains of few lose half and more."""
    first = min(math.floor(10.0 * min(restitutions)), 8)
    return [k / 10.0 for k in range(first, 11)]


def _collision(potential: str, particles: int, speed: float | None) -> dict[str, Any]:
    scene = Scene(potential=potential, particles=particles, speed=speed, engine="reference")
    # The end is not known beforehand: record finely, then pick frames up to it.
    outcome = record_motion(scene, 0.05)
    assert outcome.frames is not None
    end = 1.15 * float(outcome.contact_times[-1]) + 2.0
    moments = np.linspace(0.0, min(end, float(outcome.frames.times[-1])), _FRAMES)
    picked = np.searchsorted(outcome.frames.times, moments - 1e-9)
    displacements = outcome.frames.displacements[picked]
    velocities = outcome.frames.velocities[picked] / scene.impact_velocity
    return {
        "speed": speed,
        "restitution": float((outcome.velocities.mean() / scene.impact_velocity) ** 2),
        "contacts": [round(float(time), 3) for time in outcome.contact_times],
        "fragments": outcome.fragments,
        "ending": outcome.ending.kind,
        "end": float(moments[-1]),
        "frames": _FRAMES,
        "displacements": _packed(displacements),
        "velocities": _packed(velocities),
    }


def _packed(values: np.ndarray) -> dict[str, Any]:
    scale = max(float(np.abs(values).max()), 1e-300)
    whole = np.round(values / scale * _LARGEST).astype("<i2")
    return {"scale": scale / _LARGEST, "base64": base64.b64encode(whole.tobytes()).decode()}


@cache
def _template() -> Any:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("chaincor.workflows.pictures", "templates"),
        undefined=StrictUndefined,
        autoescape=False,
    )
    return environment.get_template("explore.html.j2")
