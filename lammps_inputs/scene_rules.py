"""What the fields of a scene must fulfil together."""

from typing import TYPE_CHECKING

from chaincor.lammps_inputs.bonds.potentials import Harmonic

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene

# What only bonds of one potential have.
BOND_KEYS = {
    "toda_b": "toda",
    "morse_a": "morse",
    "power_order": "power",
    "power_c": "power",
    "bond_file": "table",
    "energy": "formula",
    "parameters": "formula",
}
NUMERICS_KEYS = ("wall", "scheme", "timestep", "table", "table_points")
# Relative to the fastest chain mode (omega = 2 sqrt(U''(1))) Verlet is unstable from omega dt = 2.
VERLET_STABILITY_LIMIT = 2.0

# Shorter steps would take days to the end of the smallest collision, and drown in rounding.
SHORTEST_TIMESTEP = 1e-9


def check_together(scene: "Scene") -> None:
    """Refuse fields, each valid by itself, that do not go together: ValueError, one line."""
    _check_parameters(scene)
    _check_speed(scene)
    _check_numerics(scene)


def _check_parameters(scene: "Scene") -> None:
    for key, owner in BOND_KEYS.items():
        if getattr(scene, key) is not None and scene.potential != owner:
            raise ValueError(f"{key} goes with potential '{owner}', not '{scene.label}'")
    if scene.potential == "power" and (scene.power_order is None or scene.power_c is None):
        raise ValueError("potential 'power' needs power_order and power_c")
    if scene.potential == "table" and scene.bond_file is None:
        raise ValueError("potential 'table' needs bond_file")
    if scene.potential == "formula" and scene.energy is None:
        raise ValueError("potential 'formula' needs energy, such as \"D*(1-exp(-a*s))^2\"")
    _ = scene.bond  # raises for impossible parameters


def _check_speed(scene: "Scene") -> None:
    if scene.speed is not None and scene.velocity is not None:
        raise ValueError("speed and velocity are both given; give one")
    if scene.speed is not None and scene.bond.natural_speed is None:
        raise ValueError(
            f"speed is in units of v*, which the {scene.label} bond does not have; give velocity"
        )
    if not 1e-150 < scene.impact_velocity < 1e150:
        raise ValueError(
            f"the impact velocity would be {scene.impact_velocity:g}; expected a number that "
            "floating point can square"
        )


def _check_numerics(scene: "Scene") -> None:
    given = [key for key in NUMERICS_KEYS if getattr(scene, key) is not None]
    if not scene.error and not given:
        raise ValueError(
            "error is False, and the numerics are chosen by an error bar; expected explicit ones "
            "beside it, such as scheme and timestep: drop one or give the other"
        )
    if isinstance(scene.bond, Harmonic):
        for key in ("table", "table_points"):
            if getattr(scene, key) is not None:
                raise ValueError(
                    f"{key} is for tabulated bonds; LAMMPS has the harmonic one exactly: drop it"
                )
    if scene.tolerance is not None and given:
        raise ValueError(
            f"tolerance and {', '.join(given)} are both given; a tolerance chooses the "
            "numerics by itself: drop one or the other"
        )
    if scene.engine == "reference":
        for key in ("table", "table_points", "save", "dump"):
            if getattr(scene, key) is not None:
                raise ValueError(
                    f"{key} is for engine 'lammps'; the reference has no tables, jobs or dumps"
                )
        if scene.wall == "reflect":
            raise ValueError("wall 'reflect' is for engine 'lammps'; the reference has 'event'")
    if scene.wall == "reflect" and scene.scheme not in (None, "verlet"):
        raise ValueError(f"wall 'reflect' goes with scheme 'verlet', not '{scene.scheme}'")
    if scene.timestep is not None:
        if scene.timestep < SHORTEST_TIMESTEP / scene.bond.stiffness**0.5:
            raise ValueError(
                f"timestep is {scene.timestep:g}; expected {SHORTEST_TIMESTEP:g} or more: a "
                "shorter one would not come to an end"
            )
        limit = VERLET_STABILITY_LIMIT / (2.0 * scene.bond.stiffness**0.5)
        if scene.timestep >= limit:
            raise ValueError(
                f"timestep is {scene.timestep:g}; expected less than {limit:g}, where the "
                "integration of the chain's fastest mode becomes unstable"
            )
