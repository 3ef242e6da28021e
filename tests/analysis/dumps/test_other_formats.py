import numpy as np
import pytest
from ase.io import read

from chaincor.analysis.dumps.other_formats import read_states, to_ase, write_extended_xyz
from chaincor.lammps_inputs.errors import InputError

TIMES = np.arange(0.0, 9.0, 1.0)


def test_ase_atoms_hold_the_numbers_unchanged(harmonic20, dump_writer):
    frames = list(to_ase(dump_writer.write(harmonic20, TIMES)))
    u, v = harmonic20.state(TIMES[4])
    assert len(frames) == len(TIMES)
    np.testing.assert_array_equal(frames[4].get_positions()[:, 0], u + np.arange(20))
    # ASE stores momenta. The velocities come back unchanged, because masses are 1.
    np.testing.assert_array_equal(frames[4].get_velocities()[:, 0], v)
    np.testing.assert_array_equal(frames[4].get_array("displacement"), u)
    assert frames[4].info == {"time": TIMES[4], "step": 800}


def test_extended_xyz_round_trips_through_ase(harmonic20, dump_writer):
    target = dump_writer.folder / "out.xyz"
    assert write_extended_xyz(dump_writer.write(harmonic20, TIMES), target) == len(TIMES)
    frames = read(target, index=":")
    u, v = harmonic20.state(TIMES[4])
    np.testing.assert_array_equal(frames[4].arrays["displacement"], u)
    np.testing.assert_array_equal(frames[4].arrays["velo"][:, 0], v)
    np.testing.assert_array_equal(frames[4].positions[:, 0], u + np.arange(20))
    assert frames[4].info["Time"] == TIMES[4]


def test_time_comes_from_steps_where_there_is_no_other(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, columns="id x vx", timestep=0.01)
    assert [state.time for state in read_states(path)] == [100.0 * t for t in TIMES]
    assert [state.time for state in read_states(path, 0.01)] == pytest.approx(list(TIMES))


def test_a_failed_export_leaves_nothing(harmonic20, dump_writer, tmp_path):
    path = dump_writer.write(harmonic20, TIMES)
    text = path.read_text()
    path.write_text(text + text[:200] + "\n" + text)
    with pytest.raises(InputError):
        write_extended_xyz(path, tmp_path / "sub" / "out.xyz")
    assert not (tmp_path / "sub").exists()
