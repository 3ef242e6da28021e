"""Cells of the map of the extremes, and results of cells."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from chaincor.lammps_inputs.scene import Scene

TOLERANCE = 1e-6
POTENTIALS: dict[str, dict[str, Any]] = {
    "harmonic": {"potential": "harmonic"},
    "lj": {"potential": "lj"},
    "toda 1": {"potential": "toda", "toda_b": 1.0},
    "toda 10": {"potential": "toda", "toda_b": 10.0},
    "toda 100": {"potential": "toda", "toda_b": 100.0},
    "log": {"potential": "log"},
} | {
    f"power {order}": {
        "potential": "power",
        "power_order": order,
        "power_c": 1.0 if order % 2 == 0 else -1.0,
    }
    for order in range(3, 10)
}
SPEEDS = (1e-12, 1e-8, 1e-4, 1e-2, 0.4, 1.0, 3.0, 10.0, 100.0, 1e3)
SIZES = (1, 2, 3, 10, 100, 1000)
ENGINES = ("reference", "lammps")
# Longest chain that LAMMPS runs for all bonds. Longer chains are run for only one bond of each
# kind, because LAMMPS takes ten seconds for 1000 particles.
LAMMPS_LONGEST = 100
LAMMPS_LONG = ("harmonic", "lj", "toda 10", "log", "power 3", "power 4")
# Longer chains that are affordable in the reference engine.
LONG_CELLS = (
    *(("harmonic", 10_000, speed) for speed in (1e-12, 0.4, 1e3)),
    *((name, 10_000, 0.01) for name in ("lj", "toda 10", "log", "power 4")),
    *((name, size, 1e3) for name in ("lj", "toda 100", "log") for size in (10_000, 100_000)),
)


@dataclass(frozen=True)
class Cell:
    """Collision with potential, particles and speed (in units of v*; for harmonic bonds, v0)."""

    potential: str
    particles: int
    speed: float

    def scene(self, engine: str) -> Scene:
        """Return the scene for an engine."""
        key = "velocity" if self.potential == "harmonic" else "speed"
        return Scene(
            **POTENTIALS[self.potential],
            **{key: self.speed},
            particles=self.particles,
            engine=engine,
            tolerance=TOLERANCE,
        )


@dataclass(frozen=True)
class Found:
    """Result of an engine or of the judge for a cell, with the fields of a line in the file."""

    potential: str
    particles: int
    speed: float
    by: str  # reference, lammps or judge
    seconds: float
    restitution: float | None = None
    error: float | None = None
    met: bool = False
    scheme: str = ""
    crossed: bool = False
    failure: str | None = None  # class name of the error
    named: bool = True  # whether the error is a ChaincorError
    message: str = ""

    @property
    def cell(self) -> Cell:
        """Cell of the result."""
        return Cell(self.potential, self.particles, self.speed)


def all_cells(quick: bool) -> Iterator[tuple[Cell, str]]:
    """Yield the cells and engines of the map, or of its quick version."""
    sizes, speeds = SIZES, SPEEDS
    if quick:
        sizes, speeds = (1, 3, 10), (1e-12, 1e-4, 0.4, 3.0, 100.0, 1e3)
    for size in sizes:
        for name in POTENTIALS:
            for speed in speeds:
                yield Cell(name, size, speed), "reference"
                if size <= LAMMPS_LONGEST or name in LAMMPS_LONG:
                    yield Cell(name, size, speed), "lammps"
    if not quick:
        for long_cell in LONG_CELLS:
            yield Cell(*long_cell), "reference"
