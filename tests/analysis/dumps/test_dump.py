import gzip
import tracemalloc

import numpy as np
import pytest

from chaincor.analysis.dumps.dump import Dump
from chaincor.lammps_inputs.errors import InputError

TIMES = np.arange(0.0, 5.0, 0.5)


def displacements(dump):
    return np.array([frame.column("v_displacement") for frame in dump])


@pytest.mark.parametrize("name", ["d.lammpstrj", "d.dump.gz"])
@pytest.mark.parametrize("shuffle", [False, True])
def test_dumps_are_read_bit_for_bit(harmonic20, dump_writer, name, shuffle):
    dump = Dump(dump_writer.write(harmonic20, TIMES, name=name, shuffle=shuffle))
    exact = np.array([harmonic20.state(time)[0] for time in TIMES])
    np.testing.assert_array_equal(displacements(dump), exact)
    np.testing.assert_array_equal(displacements(dump), exact)  # a second pass
    assert not dump.truncated


@pytest.mark.parametrize("name", ["d.lammpstrj", "d.lammpstrj.gz"])
def test_a_cut_last_frame_is_left_out(harmonic20, dump_writer, name):
    dump = Dump(dump_writer.write(harmonic20, TIMES, name=name, cut=37))
    assert len(list(dump)) == len(TIMES) - 1
    assert dump.truncated


def test_a_cut_gzip_stream_gives_what_it_holds(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, name="d.gz")
    path.write_bytes(path.read_bytes()[:-2000])
    dump = Dump(path)
    frames = list(dump)
    assert 0 < len(frames) < len(TIMES)
    assert dump.truncated
    np.testing.assert_array_equal(frames[-1].column("vx").size, 20)


def test_a_damaged_gzip_stream_is_named(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, name="d.gz")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(bytes(data))
    with pytest.raises(InputError):
        list(Dump(path))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"hello\n", "is not a LAMMPS dump"),
        (b"ITEM: TIMESTEP\n0\nITEM: NUM", "cut short before the end of its first frame"),
        (b"ITEM: TIMESTEP\n0\nnonsense\n", "not a LAMMPS dump of style custom"),
        (gzip.compress(b"", mtime=0), "is empty"),
        (gzip.compress(b"ITEM: TIMESTEP\n", mtime=0)[:12], "cut short before its first frame"),
    ],
)
def test_what_is_no_dump_is_one_clear_error(tmp_path, content, message):
    path = tmp_path / "d"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message):
        list(Dump(path))


def test_a_missing_file_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match=r"cannot read the dump .*No such file"):
        Dump(tmp_path / "none")


def test_a_run_continued_into_a_cut_frame_is_damage(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES[:4], cut=300)
    more = dump_writer.write(harmonic20, TIMES[4:], name="more")
    path.write_bytes(path.read_bytes() + more.read_bytes())
    with pytest.raises(InputError, match=r"damaged there|not a LAMMPS dump|not a number"):
        displacements(Dump(path))


def test_memory_does_not_grow_with_the_file(harmonic20, dump_writer):
    # Repeating the motion is as good as a long one for the reader.
    path = dump_writer.write(harmonic20, TIMES[:4])
    path.write_bytes(path.read_bytes() * 500)
    size = path.stat().st_size
    tracemalloc.start()
    for frame in Dump(path):
        frame.column("vx")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # A frame and what the collector has not got round to, of a file of 2000 frames.
    assert peak < 0.1 * size


def test_progress_reaches_the_size_of_the_file(harmonic20, dump_writer):
    for name in ("d.lammpstrj", "d.gz"):
        path = dump_writer.write(harmonic20, TIMES, name=name)
        seen = []
        list(Dump(path).frames(seen.append))
        assert seen == sorted(seen)
        assert seen[-1] == path.stat().st_size
