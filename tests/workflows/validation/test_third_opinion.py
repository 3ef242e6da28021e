"""Test both engines against ASE and SciPy, which share only the potentials."""

import numpy as np
import pytest
from ase import Atoms
from ase.calculators.calculator import Calculator, all_changes
from ase.md.verlet import VelocityVerlet
from ase.vibrations.data import VibrationsData
from scipy.integrate import solve_ivp

from chaincor import collide
from chaincor.analysis.modes import mode_frequencies
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps import engine as lammps


class ChainBonds(Calculator):
    """ASE calculator of bonds between neighbours along x, used in units of the chain."""

    implemented_properties = ("energy", "forces")

    def __init__(self, bond):
        super().__init__()
        self.bond = bond

    def calculate(self, atoms=None, properties=("energy",), system_changes=all_changes):
        super().calculate(atoms, properties, system_changes)
        strains = np.diff(self.atoms.positions[:, 0]) - 1.0
        pushes = self.bond.force(strains)
        forces = np.zeros((len(self.atoms), 3))
        forces[1:, 0] += pushes
        forces[:-1, 0] -= pushes
        self.results = {"energy": float(np.sum(self.bond.energy(strains))), "forces": forces}


def chain_atoms(scene):
    n = scene.particles
    positions = np.zeros((n, 3))
    positions[:, 0] = np.arange(n)
    velocities = np.zeros((n, 3))
    velocities[:, 0] = -scene.impact_velocity
    velocities[0, 0] = scene.impact_velocity
    atoms = Atoms(
        "H" * n, positions=positions, masses=np.ones(n), calculator=ChainBonds(scene.bond)
    )
    atoms.set_velocities(velocities)
    return atoms


# Older versions of ASE do not close the unused log.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_ase_velocity_verlet_takes_the_same_steps_until_the_next_contact():
    scene = Scene(potential="lj", particles=8, speed=0.4)
    step, steps = 0.0125, 100  # up to t = 1.25, well before the second contact near t = 1.8
    atoms = chain_atoms(scene)
    VelocityVerlet(atoms, timestep=step).run(steps)
    frames = lammps.run(
        scene.problem, Numerics(scheme="verlet", timestep=step), frame_interval=step * steps
    ).frames
    assert frames.times[1] == pytest.approx(step * steps)
    # Both programs kick, drift and kick. Tables have an error of 3e-13 times the largest force,
    # about 1 here, and rounding adds n eps per step.
    displacements = atoms.positions[:, 0] - np.arange(8)
    np.testing.assert_allclose(frames.displacements[1], displacements, rtol=0, atol=1e-12)
    np.testing.assert_allclose(frames.velocities[1], atoms.get_velocities()[:, 0], atol=1e-12)


@pytest.mark.parametrize("potential", ["harmonic", "lj", "toda", "log"])
def test_ase_finds_the_frequencies_of_the_free_chain(potential):
    n = 12
    scene = Scene(potential=potential, particles=n)
    atoms = chain_atoms(scene)
    step = 1e-4
    hessian = np.zeros((n, n))
    for i in range(n):
        for sign in (1, -1):
            moved = atoms.copy()
            moved.calc = ChainBonds(scene.bond)
            moved.positions[i, 0] += sign * step
            hessian[i] -= sign * moved.get_forces()[:, 0] / (2 * step)
    full = np.zeros((n, 3, n, 3))
    full[:, 0, :, 0] = hessian
    data = VibrationsData(atoms, full)
    # ASE returns energies hbar omega. After sorting, the 2n modes without stiffness and mode 0 come
    # first.
    energies, _ = data.get_energies_and_modes()
    found = np.sort(energies.real)[-(n - 1) :]
    expected = mode_frequencies(n)[1:]
    # Ratios need no units. The error of the central difference is step^2 U''''/6 < 1e-8 * 2000/6.
    np.testing.assert_allclose(found / found[-1], expected / expected[-1], rtol=1e-5)


def dop853(scene, accuracy):
    """Integrate by SciPy, with wall hits as events, until 2.5 sound round trips have passed."""
    n, bond, v0 = scene.particles, scene.bond, scene.impact_velocity

    def motion(_, state):
        pushes = bond.force(np.diff(state[:n]))
        acceleration = np.zeros(n)
        acceleration[1:] += pushes
        acceleration[:-1] -= pushes
        return np.concatenate((state[n:], acceleration))

    def wall(_, state):
        return state[0]

    wall.terminal, wall.direction = True, -1.0
    state = np.concatenate((np.zeros(n), np.full(n, -v0)))
    state[n] = v0
    times, now = [0.0], 0.0
    while True:
        found = solve_ivp(
            motion, (now, 5.0 * n), state, "DOP853", events=wall, rtol=accuracy, atol=accuracy * v0
        )
        state, now = found.y[:, -1].copy(), found.t[-1]
        if found.status != 1:
            return state[n:], np.array(times)
        times.append(now)
        state[0], state[n] = 0.0, -state[n]


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene",
    [
        Scene(potential="lj", particles=20, speed=0.4),
        Scene(potential="toda", particles=15, speed=1.0),
        Scene(potential="log", particles=10, speed=0.8),
        Scene(potential="power", power_order=4, power_c=1.0, particles=12, speed=0.5),
    ],
    ids=lambda scene: scene.label,
)
@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_scipy_agrees_with_both_engines(scene, engine):
    velocities, times = dop853(scene, 1e-12)
    eta = (velocities.mean() / scene.impact_velocity) ** 2
    result = collide(scene.replace(engine=engine), tolerance=1e-9)
    assert result.contacts == len(times)
    # DOP853 with 1e-12 per step has an error of about 1e-10 in a collision of some hundred steps.
    assert abs(result.restitution - eta) <= result.restitution_error + 1e-10
    np.testing.assert_allclose(result.contact_times, times, rtol=0, atol=1e-6)
