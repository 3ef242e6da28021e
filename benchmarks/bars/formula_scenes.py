"""Random scenes with morse bonds and formulas, with other stiffnesses and natural lengths."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from tests.judge.kinks import judge

# The judge needs much time for the late contacts of a longer broken chain.
_MOST_PARTICLES = 60


class Three(NamedTuple):
    """Parameters of the forces of the judge."""

    p: float
    q: float
    rest: float


def morse_force(strain, printed):
    """Return the force of D (1 - exp(-a s))^2 with D = p and a = q."""
    less = math.expm1(-printed.q * strain)
    return 2.0 * printed.p * printed.q * less * (1.0 + less)


def mie_force(strain, printed):
    """Return the force of 4 eps ((sig/r)^12 - (sig/r)^6) with eps = p and sig = q."""
    r = printed.rest + strain
    sixth = (printed.q / r) ** 6
    return 24.0 * printed.p / r * sixth * (2.0 * sixth - 1.0)


def quartic_force(strain, printed):
    """Return the force of k s^2/2 + c s^4 with k = p and c = q."""
    return -strain * (printed.p + 4.0 * printed.q * strain * strain)


_FORMULAS = {
    "morse formula": ("D*(1 - exp(-a*s))^2", ("D", "a"), morse_force),
    "mie": ("4*eps*((sig/r)^12 - (sig/r)^6)", ("eps", "sig"), mie_force),
    "quartic": ("k*s^2/2 + c*s^4", ("k", "c"), quartic_force),
}


@dataclass(frozen=True)
class FormulaCase:
    """Parameters of a scene, which are sent to another process."""

    kind: str
    p: float
    q: float
    particles: int
    speed: float
    engine: str
    tolerance: float

    def scene(self, folder: Path) -> Scene:
        """Return the scene; no file is written."""
        fields: dict[str, Any] = {
            "particles": self.particles,
            "speed": self.speed,
            "engine": self.engine,
            "tolerance": self.tolerance,
        }
        if self.kind == "morse":
            return Scene(potential="morse", morse_a=self.q, **fields)
        text, names, _ = _FORMULAS[self.kind]
        parameters = dict(zip(names, (self.p, self.q), strict=True))
        return Scene(potential="formula", energy=text, parameters=parameters, **fields)

    def reference_value(self, folder: Path) -> tuple[float, float]:
        """Return eta from the judge, and its error."""
        force = morse_force if self.kind == "morse" else _FORMULAS[self.kind][2]
        printed = Three(self.p, self.q, 2.0 ** (1.0 / 6.0) * self.q if self.kind == "mie" else 1.0)
        velocity = self.scene(folder).impact_velocity
        return judge(force, printed, np.inf, self.particles, velocity)


def random_formula(random: np.random.Generator, engine: str | None = None) -> FormulaCase:
    """Draw a case of any kind, for a given engine or a random one."""
    kind = str(random.choice(["morse", *_FORMULAS], p=[0.4, 0.25, 0.2, 0.15]))
    stiffness = float(10 ** random.uniform(-0.5, 0.5))
    q = float(random.uniform(2.0, 15.0))
    p = 0.5 / q**2
    if kind == "morse formula":
        p *= stiffness
    if kind == "mie":
        q = float(random.uniform(0.75, 1.25))
        p = stiffness * q**2 / (72.0 / 2.0 ** (1.0 / 3.0))
    if kind == "quartic":
        p, q = stiffness, stiffness * q
    drawn = str(random.choice(["lammps", "reference"]))
    return FormulaCase(
        kind=kind,
        p=p,
        q=q,
        particles=round(10 ** random.uniform(np.log10(2), np.log10(_MOST_PARTICLES))),
        speed=float(10 ** random.uniform(-2, np.log10(2.0))),
        engine=engine or drawn,
        tolerance=float(10 ** random.uniform(-8, -3)),
    )
