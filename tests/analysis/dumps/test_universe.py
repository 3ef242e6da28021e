import numpy as np
import pytest

pytest.importorskip("MDAnalysis")

import MDAnalysis

from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.dumps.universe import to_mdanalysis, universe_frames
from chaincor.analysis.frame_analysis import analyze_frames
from chaincor.lammps_inputs.bonds.potentials import Harmonic
from chaincor.lammps_inputs.errors import InputError

TIMES = np.arange(0.0, 90.0, 1.0)


def write_data(path, n):
    atoms = "\n".join(f"{i} 1 1 {i - 1} 0 0" for i in range(1, n + 1))
    bonds = "\n".join(f"{i} 1 {i} {i + 1}" for i in range(1, n))
    path.write_text(
        f"chain\n\n{n} atoms\n{n - 1} bonds\n1 atom types\n1 bond types\n\n-10 200 xlo xhi\n"
        "-0.5 0.5 ylo yhi\n-0.5 0.5 zlo zhi\n\nMasses\n\n1 1.0\n\nAtoms # bond\n\n"
        f"{atoms}\n\nBonds\n\n{bonds}\n"
    )
    return path


@pytest.mark.parametrize("name", ["d.lammpstrj", "d.gz"])
def test_every_column_is_exact_in_any_order(harmonic20, dump_writer, name):
    path = dump_writer.write(harmonic20, TIMES, name=name, shuffle=True, cut=50)
    universe = to_mdanalysis(path, write_data(dump_writer.folder / "c.data", 20))
    assert universe.trajectory.n_frames == len(TIMES) - 1
    assert len(universe.bonds) == 19
    for k in (40, 3, 88):
        ts = universe.trajectory[k]
        u, v = harmonic20.state(TIMES[k])
        assert ts.frame == k
        np.testing.assert_array_equal(ts.data["v_displacement"], u)
        np.testing.assert_array_equal(ts.data["vx"], v)
        assert ts.time == TIMES[k]
        np.testing.assert_array_equal(ts.positions[:, 0], (u + np.arange(20)).astype(np.float32))
        np.testing.assert_array_equal(ts.velocities[:, 0], v.astype(np.float32))


def test_analysis_through_a_universe_is_the_direct_one(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES)
    direct = analyze_frames(Dump(path), bond=Harmonic())
    through = analyze_frames(universe_frames(to_mdanalysis(path)), bond=Harmonic())
    assert through.restitution == direct.restitution
    np.testing.assert_array_equal(through.mode_energies, direct.mode_energies)
    np.testing.assert_array_equal(through.contact_times, direct.contact_times)


def test_the_reader_of_mdanalysis_serves_where_it_can(harmonic20, dump_writer):
    path = dump_writer.write(
        harmonic20, TIMES, columns="id x y z vx vy vz v_displacement v_time", shuffle=True
    )
    options = {"topology_format": "DATA", "format": "LAMMPSDUMP", "to_guess": (), "dt": 0.005}
    options["atom_style"] = "id resid type x y z"
    data = write_data(dump_writer.folder / "c.data", 20)
    exact = MDAnalysis.Universe(
        data, path, additional_columns=["vx", "v_displacement", "v_time"], **options
    )
    through = analyze_frames(universe_frames(exact), bond=Harmonic())
    direct = analyze_frames(Dump(path), bond=Harmonic())
    assert through.restitution == direct.restitution
    np.testing.assert_array_equal(through.mode_energies, direct.mode_energies)
    single = MDAnalysis.Universe(data, path, **options)
    with pytest.raises(InputError, match="single-precision"):
        next(universe_frames(single))


def test_dump_modify_time_is_read(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, columns="id x vx", time_item=True)
    assert [ts.time for ts in to_mdanalysis(path).trajectory] == list(TIMES)


def test_steps_are_turned_into_time(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, columns="id x vx", timestep=0.01)
    assert to_mdanalysis(path, timestep=0.01).trajectory[7].time == pytest.approx(7.0)
    assert to_mdanalysis(path).trajectory[7].time == 700.0


def test_data_of_another_chain_is_an_input_error(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES)
    with pytest.raises(InputError, match="do not make a chain"):
        to_mdanalysis(path, write_data(dump_writer.folder / "c.data", 21))
