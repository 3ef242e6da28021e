"""The error that a scene asks for."""

from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, Scene


def asked_tolerance(scene: Scene) -> float | None:
    """Return the error asked of eta; None with explicit numerics."""
    return None if scene.explicit else scene.tolerance or DEFAULT_TOLERANCE
