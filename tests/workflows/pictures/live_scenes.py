"""Provide thirty scenes for the live page, with the results of the reference engine."""

from functools import cache
from typing import Any

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.result import Collision

# At this tolerance, the engine's error bars are a hundredth of the accuracy that the page promises.
TOLERANCE = 1e-11
# The page promises that two of its runs differ by less than this.
PROMISE = 1e-9

_DEFECT = [1.0] * 10 + [10.0] + [1.0] * 9
SCENES: dict[str, dict[str, Any]] = {
    "harmonic-2": {"potential": "harmonic", "particles": 2, "velocity": 0.1},
    "harmonic-100": {"potential": "harmonic", "particles": 100, "velocity": 0.3},
    "harmonic-500": {"potential": "harmonic", "particles": 500, "velocity": 0.01},
    "lj-2": {"potential": "lj", "particles": 2, "speed": 0.5},
    "lj-10": {"potential": "lj", "particles": 10, "speed": 0.01},
    "lj-20": {"potential": "lj", "particles": 20, "speed": 1.0},
    "lj-50": {"potential": "lj", "particles": 50, "speed": 0.7},
    "lj-100": {"potential": "lj", "particles": 100, "speed": 0.4},
    "lj-500": {"potential": "lj", "particles": 500, "speed": 0.05},
    "toda-5": {"potential": "toda", "particles": 5, "speed": 2.0},
    "toda-60": {"potential": "toda", "particles": 60, "speed": 0.6},
    "toda4-200": {"potential": "toda", "toda_b": 4.0, "particles": 200, "speed": 0.2},
    "log-10": {"potential": "log", "particles": 10, "speed": 1.5},
    "log-50": {"potential": "log", "particles": 50, "speed": 0.5},
    "log-150": {"potential": "log", "particles": 150, "speed": 0.1},
    "power4-20": {
        "potential": "power",
        "power_order": 4,
        "power_c": 1.0,
        "particles": 20,
        "speed": 0.6,
    },
    "power3-40": {
        "potential": "power",
        "power_order": 3,
        "power_c": -1.0,
        "particles": 40,
        "speed": 0.15,
    },
    "power6-12": {
        "potential": "power",
        "power_order": 6,
        "power_c": 20.0,
        "particles": 12,
        "speed": 0.8,
    },
    "morse-8": {"potential": "morse", "particles": 8, "speed": 0.3},
    "morse3-30": {"potential": "morse", "morse_a": 3.0, "particles": 30, "speed": 0.5},
    "masses-2": {"potential": "harmonic", "particles": 2, "velocity": 0.1, "masses": [1.3, 1.0]},
    "masses-lj-30": {"potential": "lj", "particles": 30, "speed": 0.3, "masses": [1.0, 2.0]},
    "defect-20": {"potential": "toda", "particles": 20, "speed": 0.5, "masses": _DEFECT},
    "masses-log-12": {"potential": "log", "particles": 12, "speed": 0.4, "masses": [1.0, 0.5, 0.5]},
    "rods": {"potential": "harmonic", "particles": 10, "velocity": 0.1, "target_particles": 20},
    "target-lj": {
        "potential": "lj",
        "particles": 12,
        "speed": 0.3,
        "target_particles": 8,
        "target_masses": [2.0, 1.0],
    },
    "target-1": {
        "potential": "toda",
        "particles": 16,
        "speed": 0.4,
        "target_particles": 1,
        "target_masses": [5.0],
    },
    "warm-toda": {
        "potential": "toda",
        "particles": 10,
        "velocity": 0.05,
        "temperature": 0.01,
        "seed": 2,
        "toda_b": 10.0,
    },
    "warm-lj": {"potential": "lj", "particles": 12, "speed": 0.4, "temperature": 3e-4, "seed": 5},
    "warm-harmonic": {
        "potential": "harmonic",
        "particles": 40,
        "velocity": 0.1,
        "temperature": 2e-3,
        "seed": 3,
    },
}


def page_scene(fields: dict[str, Any]) -> dict[str, Any]:
    """Return a scene in the page's form; a warm scene has the state that the program draws."""
    if "temperature" not in fields:
        return fields
    scene = Scene(engine="reference", **fields)
    state = {
        "strains": scene.line.strains.tolist(),
        "velocities": scene.line.velocities.tolist(),
    }
    plain = {name: value for name, value in fields.items() if name not in ("temperature", "seed")}
    return plain | {"state": state}


@cache
def reference(name: str) -> Collision:
    """Return the reference engine's result of a scene."""
    result = collide(Scene(engine="reference", **SCENES[name]), tolerance=TOLERANCE)
    assert isinstance(result, Collision)
    return result
