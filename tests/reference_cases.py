"""Provide the published reference values: collisions and their converged results."""

import json
from pathlib import Path
from typing import Any

from chaincor.lammps_inputs.scene import Scene

CASES: list[dict[str, Any]] = json.loads(
    (Path(__file__).parent / "reference_values.json").read_text()
)["cases"]
_KEYS = {"b": "toda_b", "r": "power_order", "c": "power_c", "speed_over_vstar": "speed"}
_KEYS |= {name: name for name in ("potential", "particles", "velocity")}


def case_scene(case: dict[str, Any]) -> Scene:
    """Return the scene of a case."""
    return Scene(**{_KEYS[key]: value for key, value in case.items() if key in _KEYS})


def case_name(case: dict[str, Any]) -> str:
    """Return a name that is different for each case."""
    speed = case.get("speed_over_vstar", case.get("velocity"))
    return f"{case['potential']}{case.get('r', '')}-{case['particles']}-{speed}"
