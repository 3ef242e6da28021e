"""Collisions whose restitution is proved, and the table of proved statements."""

import json
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from chaincor.lammps_inputs.scene import Scene

TABLE = Path(__file__).with_name("table.json")
_PARAMETERS = {"toda": {"toda_b": 10.0}}


@dataclass(frozen=True)
class Case:
    """Collision to be proved; all parameters are exact doubles."""

    potential: str  #: "harmonic", "lj", "toda" (b = 10) or "log".
    masses: tuple[float, ...]  #: Masses of the particles, from the wall outward.
    velocity: float  #: Impact speed in the chain's units.
    target_mass: float | None = (
        None  #: Mass of a free particle in place of the wall; None for a wall.
    )
    digits: int = 80  #: Decimal digits of the arithmetic. Some collisions lose more digits.

    @property
    def name(self) -> str:
        """Name of the case, from bond, number of particles, speed and special features."""
        special = "" if set(self.masses) == {1.0} else "-masses"
        special += "" if self.target_mass is None else "-target"
        return f"{self.potential}-{len(self.masses)}-{self.velocity:g}{special}"

    def scene(self, **settings: object) -> Scene:
        """Return the collision as a scene."""
        return Scene(
            potential=self.potential,
            particles=len(self.masses),
            velocity=self.velocity,
            masses=None if set(self.masses) == {1.0} else list(self.masses),
            target_particles=None if self.target_mass is None else 1,
            target_masses=None if self.target_mass is None else [self.target_mass],
            **_PARAMETERS.get(self.potential, {}),
            **settings,
        )


@dataclass(frozen=True)
class Row:
    """
    Proved statement: eta is within `radius` of `middle`. Both are exact decimal numbers.
    """

    case: str  #: Name of the case.
    #: Enclosure of eta.
    middle: str
    radius: str  #: See ``middle``.
    contacts: int  #: Number of contacts. The last is `last_contact_time` after the first.
    last_contact_time: float
    steps: int  #: Number of Taylor steps in the proof.
    seconds: float  #: Processor time of the proof.

    def refutes(self, restitution: float, error: float) -> bool:
        """Return whether a restitution and its error bar contradict the enclosure."""
        off = abs(Fraction(restitution) - Fraction(self.middle))
        return off > Fraction(error) + Fraction(self.radius)

    @property
    def digits(self) -> int:
        """Number of proved decimal digits of eta."""
        share = Fraction(self.radius) / abs(Fraction(self.middle))
        digits = 0
        while share * 10 ** (digits + 1) <= 1:
            digits += 1
        return digits


_SPEEDS = {"harmonic": (0.125, 0.5), "lj": (0.0625, 0.09375), "toda": (0.125, 0.25)}
_SPEEDS["log"] = (0.25, 0.75)
_DIGITS = {2: 60, 5: 90, 10: 130}

CASES = (
    *(
        Case(potential, (1.0,) * n, velocity, digits=_DIGITS[n])
        for n in (2, 5, 10)
        for potential, speeds in _SPEEDS.items()
        for velocity in speeds
    ),
    Case("harmonic", (2.0, 1.0), 0.125, digits=60),
    Case("lj", (1.0, 3.0, 0.5, 1.0, 2.0), 0.0625, digits=90),
    Case("toda", (4.0, 1.0, 1.0, 1.0, 1.0), 0.125, digits=90),
    Case("log", (0.5, 1.0, 2.0, 3.0, 4.0), 0.25, digits=90),
    Case("harmonic", (1.0,) * 5, 0.125, target_mass=1.5, digits=90),
    Case("lj", (1.0,) * 5, 0.0625, target_mass=0.5, digits=90),
    Case("lj", (2.0, 1.0, 1.0, 1.0, 2.0), 0.0625, target_mass=4.0, digits=90),
    Case("log", (1.0,) * 10, 0.25, target_mass=2.0, digits=130),
)


def read_table() -> list[Row]:
    """Return the rows that were proved; empty if the table does not exist."""
    if not TABLE.is_file():
        return []
    return [Row(**row) for row in json.loads(TABLE.read_text())]
