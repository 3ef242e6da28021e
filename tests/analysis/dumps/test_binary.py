import struct

import numpy as np
import pytest

from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.frame_analysis import analyze_frames
from chaincor.lammps_inputs.errors import InputError


def binary_frame(step, columns, chunks, *, time=None, revision=2, magic=b"DUMPCUSTOM"):
    """Return a frame in the layout of the LAMMPS manual: a header, then a chunk per process."""
    width = len(columns.split())
    data = struct.pack("<q", -len(magic)) + magic + struct.pack("<ii", 1, revision)
    data += struct.pack("<qq", step, sum(map(len, chunks)))
    data += struct.pack("<i6i", 0, 1, 1, 0, 0, 0, 0)
    data += struct.pack("<6d", -10.0, 20.0, -0.5, 0.5, -0.5, 0.5)
    data += struct.pack("<ii", width, 2) + b"lj"
    data += b"\0" if time is None else b"\1" + struct.pack("<d", time)
    data += struct.pack("<i", len(columns)) + columns.encode() + struct.pack("<i", len(chunks))
    for rows in chunks:
        data += struct.pack("<i", len(rows) * width) + np.array(rows, dtype="<f8").tobytes()
    return data


FRAME = binary_frame(5, "id x vx", [[[3, 2.5, 0.1]], [[1, 0.1, 0.2], [2, 1.0, 0.3]]], time=0.125)


def test_binary_frames_are_read_and_sorted(tmp_path):
    path = tmp_path / "d.bin"
    path.write_bytes(FRAME + binary_frame(6, "id x vx", [[[1, 0.0, 0.0]] * 1]))
    first, second = Dump(path)
    assert (first.step, first.time, first.columns) == (5, 0.125, ("id", "x", "vx"))
    np.testing.assert_array_equal(first.column("x"), [0.1, 1.0, 2.5])
    np.testing.assert_array_equal(first.bounds[0], [-10.0, 20.0])
    np.testing.assert_array_equal(
        first.resolution("x", first.significant_digits()), 0.5 * np.spacing([0.1, 1.0, 2.5])
    )
    assert second.time is None


@pytest.mark.parametrize("cut", [1, 9, 40, 100, len(FRAME) - 1])
def test_a_cut_binary_frame_is_left_out(tmp_path, cut):
    path = tmp_path / "d.bin"
    path.write_bytes(FRAME + FRAME[:cut])
    dump = Dump(path)
    assert len(list(dump)) == 1
    assert dump.truncated


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        (binary_frame(5, "id x", [[[1, 0.0]]], revision=1), "revision 1"),
        (binary_frame(5, "x vx", [[[1, 0.0]]]), "with an 'id'"),
        (binary_frame(5, "id x", [[[1, 0.0]]], magic=b"DUMPATOM"), "not a binary LAMMPS dump"),
        (binary_frame(5, "id x", [[[1, 0.0], [1, 0.0]]]), "holds an id twice"),
        (binary_frame(5, "id x", [[]]), "frame of step 5 has no atoms"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path, frame, message):
    path = tmp_path / "d.bin"
    path.write_bytes(frame)
    with pytest.raises(InputError, match=message):
        list(Dump(path))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"id x vx", b"id \xc1 vx"),
        (struct.pack("<i", 2) + b"lj", struct.pack("<i", -1) + b"lj"),
        (struct.pack("<ii", 3, 2) + b"lj", struct.pack("<ii", -2, 2) + b"lj"),
        (b"id x vx" + struct.pack("<i", 2), b"id x vx" + struct.pack("<i", 0)),
        (b"id x vx" + struct.pack("<ii", 2, 3), b"id x vx" + struct.pack("<ii", 2, -3)),
    ],
)
def test_a_damaged_binary_frame_is_an_error(tmp_path, old, new):
    assert FRAME.count(old) == 1
    (tmp_path / "d.bin").write_bytes(FRAME + FRAME.replace(old, new))
    with pytest.raises(InputError, match=r"d\.bin is damaged in frame 2"):
        list(Dump(tmp_path / "d.bin"))


def test_numbers_that_are_none_are_refused_as_such(tmp_path):
    columns = "id x vx v_displacement"
    rows = [[1, np.inf, -0.1, np.inf], [2, 1.0, np.nan, 0.0]]
    (tmp_path / "d.bin").write_bytes(binary_frame(0, columns, [rows], time=0.0))
    with pytest.raises(InputError, match="holds a value that is too large or not a number"):
        analyze_frames(Dump(tmp_path / "d.bin"))
