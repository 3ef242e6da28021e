"""The collisions whose restitution is proved, and the table of what was proved of them."""

import json
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from chaincor.lammps_inputs.scene import Scene

TABLE = Path(__file__).with_name("table.json")
_PARAMETERS = {"toda": {"toda_b": 10.0}}


@dataclass(frozen=True)
class Case:
    """A collision to be proved; all its numbers are doubles, and exact as such."""

    potential: str  #: "harmonic", "lj", "toda" (b = 10) or "log".
    masses: tuple[float, ...]  #: One mass a particle, the first nearest the wall.
    velocity: float  #: Impact speed in bond lengths and the bond's own unit of time.
    target_mass: float | None = None  #: Mass of a free particle in place of the wall.
    digits: int = 80  #: Decimal digits of the arithmetic: more where the collision loses more.

    @property
    def name(self) -> str:
        """Name of the case: bond, number of particles, speed, special features."""
        special = "" if set(self.masses) == {1.0} else "-masses"
        special += "" if self.target_mass is None else "-target"
        return f"{self.potential}-{len(self.masses)}-{self.velocity:g}{special}"

    def scene(self, **settings: object) -> Scene:
        """Return the collision as a scene of the program."""
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
    Proved statement: the restitution is within `radius` of `middle`, both exact decimal numbers.
    """

    case: str  #: Name of the case.
    #: The enclosure of eta.
    middle: str
    radius: str  #: See ``middle``.
    contacts: int  #: Contacts in all, of which the last was at `last_contact_time` after the first.
    last_contact_time: float
    steps: int  #: Taylor steps of the proof.
    seconds: float  #: Processor time of the proof.

    def refutes(self, restitution: float, error: float) -> bool:
        """Say whether a restitution and its bar miss the enclosure, in exact arithmetic."""
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
    """Return the rows that were proved; none before the first."""
    if not TABLE.is_file():
        return []
    return [Row(**row) for row in json.loads(TABLE.read_text())]
