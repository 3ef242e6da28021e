"""Test the motion behind a result, for users of ASE and MDAnalysis."""

import dataclasses
import pickle
import re

import numpy as np
import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import RunError

SCENES = {
    "composed steps in LAMMPS": Scene(particles=10),
    "Verlet in LAMMPS": Scene(particles=10, scheme="verlet", timestep=0.02),
    "the stock wall": Scene(particles=10, wall="reflect", timestep=0.01),
    "harmonic in LAMMPS": Scene(potential="harmonic", particles=10),
    "fixed steps in-house": Scene(particles=10, engine="reference"),
    "modes": Scene(potential="harmonic", particles=10, engine="reference"),
    "adaptive steps": Scene(potential="log", particles=5, speed=2.0, engine="reference"),
}


@pytest.fixture(scope="module", params=SCENES)
def result(request):
    return collide(SCENES[request.param])


def test_the_motion_is_that_of_the_result(result):
    states = result.trajectory(100)
    n, v0 = result.particles, result.velocity
    first, last = states[0], states[-1]
    # With LAMMPS's own wall, the first state is that after the first step.
    assert first.time == (result.timestep if result.wall == "reflect" else 0.0)
    np.testing.assert_allclose(first.displacements, 0.0, atol=1.1 * first.time * v0 + 1e-14)
    assert result.last_contact_time < last.time <= 1.15 * result.last_contact_time + 2.001
    assert 20 < len(states) <= 100
    # The same steps give the same momentum, up to three errors. Sums of n v0 round. At each
    # contact, LAMMPS locates particle 1 at the wall within 1e-12, or 1e-12/v0 in time. The table
    # may have a wider range, whose error is in the error bar.
    eta = (np.mean(last.velocities) / v0) ** 2
    at_wall = result.contacts * 1e-12 / v0 if result.engine == "lammps" else 0.0
    off = 1e-12 * n + at_wall + result.error_parts.table
    assert eta == pytest.approx(result.restitution, abs=off)


def test_ase(result):
    atoms = result.to_ase(100)
    states = result.trajectory(100)
    assert len(atoms) == len(states)
    # The collision starts with the energy n v0^2/2. The tolerance is the largest energy error of
    # these runs.
    start = 0.5 * result.particles * result.velocity**2
    bar = 1e-2 if result.wall == "reflect" else 2e-3 if result.scheme == "verlet" else 1e-6
    for frame, state in zip(atoms, states, strict=True):
        assert np.array_equal(
            frame.positions[:, 0], state.displacements + np.arange(result.particles)
        )
        np.testing.assert_allclose(frame.get_velocities()[:, 0], state.velocities, rtol=1e-15)
        assert frame.info["time"] == state.time
        assert frame.get_total_energy() == pytest.approx(start, rel=bar)
        assert np.all(frame.get_masses() == 1.0)
        assert not frame.pbc.any()
        # Bonds act between particles only.
        assert abs(frame.get_forces().sum()) < 1e-12
    assert list(atoms[0].arrays["bonds"][:2]) == ["1(1)", "2(1)"]
    assert atoms[0].arrays["bonds"][-1] == "_"


def test_forces_are_the_slope_of_the_energy():
    atoms = collide(SCENES["fixed steps in-house"]).to_ase(100)[40]
    bond = Scene().bond
    h = 1e-6
    for i in range(10):
        moved = [atoms.positions[:, 0].copy() for _ in range(2)]
        moved[0][i] -= h
        moved[1][i] += h
        low, high = (float(np.sum(bond.energy(np.diff(x) - 1.0))) for x in moved)
        # Central differences have errors of h^2 U''''/6, some 1e-9 here, and rounding of 1e-17/h.
        assert atoms.get_forces()[i, 0] == pytest.approx(-(high - low) / (2.0 * h), abs=1e-8)


def test_mdanalysis(result):
    universe = result.to_universe(100)
    states = result.trajectory(100)
    assert len(universe.trajectory) == len(states)
    assert len(universe.bonds) == result.particles - 1
    assert list(universe.atoms.ids) == [*range(1, result.particles + 1)]
    assert np.all(universe.atoms.masses == 1.0)
    assert universe.dimensions is None
    for copy in (universe, universe.copy()):
        for k in (7, 3, len(states) - 1):
            ts, state = copy.trajectory[k], states[k]
            assert ts.time == state.time
            assert np.array_equal(ts.data["vx"], state.velocities)
            assert np.array_equal(ts.data["v_displacement"], state.displacements)
            # float32
            np.testing.assert_allclose(ts.velocities[:, 0], state.velocities, rtol=6e-8)


def test_outputs_are_not_written_again(tmp_path):
    result = collide(Scene(particles=5, dump=tmp_path / "d", save=tmp_path / "job"))
    kept = (tmp_path / "d").read_bytes()
    (tmp_path / "d").unlink()
    result.to_ase(10)
    assert kept
    assert not (tmp_path / "d").exists()


def test_a_result_travels_with_its_motion():
    result = collide(SCENES["fixed steps in-house"])
    again = pickle.loads(pickle.dumps(result))
    assert np.array_equal(again.trajectory(5)[3].velocities, result.trajectory(5)[3].velocities)
    assert "replay" not in result.to_dict()


def test_what_cannot_be_shown_is_refused():
    spheres = collide(Scene(particles=5, speed=3000.0, engine="reference", tolerance=1e-3))
    assert spheres.scheme == "hard-sphere"
    with pytest.raises(RunError, match="limit of hard spheres"):
        spheres.to_ase()
    with pytest.raises(InputError, match=r"frames is 1\. Give a whole number, from 2 to"):
        spheres.to_universe(1)
    for frames in (float("nan"), float("inf"), 1e300, 10**15, "all", True):
        with pytest.raises(InputError, match=rf"^frames is {re.escape(repr(frames))}"):
            spheres.trajectory(frames)
    with pytest.raises(InputError, match="does not contain the run that made it"):
        dataclasses.replace(spheres, replay=None).to_ase()
