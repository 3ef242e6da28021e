"""Test warm chains in scripted jobs and dumps, and their analysis."""

import json

import numpy as np
import pytest

from chaincor.analysis.collision_frames import Known
from chaincor.analysis.frame_analysis import analyze_frames
from chaincor.analysis.job_analysis import analyze_job
from chaincor.analysis.job_folder import find_job
from chaincor.analysis.modes import mode_energies
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.job import write_job
from chaincor.workflows.validation.comparison import validate
from tests.lmp import number, run_lmp

WARM = Scene(potential="toda", particles=8, velocity=0.05, temperature=0.01, seed=2)
# The state that LAMMPS prints differs from its internal state in the last digits, which a few
# contacts amplify. Times of steps also differ: only the driver has exact times.
SAME = 1e-9


def energy_of(scene):
    return scene.line.energy(scene.bond, scene.line.strains, scene.line.velocities)


def chain_modes(scene):
    line = scene.line
    displacements = np.cumsum(np.concatenate(([0.0], line.strains[line.first :])))
    velocities = line.velocities[line.first :]
    return mode_energies(displacements, velocities, scene.bond.stiffness, line.chain_masses)


@pytest.mark.slow_cases
@pytest.mark.parametrize("bodies", [{}, {"masses": [1, 2], "target_particles": 5}])
@pytest.mark.slow
def test_lmp_alone_gives_what_python_gives(bodies, tmp_path):
    scene = WARM.replace(**bodies, scheme="verlet", timestep=0.01)
    write_job(scene, tmp_path / "job", dump=True, guards=True)
    done = run_lmp(tmp_path / "job")
    assert done.returncode == 0, done.stdout + done.stderr
    driven = lammps.run(scene.problem, Numerics(scheme="verlet", timestep=0.01))
    assert number(done.stdout, "restitution") == pytest.approx(driven.eta, abs=SAME)
    assert number(done.stdout, "contacts") == len(driven.contact_times)
    # The data file has the drawn state, which belongs to this velocity.
    refused = run_lmp(tmp_path / "job", "-var", "velocity", "0.03")
    assert "OTHER VELOCITY" in refused.stdout
    found = analyze_job(find_job(tmp_path / "job"))
    if found.target is not None:
        # The first frame is the drawn state.
        assert found.mode_energies_start == pytest.approx(chain_modes(scene), rel=1e-9, abs=1e-15)
        assert found.target.mode_energies_start[0] == pytest.approx(0.0, abs=1e-20)
        assert np.sum(found.target.mode_energies_start) > 1e-3
        assert found.restitution == pytest.approx(driven.eta, abs=SAME)
        return
    assert found.contacts == len(driven.contact_times)
    assert found.restitution == pytest.approx(driven.eta, abs=SAME)
    assert found.mode_energies_start == pytest.approx(chain_modes(scene), rel=1e-9, abs=1e-15)
    before = 0.5 * 8 * 0.05**2
    assert found.restitution_bound == pytest.approx(energy_of(scene) / before, rel=1e-9)


def test_a_warm_chain_that_gains_is_no_contradiction(tmp_path):
    scene = WARM.replace(
        particles=10, tolerance=1e-7, dump=tmp_path / "dump.lammpstrj", dump_frames="contacts"
    )
    result = collide(scene)
    assert result.restitution > 1.0
    (tmp_path / "scene.toml").write_text(WARM.replace(particles=10).to_toml())
    found = analyze_job(find_job(tmp_path))
    assert found.contradictions == ()
    assert found.contacts == result.contacts
    assert found.contact_times == pytest.approx(result.contact_times, abs=1e-9)
    assert found.contact_speeds == pytest.approx(result.contact_speeds, abs=1e-9)
    assert found.restitution == pytest.approx(result.restitution, abs=1e-9)
    assert 1.0 < result.restitution < found.restitution_bound


def test_without_its_bond_nothing_is_known_of_what_a_warm_chain_may_gain(tmp_path):
    from chaincor.analysis.dumps.dump import Dump

    path = tmp_path / "dump.lammpstrj"
    collide(WARM.replace(particles=10, tolerance=1e-7, dump=path))
    found = analyze_frames(Dump(path), Known(impact_velocity=0.05))
    assert found.restitution > 1.0
    assert found.restitution_bound is None
    assert found.contradictions == ()
    # With another impact velocity, the first frame is not taken for the start.
    late = analyze_frames(Dump(path), Known(impact_velocity=0.04, bond=WARM.bond))
    assert late.contacts is None


def test_validation_knows_warm_chains():
    report = validate(WARM.replace(tolerance=1e-7))
    assert report.agrees
    assert json.loads(json.dumps(report.to_dict()))["temperature"] == 0.01
