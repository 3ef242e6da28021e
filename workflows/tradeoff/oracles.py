"""Repeat the steps of a LAMMPS run without one of its sources of error."""

import tempfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.restitution import restitution
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import SCHEMES, Composition
from chaincor.workflows.engines.lammps.flight import flight_of
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.finish import KNOWN_MARGIN

OracleState = tuple[NDArray, NDArray, NDArray]


def lepton_formula(scene: Scene) -> str | None:
    """Return the formula of the bond energy for ``bond_style lepton``; None if there is none."""
    # In Lepton, r is the length minus the natural length, and log is the natural logarithm.
    formula = scene.bond.lammps_formula
    if formula is None:
        return None
    return formula.format(s="r", bond=scene.bond).replace("ln(", "log(").replace(" ", "")


def restitution_with_exact_bonds(scene: Scene, numerics: Numerics, like: Outcome) -> float:
    """
    Run LAMMPS without a table, with ``bond_style lepton``, which differentiates the formula.

    The forces are exact to within rounding. LAMMPS compiles the formula at every force call, which
    takes 100 us or more, so the run is useful only as a reference. It ends after as many contacts
    as `like`, the run with the table. The bond must have a formula. Raise RunError if LAMMPS fails.
    """
    formula = lepton_formula(scene)
    assert formula is not None
    with (
        tempfile.TemporaryDirectory(prefix="chaincor-") as name,
        LammpsChain(scene.problem, numerics, None, Path(name)) as chain,
    ):
        chain.commands(f'bond_style lepton\nbond_coeff 1 1.0 "{formula}"\nrun 0 post no')
        return _collide(scene, numerics, chain, like)


def wider_floats() -> bool:
    """Return whether the machine has floats with more digits than a double."""
    return bool(np.finfo(np.longdouble).eps < 0.01 * np.finfo(np.float64).eps)


def restitution_without_rounding(scene: Scene, numerics: Numerics, like: Outcome) -> float:
    """
    Take LAMMPS's steps in NumPy with exact bonds and with 64 instead of 53 bits of precision.

    The remaining error comes from the integrator. The run ends after as many contacts as `like`,
    the LAMMPS run.
    """
    return _collide(scene, numerics, WideChain(scene, numerics), like)


def _collide(
    scene: Scene, numerics: Numerics, chain: "LammpsChain | WideChain", like: Outcome
) -> float:
    """
    Run a collision until its last contact.

    The run `like` has shown that no further contact follows.
    """
    # Checking the wall only after several steps saves time in LAMMPS, but not in NumPy.
    guarded = isinstance(chain, LammpsChain)
    flight = flight_of(chain, scene.problem, numerics, guarded)  # type: ignore[arg-type]
    # Without one source of error, contacts occur at slightly different times.
    limit = float(like.contact_times[-1]) + KNOWN_MARGIN / scene.bond.stiffness**0.5
    for _ in like.contact_times:
        if flight.advance(limit) is None:
            break
    return float(restitution(chain.v.astype(float), scene.impact_velocity))


class WideChain:
    """
    Chain that is integrated in long doubles, with the interface of :class:`LammpsChain`.

    The attributes ``x``, ``v`` and ``f`` are coordinates, velocities and forces, of shape (n,).
    """

    def __init__(self, scene: Scene, numerics: Numerics) -> None:
        self._bond = scene.bond
        facts = SCHEMES[numerics.scheme]
        assert isinstance(facts, Composition)
        self.weights = facts.weights
        self.timestep = numerics.timestep
        self.x = np.arange(scene.particles, dtype=np.longdouble)
        self.v = np.full(scene.particles, -scene.impact_velocity, dtype=np.longdouble)
        self.f = np.zeros(scene.particles, dtype=np.longdouble)

    def run(self, steps: int) -> None:
        """Take Verlet steps of full length."""
        for _ in range(steps):
            self.verlet(self.timestep)

    def verlet(self, duration: float) -> None:
        """Take one Verlet step (kick, drift, kick), forward or backward."""
        h = np.longdouble(duration)
        self.v += 0.5 * h * self.f
        self.x += h * self.v
        # The strain is computed in long doubles, and then rounded to a double for the potential.
        force = self._bond.force((np.diff(self.x) - 1.0).astype(float))
        self.f[:] = 0.0
        self.f[:-1] -= force
        self.f[1:] += force
        self.v += 0.5 * h * self.f

    def step(self, duration: float | None = None) -> None:
        """Take one composed step, by default of length H."""
        length = self.timestep if duration is None else duration
        for weight in self.weights:
            self.verlet(weight * length)

    def snapshot(self) -> OracleState:
        """Return a copy of x, v and f."""
        return self.x.copy(), self.v.copy(), self.f.copy()

    def restore(self, state: OracleState) -> None:
        """Restore x, v and f from a copy."""
        self.x[:], self.v[:], self.f[:] = state
