"""Test a contact law with damping in both methods of the reference engine."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from chaincor import Scene, UserBond
from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_LAWS
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.workflows.accuracy.solvers import LAMMPS
from chaincor.workflows.engines.reference import adaptive, stepping

STIFFNESS, DRAG = 1.0, 0.2


class DashpotParameters(NamedTuple):
    stiffness: float
    drag: float


def dashpot_force(gap, law):
    return law.stiffness * (-gap) ** 1.5 if gap < 0.0 else 0.0


def dashpot_curvature(gap, law):
    return 1.5 * law.stiffness * (-gap) ** 0.5 if gap < 0.0 else 0.0


def dashpot_drag(gap, law):
    return law.drag if gap < 0.0 else 0.0


@dataclass(frozen=True)
class Dashpot(ContactLaw):
    stiffness: float = STIFFNESS
    drag: float = DRAG

    name = "dashpot-of-a-test"
    keys = {"contact_stiffness": "stiffness", "contact_drag": "drag"}  # noqa: RUF012
    strength_key = "contact_stiffness"
    onset = 1.5
    force_kernel = staticmethod(dashpot_force)
    curvature_kernel = staticmethod(dashpot_curvature)
    drag_kernel = staticmethod(dashpot_drag)

    @property
    def parameters(self):
        return DashpotParameters(self.stiffness, self.drag)

    def energy(self, overlap):
        return 0.4 * self.stiffness * overlap**2.5

    def overlap(self, energy):
        return (2.5 * energy / self.stiffness) ** 0.4


def damped(monkeypatch, **scene):
    """Return the problem of a scene with the contact law of this test."""
    monkeypatch.setitem(CONTACT_LAWS, Dashpot.name, Dashpot)
    problem = Scene(contact="power", engine="reference", **scene).problem
    return replace(problem, line=replace(problem.line, contact=Dashpot()))


def naive_restitution(force, particles, velocity, duration):
    """Return eta of a chain at the damped wall, by SciPy with equations for positions."""

    def rates(_time, state):
        x, v = np.split(state, 2)
        pushes = force(np.diff(x))
        accelerations = np.append(0.0, pushes) - np.append(pushes, 0.0)
        if x[0] < 0.0:
            accelerations[0] += max(0.0, STIFFNESS * (-x[0]) ** 1.5 - DRAG * v[0])
        return np.concatenate((v, accelerations))

    start = np.concatenate((np.arange(particles, dtype=float), np.full(particles, -velocity)))
    # Steps are short, because a kink of the force within a step h gives an error of h^2.
    limits = {"rtol": 1e-10, "atol": 1e-13, "max_step": 0.02}
    moved = solve_ivp(rates, (0.0, duration), start, method="DOP853", **limits)
    return float(np.mean(moved.y[particles:, -1])) ** 2 / velocity**2


def lj_force(lengths):
    return (lengths**-13 - lengths**-7) / 6.0


def bead_force(lengths):
    return np.maximum(1.0 - lengths, 0.0) ** 1.5


@pytest.mark.slow
@pytest.mark.parametrize("compiled", [True, False])
def test_fixed_steps_follow_a_damped_contact(monkeypatch, compiled):
    lj = Scene().bond
    # Numba does not compile methods of objects.
    opaque = UserBond(energy=lambda s: lj.energy(s), force=lambda s: lj.force(s))
    potential = "lj" if compiled else opaque
    problem = damped(monkeypatch, potential=potential, particles=4, velocity=0.05)
    steps = (0.04, 0.02)
    coarse, fine = (stepping.run(problem, Numerics("event", "order8", h)) for h in steps)
    found = fine.eta
    # The error of each run is at most their difference. The naive run has an error of about 0.02^2
    # of the damping.
    error = abs(found - coarse.eta) + 1e-5
    assert error < 1e-4
    assert found == pytest.approx(naive_restitution(lj_force, 4, 0.05, 60.0), abs=error)
    undamped = replace(problem, line=replace(problem.line, contact=Dashpot(drag=0.0)))
    assert stepping.run(undamped, Numerics("event", "order8", 0.04)).eta > 1.2 * found
    assert fine.dissipated == pytest.approx(fine.energy_start - fine.energy_end)


@pytest.mark.slow
def test_adaptive_steps_follow_a_damped_contact(monkeypatch):
    problem = damped(monkeypatch, potential="hertz", particles=4, velocity=0.1)
    outcome = adaptive.run(problem, 1e-7)
    expected = naive_restitution(bead_force, 4, 0.1, 200.0)
    assert outcome.eta == pytest.approx(expected, abs=1e-6)
    # The loops integrate the dissipated energy separately; it must equal the missing energy.
    missing = outcome.energy_start - outcome.energy_end
    assert outcome.dissipated == pytest.approx(missing, rel=1e-5)


def test_lammps_refuses_a_damped_contact(monkeypatch):
    problem = damped(monkeypatch, potential="lj", particles=4, velocity=0.05)
    assert "dashpot-of-a-test" in LAMMPS.refusal(problem)
    with pytest.raises(SceneError, match="LAMMPS has no contact 'dashpot-of-a-test'"):
        problem.line.contact.lammps_force("(0.0-x[1])")
