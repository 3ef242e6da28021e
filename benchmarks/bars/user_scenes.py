"""Random scenes with bonds of users: with kinks, without tension, smooth, and rounded tables."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from chaincor.lammps_inputs.bonds.potential import NoParameters
from chaincor.lammps_inputs.bonds.potentials import LennardJones, Toda
from chaincor.lammps_inputs.bonds.table_bond import read_bond_table
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.scene import Scene
from tests.judge.kinks import judge

# Largest number of particles with a table. Rounded forces make the spline of a table rough, and the
# judge, which does not know the knots, needs very short steps.
_TABLE_PARTICLES = 12


class Bend(NamedTuple):
    """Stiffness at strains beyond a kink, and the strain of the kink, which may be negative."""

    stiffness: float
    kink: float


def bent_force(strain, bend):
    """Return -s, but with another stiffness beyond a kink."""
    if bend.kink >= 0.0:
        return -strain + (1.0 - bend.stiffness) * max(strain - bend.kink, 0.0)
    return -strain + (1.0 - bend.stiffness) * min(strain - bend.kink, 0.0)


def bent_energy(strain, bend):
    """Return the energy of :func:`bent_force`."""
    away = strain - bend.kink
    beyond = np.maximum(away, 0.0) if bend.kink >= 0.0 else np.minimum(away, 0.0)
    return 0.5 * np.square(strain) - 0.5 * (1.0 - bend.stiffness) * np.square(beyond)


class Terms(NamedTuple):
    """Coefficients of a force's quadratic and cubic terms."""

    quadratic: float
    cubic: float


def smooth_force(strain, terms):
    """Return -s - p s^2 - q s^3."""
    return -strain * (1.0 + strain * (terms.quadratic + terms.cubic * strain))


def smooth_energy(strain, terms):
    """Return the energy of :func:`smooth_force`."""
    return strain**2 * (0.5 + strain * (terms.quadratic / 3.0 + 0.25 * terms.cubic * strain))


class StudyBond(UserBond):
    """Bond of a user whose loops are compiled only once for all parameters."""

    def __init__(self, kernel, energy, parameters, **options):
        self._kernel, self._parameters = kernel, parameters
        super().__init__(
            lambda s: energy(s, parameters),
            np.vectorize(lambda s: kernel(s, parameters), otypes=[float]),
            **options,
        )

    @property
    def force_kernel(self):
        """Force at one strain."""
        return self._kernel

    @property
    def parameters(self):
        """Parameters of the scene."""
        return self._parameters


@dataclass(frozen=True)
class UserCase:
    """Parameters of a scene, which are sent to another process."""

    kind: str
    p: float
    q: float
    declared: bool
    particles: int
    velocity: float
    engine: str
    tolerance: float

    def scene(self, folder: Path) -> Scene:
        """Return the scene; its table is written into a folder."""
        fields = {
            "particles": self.particles,
            "velocity": self.velocity,
            "engine": self.engine,
            "tolerance": self.tolerance,
        }
        if self.kind == "table":
            return Scene(potential="table", bond_file=self._table(folder), **fields)
        if self.kind == "smooth":
            bond = StudyBond(smooth_force, smooth_energy, Terms(self.p, self.q), name="smooth")
        else:
            kinks = (self.q,) if self.declared else ()
            bond = StudyBond(
                bent_force, bent_energy, Bend(self.p, self.q), name=self.kind, kinks=kinks
            )
        return Scene(potential=bond, **fields)

    def _table(self, folder: Path) -> Path:
        strains = np.linspace(-4.0 * self.velocity, 6.0 * self.velocity, 301) + 1e-4 * self.velocity
        bond = LennardJones() if self.p == 0.0 else Toda(self.p)
        rows = zip(1.0 + strains, bond.force(strains), strict=True)
        digits = int(self.q)
        lines = [f"{i} {r:.12f} 0.0 {f:.{digits}f}" for i, (r, f) in enumerate(rows, 1)]
        path = folder / "few-digits.table"
        path.write_text("\n".join(["BOND", "N 301", "", *lines, ""]))
        return path

    def reference_value(self, folder: Path) -> tuple[float, float]:
        """Return eta from the judge, and its error."""
        if self.kind == "table":
            spline = read_bond_table(self._table(folder)).users_force
            knots, terms = spline.x.copy(), spline.c.copy()

            def force(strain, _parameters):
                k = min(max(np.searchsorted(knots, strain) - 1, 0), terms.shape[1] - 1)
                d = strain - knots[k]
                return ((terms[0, k] * d + terms[1, k]) * d + terms[2, k]) * d + terms[3, k]

            return judge(force, NoParameters(), np.inf, self.particles, self.velocity)
        if self.kind == "smooth":
            terms = Terms(self.p, self.q)
            return judge(smooth_force, terms, np.inf, self.particles, self.velocity)
        bend = Bend(self.p, self.q)
        return judge(bent_force, bend, bend.kink, self.particles, self.velocity)


def random_case(random: np.random.Generator, engine: str | None = None) -> UserCase:
    """Draw a case of any kind, for a given engine or a random one."""
    kind = str(random.choice(["bent", "slack", "smooth", "table"], p=[0.4, 0.25, 0.2, 0.15]))
    particles = round(10 ** random.uniform(np.log10(2), np.log10(60)))
    velocity = float(10 ** random.uniform(-3, np.log10(0.3)))
    tolerance = float(10 ** random.uniform(-7, -3))
    drawn = str(random.choice(["lammps", "reference"]))
    declared = bool(random.integers(2))
    p, q = 0.0, 0.0
    if kind == "bent":
        p = float(random.choice([0.2, 0.5, 2.0, 4.0]))
        q = float(random.choice([0.0, 0.3, 0.8, -0.3, -0.8])) * velocity
    if kind == "smooth":
        p, q = float(random.uniform(-1.0, 0.0)), float(random.uniform(0.5, 4.0))
    if kind == "table":
        velocity = float(10 ** random.uniform(-3, np.log10(0.03)))
        particles = min(particles, _TABLE_PARTICLES)
        tolerance = max(tolerance, 1e-6)
        p = float(random.choice([0.0, 10.0]))
        q = float(random.integers(6, 12))
    return UserCase(kind, p, q, declared, particles, velocity, engine or drawn, tolerance)
