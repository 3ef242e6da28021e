"""Test that MDAnalysis reads a dump in the way that the how-to page describes."""

import numpy as np
import pytest

pytest.importorskip("MDAnalysis")

import MDAnalysis

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


def test_the_reader_of_mdanalysis_keeps_all_digits_of_columns(harmonic20, dump_writer):
    path = dump_writer.write(
        harmonic20, TIMES, columns="id x y z vx vy vz v_displacement v_time", shuffle=True
    )
    universe = MDAnalysis.Universe(
        write_data(dump_writer.folder / "c.data", 20),
        path,
        topology_format="DATA",
        atom_style="id resid type x y z",
        format="LAMMPSDUMP",
        additional_columns=["vx", "v_displacement", "v_time"],
        to_guess=(),
        dt=0.005,
    )
    for ts, time in zip(universe.trajectory, TIMES, strict=True):
        u, v = harmonic20.state(time)
        assert ts.data["v_time"][0] == time
        np.testing.assert_array_equal(ts.data["v_displacement"], u)
        np.testing.assert_array_equal(ts.data["vx"], v)
