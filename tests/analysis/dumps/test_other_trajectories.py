"""Test that trajectories of other programs are read by ASE or MDAnalysis, or refused by name."""

import contextlib
import warnings

import numpy as np
import pytest
from ase.io import write as write_ase

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.dumps.other_formats import ase_atoms, write_extended_xyz
from chaincor.analysis.dumps.other_trajectories import open_trajectory
from chaincor.analysis.dumps.universe import universe_of_states
from chaincor.analysis.job_analysis import analyze_job
from chaincor.analysis.job_folder import find_job
from chaincor.lammps_inputs.bonds.potentials import Harmonic
from chaincor.lammps_inputs.errors import InputError

TIMES = np.arange(0.0, 90.0, 0.25)
ETA20 = 0.86850360724  # reference_values.json


@pytest.fixture(scope="module")
def states(harmonic20):
    return [ChainState(k, time, *harmonic20.state(time)) for k, time in enumerate(TIMES.tolist())]


def write_mdanalysis(states, path, **options):
    import MDAnalysis

    universe = universe_of_states(states, np.ones(20))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with MDAnalysis.Writer(str(path), 20, **options) as writer:
            for ts in universe.trajectory:
                ts.dimensions = [1000.0, 1.0, 1.0, 90.0, 90.0, 90.0]
                writer.write(universe.atoms)


@pytest.mark.parametrize("ending", ["traj", "extxyz", "xyz", "trr", "ncdf"])
@pytest.mark.slow_cases
def test_restitution_is_within_the_error_of_the_format(states, tmp_path, ending):
    path = tmp_path / f"motion.{ending}"
    if ending in ("trr", "ncdf"):
        write_mdanalysis(states, path, velocities=True)
    else:
        frames = [ase_atoms(state, np.ones(20)) for state in states]
        write_ase(path, frames, format="traj" if ending == "traj" else "extxyz")
    analysis = analyze_job(find_job(tmp_path), bond=Harmonic())
    assert abs(analysis.restitution - ETA20) <= analysis.data_error + 1e-11
    assert analysis.contacts == 17
    assert analysis.contradictions == ()
    # The formats store float64, 8 decimals (velocities are 0.1), and 24 bits.
    largest = 1e-11 if ending == "traj" else 5e-6
    assert analysis.data_error < largest


def test_what_this_package_writes_it_reads(harmonic20, dump_writer, tmp_path):
    write_extended_xyz(dump_writer.write(harmonic20, TIMES), tmp_path / "out" / "m.xyz")
    analysis = analyze_job(find_job(tmp_path / "out"), bond=Harmonic())
    assert analysis.restitution == pytest.approx(ETA20, abs=1e-11)


def test_a_copy_beside_a_dump_is_left_alone(harmonic20, dump_writer):
    dump = dump_writer.write(harmonic20, TIMES)
    write_extended_xyz(dump, dump.parent / "copy.xyz")
    assert find_job(dump.parent).dump == dump


def test_positions_alone_are_refused(states, tmp_path):
    write_mdanalysis(states[:3], tmp_path / "m.dcd")
    with pytest.raises(InputError, match="has no velocities"):
        analyze_job(find_job(tmp_path))


def test_elements_without_masses_are_refused(states, tmp_path):
    atoms = ase_atoms(states[0], np.ones(20))
    velocities = atoms.get_velocities()
    del atoms.arrays["masses"], atoms.arrays["momenta"]
    atoms.set_atomic_numbers([18, 36] * 10)
    atoms.new_array("velo", velocities)
    write_ase(tmp_path / "m.extxyz", [atoms], format="extxyz")
    with pytest.raises(InputError, match="types 18, 36 and no Masses are declared"):
        analyze_job(find_job(tmp_path))


@pytest.mark.parametrize("ending", ["trr", "ncdf", "dcd", "traj", "extxyz"])
def test_a_damaged_file_is_named(tmp_path, ending):
    path = tmp_path / f"motion.{ending}"
    path.write_bytes(b"nonsense\n")
    with pytest.raises(InputError, match=r"cannot read the trajectory .*motion\."):
        analyze_job(find_job(tmp_path))


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        analyze_job(find_job(tmp_path, dump=tmp_path / "motion.trr"))


def test_round_numbers_at_first_do_not_tell_the_digits(states, tmp_path):
    # LAMMPS prints by %g with six digits, of which the first frames show one or two.
    path = tmp_path / "g.extxyz"
    lines = []
    for k in range(60):
        speeds = [-0.2, -0.2] if k < 59 else [0.177873, 0.172886]
        lines += ["2", f'Timestep={k} Time={k} pbc="F F F" Properties=species:S:1:pos:R:3:vel:R:3']
        lines += [f"Ar {5 - 0.1 * k + i:g} 0 0 {v:g} 0 0" for i, v in enumerate(speeds)]
    path.write_text("\n".join(lines) + "\n")
    *_, last = open_trajectory(path)
    assert last.significant_digits() == 6
    # The tolerance is half a unit of the sixth digit of 0.17.
    np.testing.assert_allclose(last.resolution("vx", 6), 5e-7)


@pytest.mark.parametrize("ending", ["trr", "ncdf"])
@pytest.mark.parametrize("kept", [0.0, 0.3, 0.7, 0.95])
def test_a_truncated_file_is_one_line_and_leaves_nothing_beside_it(
    states, tmp_path, ending, kept, capfd
):
    path = tmp_path / f"t.{ending}"
    write_mdanalysis(states[:40], path, velocities=True)
    content = path.read_bytes()
    path.write_bytes(content[: 40 + int(kept * (len(content) - 40))])
    with contextlib.suppress(InputError):
        assert len(list(open_trajectory(path))) <= len(states)
    said = capfd.readouterr()
    assert said.out + said.err == ""
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
