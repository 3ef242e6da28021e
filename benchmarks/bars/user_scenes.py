"""Random scenes with bonds of users: kinked, without tension, smooth, and tables of few digits."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.judge.kinks import judge
from chaincor.lammps_inputs.bonds.potentials import lj_force, toda_force
from chaincor.lammps_inputs.bonds.table_file import read_bond_table
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.scene import Scene

# A table is the spline of what it says: rounded values make that rough, which the judge, who does
# not know the knots, follows with steps too short for many particles.
_TABLE_PARTICLES = 12


def bent_force(strain, p, q):
    """Return -s, with stiffness p beyond the strain q above 0, or below it where q < 0."""
    if q >= 0.0:
        return -strain + (1.0 - p) * max(strain - q, 0.0)
    return -strain + (1.0 - p) * min(strain - q, 0.0)


def bent_energy(strain, p, q):
    """Return the energy of :func:`bent_force`."""
    beyond = np.maximum(strain - q, 0.0) if q >= 0.0 else np.minimum(strain - q, 0.0)
    return 0.5 * np.square(strain) - 0.5 * (1.0 - p) * np.square(beyond)


def smooth_force(strain, p, q):
    """Return -s - p s^2 - q s^3."""
    return -strain * (1.0 + strain * (p + q * strain))


def smooth_energy(strain, p, q):
    """Return the energy of :func:`smooth_force`."""
    return strain**2 * (0.5 + strain * (p / 3.0 + 0.25 * q * strain))


class StudyBond(UserBond):
    """A bond of a user whose loops, for the study's sake, are compiled once for all parameters."""

    def __init__(self, kernel, energy, parameters, **options):
        self._kernel, self._parameters = kernel, parameters
        super().__init__(
            lambda s: energy(s, *parameters),
            np.vectorize(lambda s: kernel(s, *parameters), otypes=[float]),
            **options,
        )

    @property
    def force_kernel(self):
        """The force of one strain."""
        return self._kernel

    @property
    def parameters(self):
        """(p, q)."""
        return self._parameters


@dataclass(frozen=True)
class UserCase:
    """What makes a scene, small enough to be sent to another process."""

    kind: str
    p: float
    q: float
    declared: bool
    particles: int
    velocity: float
    engine: str
    tolerance: float

    def scene(self, folder: Path) -> Scene:
        """Return the scene; a table is written into a folder."""
        fields = {
            "particles": self.particles,
            "velocity": self.velocity,
            "engine": self.engine,
            "tolerance": self.tolerance,
        }
        if self.kind == "table":
            return Scene(potential="table", bond_file=self._table(folder), **fields)
        if self.kind == "smooth":
            bond = StudyBond(smooth_force, smooth_energy, (self.p, self.q), name="smooth")
        else:
            kinks = (self.q,) if self.declared else ()
            bond = StudyBond(bent_force, bent_energy, (self.p, self.q), name=self.kind, kinks=kinks)
        return Scene(potential=bond, **fields)

    def _table(self, folder: Path) -> Path:
        strains = np.linspace(-4.0 * self.velocity, 6.0 * self.velocity, 301) + 1e-4 * self.velocity
        force = lj_force if self.p == 0.0 else toda_force
        rows = zip(1.0 + strains, force(strains, self.p, 0.0), strict=True)
        digits = int(self.q)
        lines = [f"{i} {r:.12f} 0.0 {f:.{digits}f}" for i, (r, f) in enumerate(rows, 1)]
        path = folder / "few-digits.table"
        path.write_text("\n".join(["BOND", "N 301", "", *lines, ""]))
        return path

    def truth(self, folder: Path) -> tuple[float, float]:
        """Return eta by the judge, and how well it is known."""
        if self.kind == "table":
            spline = read_bond_table(self._table(folder)).users_force
            knots, terms = spline.x.copy(), spline.c.copy()

            def force(strain, _p, _q):
                k = min(max(np.searchsorted(knots, strain) - 1, 0), terms.shape[1] - 1)
                d = strain - knots[k]
                return ((terms[0, k] * d + terms[1, k]) * d + terms[2, k]) * d + terms[3, k]

            return judge(force, (0.0, 0.0), np.inf, self.particles, self.velocity)
        force, kink = (smooth_force, np.inf) if self.kind == "smooth" else (bent_force, self.q)
        return judge(force, (self.p, self.q), kink, self.particles, self.velocity)


def random_case(random: np.random.Generator, engine: str | None = None) -> UserCase:
    """Draw a case of any kind, for both engines or for one."""
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
