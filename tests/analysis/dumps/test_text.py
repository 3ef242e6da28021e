import io

import numpy as np
import pytest

from chaincor.analysis.dumps.frame import TruncatedFrameError
from chaincor.analysis.dumps.text import TextFrames, order_by_id
from chaincor.lammps_inputs.errors import InputError

FRAME = b"""ITEM: UNITS
lj
ITEM: TIME
0.25
ITEM: TIMESTEP
7
ITEM: NUMBER OF ATOMS
3
ITEM: BOX BOUNDS xy xz yz ff pp pp
-1.5 9 0
-0.5 0.5 0
-0.25 0.25 0
ITEM: ATOMS id element x vx
3 Ar 2.5 -1e-300
1 Ar 0.10000000000000001 0.30000000000000004
2 Ar 1 -0
"""


def read(data):
    return TextFrames("d").read(io.BytesIO(data))


def test_a_frame_is_read_exactly_and_sorted_by_id():
    frame = read(FRAME)
    assert (frame.step, frame.time) == (7, 0.25)
    assert frame.columns == ("id", "element", "x", "vx")
    np.testing.assert_array_equal(frame.bounds, [[-1.5, 9], [-0.5, 0.5], [-0.25, 0.25]])
    np.testing.assert_array_equal(frame.column("x"), [0.1, 1.0, 2.5])
    np.testing.assert_array_equal(frame.column("vx"), [0.1 + 0.2, 0.0, -1e-300])
    with pytest.raises(InputError, match=r"column 'element' .* not a number"):
        frame.column("element")


def test_the_order_follows_ids_that_change_between_frames():
    reader = TextFrames("d")
    stream = io.BytesIO(FRAME + FRAME.replace(b"3 Ar 2.5", b"9 Ar 7.5"))
    first, second = reader.read(stream), reader.read(stream)
    assert first.column("x")[-1] == 2.5
    assert second.column("x")[-1] == 7.5
    assert reader.read(stream) is None


@pytest.mark.parametrize("cut", range(1, len(FRAME)))
def test_a_frame_cut_anywhere_is_recognised(cut):
    with pytest.raises(TruncatedFrameError):
        read(FRAME[:cut])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (b"1 Ar 0.1", b"3 Ar 0.1", "holds an id twice"),
        (b"2 Ar 1 -0", b"2.5 Ar 1 -0", "a value that is no whole number"),
        (b"2 Ar 1 -0", b"two Ar 1 -0", "column 'id' of the frame of step 7 holds text"),
        (b"2 Ar 1 -0", b"2 Ar 1", "has 11 numbers instead of 3 rows of 4"),
        (b"id element", b"ID element", "no column 'id'"),
        (b"NUMBER OF", b"FEELINGS OF", "not a LAMMPS dump of style custom"),
        (b"\n3\n", b"\nthree\n", "not a LAMMPS dump of style custom"),
        (
            b"\n3\nITEM: BOX",
            b"\n0\nITEM: BOX",
            "frame of step 7 has no atoms. Dump a group",
        ),
    ],
)
def test_damage_is_named_in_one_line(old, new, message):
    assert old in FRAME
    with pytest.raises(InputError, match=message) as raised:
        read(FRAME.replace(old, new))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("rows", "digits"),
    [
        (b"1 Ar 12.3456 -0.1\n2 Ar 0.5 -0.12345678\n3 Ar 0 1e-05\n", 8),
        (b"1 Ar 12.5 -0.1\n2 Ar 0.00125 100\n3 Ar 123456789 1e-05\n", 6),
        (b"1 Ar 0 -1\n2 Ar 1 -1\n3 Ar 2 -1\n", 6),
    ],
)
def test_digits_are_those_of_the_longest_number(rows, digits):
    assert read(FRAME[: FRAME.index(b"3 Ar")] + rows).significant_digits() == digits
    assert read(FRAME).significant_digits() == 17


def test_resolution_is_half_a_unit_of_the_last_digit():
    rows = b"1 Ar 12.3456 -0.1\n2 Ar 0.5 -0.1234\n3 Ar 0 1e-05\n"
    frame = read(FRAME[: FRAME.index(b"3 Ar")] + rows)
    # With six digits, 12.3456 has an error of 5e-5, 0.5 (trailing zeros dropped) of 5e-7, and 0 of
    # none.
    np.testing.assert_allclose(frame.resolution("x", 6), [5e-5, 5e-7, 0.0], rtol=1e-9)
    np.testing.assert_allclose(frame.resolution("vx", 8), [5e-9, 5e-9, 5e-13], rtol=1e-9)
    exact = read(FRAME).resolution("x", 17)
    np.testing.assert_array_equal(exact, [2.0**-57, 2.0**-53, 2.0**-52])


def test_ids_in_order_need_no_sorting():
    assert order_by_id(np.array([1.0, 2.0, 5.0]), 0, "d") is None
    np.testing.assert_array_equal(order_by_id(np.array([2.0, 1.0]), 0, "d"), [1, 0])
