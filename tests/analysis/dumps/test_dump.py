import gzip
import tracemalloc

import numpy as np
import pytest

from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.dumps.other_trajectories import open_trajectory
from chaincor.analysis.job_folder import find_job
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
    with pytest.raises(InputError, match=r"is damaged: |not a LAMMPS dump|not a number"):
        displacements(Dump(path))


def test_memory_does_not_grow_with_the_file(harmonic20, dump_writer):
    # For the reader, a repeated motion serves as well as a long motion.
    path = dump_writer.write(harmonic20, TIMES[:4])
    path.write_bytes(path.read_bytes() * 500)
    size = path.stat().st_size
    tracemalloc.start()
    for frame in Dump(path):
        frame.column("vx")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # For a file of 2000 frames, the memory used is that of one frame and of frames not yet freed.
    assert peak < 0.1 * size


def test_progress_reaches_the_size_of_the_file(harmonic20, dump_writer):
    for name in ("d.lammpstrj", "d.gz"):
        path = dump_writer.write(harmonic20, TIMES, name=name)
        seen = []
        list(Dump(path).frames(seen.append))
        assert seen == sorted(seen)
        assert seen[-1] == path.stat().st_size


def as_yaml(path, target):
    """Write the frames of a text dump as LAMMPS writes them in style yaml."""
    frames = []
    for frame in Dump(path):
        rows = zip(*(frame.raw_text(k) for k in range(len(frame.columns))), strict=True)
        low, high = frame.bounds[:, 0].tolist(), frame.bounds[:, 1].tolist()
        box = "".join(f"  - [ {a}, {b} ]\n" for a, b in zip(low, high, strict=True))
        data = "".join(f"  - [ {' , '.join(w.decode() for w in row)} , ]\n" for row in rows)
        frames.append(
            f"---\ncreator: LAMMPS\ntimestep: {frame.step}\nunits: lj\n"
            f"natoms: {frame.raw_column(0).size}\nboundary: [ f, f, f, f, f, f, ]\nbox:\n{box}"
            f"keywords: [ {', '.join(frame.columns)},  ]\ndata:\n{data}...\n"
        )
    target.write_text("".join(frames))
    return target


def test_yaml_dumps_are_read_bit_for_bit(harmonic20, dump_writer, tmp_path):
    text = dump_writer.write(harmonic20, TIMES, shuffle=True)
    dump = Dump(as_yaml(text, tmp_path / "d.yaml"))
    np.testing.assert_array_equal(displacements(dump), displacements(Dump(text)))
    assert [frame.step for frame in dump] == [frame.step for frame in Dump(text)]
    content = dump.path.read_bytes()
    dump.path.write_bytes(content[:-40])
    assert len(list(dump)) == len(TIMES) - 1
    assert dump.truncated
    dump.path.write_bytes(content.replace(b"natoms: 20", b"natoms: x", 1))
    with pytest.raises(InputError, match="is not a LAMMPS dump of style yaml"):
        list(dump)


def test_a_file_a_frame_is_one_dump(harmonic20, dump_writer, tmp_path):
    text = dump_writer.write(harmonic20, TIMES)
    frames = text.read_text().split("ITEM: TIMESTEP\n")[1:]
    folder = tmp_path / "many"
    folder.mkdir()
    for frame in frames:
        (folder / f"run2.{int(frame.split()[0])}.dump").write_text(f"ITEM: TIMESTEP\n{frame}")
    assert find_job(folder).dump == folder / "run2.*.dump"
    dump = open_trajectory(folder / "run2.*.dump")
    np.testing.assert_array_equal(displacements(dump), displacements(Dump(text)))
    last = max(folder.iterdir(), key=lambda path: int(path.name.split(".")[1]))
    last.write_bytes(last.read_bytes()[:60])
    assert len(list(dump)) == len(TIMES) - 1
    assert dump.truncated
    # Frames of other runs are not taken for frames of this run.
    for k, path in enumerate(sorted(folder.iterdir())):
        path.rename(folder / f"other{k}.dump")
    with pytest.raises(InputError, match="several dump files"):
        find_job(folder)
    with pytest.raises(InputError, match="there is no file"):
        open_trajectory(folder / "run2.*.dump")


@pytest.mark.parametrize("column", ["id", "type"])
@pytest.mark.parametrize("value", ["inf", "nan", "1.5", "1e300"])
def test_ids_and_types_that_are_no_whole_numbers_are_named(tmp_path, column, value):
    row = {"id": "1", "type": "1"} | {column: value}
    path = tmp_path / "d.dump"
    path.write_text(
        "ITEM: TIMESTEP\n7\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS ff ff ff\n"
        f"0 1\n0 1\n0 1\nITEM: ATOMS id type x vx\n{row['id']} {row['type']} 0 -1\n"
    )
    if column == "id" and value in ("1.5", "1e300"):
        return  # numbers in increasing order
    with pytest.raises(InputError, match=f"column '{column}' of the frame of step 7 has"):
        Dump(path).first().whole_numbers("type")
