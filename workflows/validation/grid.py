"""Build the scenes of ``chaincor validate --grid``: small chains of every kind."""

from typing import Any

from chaincor.lammps_inputs.scene import NUMERICS_KEYS, Scene

_GRID_SIZES = (2, 10, 50)
_GRID_SPEEDS = (0.01, 0.1, 0.4, 1.0)

# Scenes with other bodies: masses, free targets, soft contacts, compressed or warm chains.
_GRID_BODIES: tuple[dict[str, Any], ...] = (
    {"potential": "harmonic", "velocity": 0.1, "masses": (2.0, 1.0)},
    {"potential": "lj", "speed": 0.3, "masses": (1.0, 3.0, 1.0)},
    {"potential": "harmonic", "velocity": 0.1, "target_particles": 20},
    {"potential": "lj", "speed": 0.5, "target_particles": 10},
    {"potential": "toda", "speed": 0.4, "target_particles": 1, "target_masses": (5.0,)},
    {"potential": "log", "speed": 0.3, "masses": (2.0, 1.0), "target_particles": 6},
    {"potential": "lj", "speed": 0.3, "contact": "power"},
    {"potential": "toda", "speed": 0.3, "contact": "power", "target_particles": 5},
    {"potential": "lj", "speed": 0.3, "compression": 0.02},
    {"potential": "toda", "speed": 0.3, "temperature": 1e-3},
    {"potential": "lj", "speed": 0.3, "temperature": 1e-3, "target_particles": 6},
)


def grid_around(scene: Scene, bodies: bool = True) -> list[Scene]:
    """
    Return scenes of harmonic chains at one velocity and of anharmonic chains at several speeds.

    If `bodies` is true and the numerics allow it, scenes with masses, free targets, soft contacts,
    and compressed or warm chains are added. Engine, tolerance and explicit numerics come from
    `scene`.
    """
    fields = {
        name: getattr(scene, name)
        for name in ("tolerance", *NUMERICS_KEYS)
        if getattr(scene, name) is not None
    }
    chains: list[dict[str, Any]] = [{"potential": "harmonic", "velocity": 0.1}]
    tables = {"table": None, "table_points": None}  # For harmonic bonds, LAMMPS needs no table.
    chains += [
        {"potential": potential, "speed": speed}
        for potential in ("lj", "toda", "log")
        for speed in _GRID_SPEEDS
    ]
    sized = [{"particles": n} | chain for n in _GRID_SIZES for chain in chains]
    if bodies:
        # The stock wall is always rigid and hard.
        stock = scene.wall == "reflect"
        needs = {"target_particles", "contact"} if stock else set()
        sized += [{"particles": 10} | chain for chain in _GRID_BODIES if not needs & set(chain)]
    return [Scene(**(fields | chain | (tables if "velocity" in chain else {}))) for chain in sized]
