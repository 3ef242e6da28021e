"""
Give the fields of a scene as plain values, and their hash.

The fields have three forms: canonical (for hashes and keys of stores), as given (for TOML files)
and as shown (for `repr`).
"""

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.scene_parts.given_bodies import body_fields
from chaincor.lammps_inputs.scene_parts.scene_fields import BODY_KEYS, OUTPUT_KEYS

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene

DEFAULT_TOLERANCE = 1e-6
# Largest number of masses that are shown in full.
_MOST_SHOWN = 8
# Encoder of canonical JSON for all calls, because creating an encoder takes as long as using it.
canonical_json = json.JSONEncoder(sort_keys=True, allow_nan=False).encode


def canonical_fields(scene: "Scene") -> dict[str, Any]:
    """
    Return all fields that determine the result, in canonical form for JSON.

    Paths of outputs are omitted. Defaults are included.
    """
    defaults = {"potential": scene.label, "particles": scene.particles, "engine": scene.engine}
    otherwise = (*OUTPUT_KEYS, *BODY_KEYS, "speed")
    fields = defaults | {k: v for k, v in plain_fields(scene).items() if k not in otherwise}
    if isinstance(scene.potential, Potential):
        fields["potential"] = f"object {scene.label} {_force_digest(scene.potential)}"
    else:
        fields |= scene.bond.as_keys()
    fields["velocity"] = scene.impact_velocity
    fields |= body_fields(scene)
    if not scene.explicit and scene.tolerance is None:
        fields["tolerance"] = DEFAULT_TOLERANCE
    if scene.explicit and not scene.error:
        # results with explicit numerics have no error bar and are stored separately
        fields["error"] = False
    return fields


def plain_fields(scene: "Scene") -> dict[str, Any]:
    """Return the given fields as types of TOML and JSON; paths become text."""
    given = scene.model_fields_set
    return {
        key: _plain(value)
        for key in type(scene).model_fields
        if key in given and (value := getattr(scene, key)) is not None
    }


def shown_fields(scene: "Scene") -> dict[str, Any]:
    """
    Return the given fields, and the defaults that determine the collision.

    Used as keywords, these fields make the same scene, unless there are too many masses to show.
    """
    given = plain_fields(scene)
    fields: dict[str, Any] = {"potential": scene.potential, "particles": scene.particles}
    fields |= {key: given[key] for key in (*BODY_KEYS, *given) if key in given}
    state = scene.initial_state
    if not {"speed", "velocity"} & set(given) and (state is None or state.velocities is None):
        scale = scene.bond.natural_speed
        if scale is None:
            fields["velocity"] = scene.impact_velocity
        else:
            fields["speed"] = float(f"{scene.impact_velocity / scale:.12g}")
    fields["engine"] = scene.engine
    if not scene.explicit:
        fields["tolerance"] = scene.asked_tolerance
    for key in ("masses", "target_masses"):
        if len(masses := fields.get(key, ())) > _MOST_SHOWN:
            fields[key] = f"{', '.join(f'{m:g}' for m in masses[:3])}, ... ({len(masses)} in all)"
    return fields


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return list(value)
    return str(value) if isinstance(value, Path) else value


def hash_of(text: str) -> str:
    """Return the SHA-256 of a text, in hexadecimal."""
    return hashlib.sha256(text.encode()).hexdigest()


def _force_digest(bond: Potential) -> str:
    """Return a hash of the force of a user's potential, at strains that the bond allows."""
    strains = np.linspace(max(-0.5, 0.9 * bond.strain_min), min(0.5, 0.9 * bond.strain_max), 101)
    forces = np.array(bond.force(strains), dtype=float)
    forces[np.abs(forces) < 1e-12 * bond.stiffness] = 0.0
    # Ten digits are hashed, because the last of 17 digits depends on the processor. Rounding errors
    # of zeros were removed for the same reason.
    text = " ".join(f"{force:.9e}" for force in forces)
    return hashlib.sha256(text.encode()).hexdigest()[:16]
