import errno

import pytest

from chaincor.analysis.atomic_write import folder_aside, made_folder, written_aside
from chaincor.lammps_inputs.errors import InputError


def test_files_appear_together_and_others_stay(tmp_path):
    target = tmp_path / "out"
    target.mkdir()
    (target / "old").write_text("kept")
    (target / "a").write_text("replaced")
    with folder_aside(target) as aside:
        (aside / "a").write_text("new")
        assert (target / "a").read_text() == "replaced"
    assert sorted(path.name for path in target.iterdir()) == ["a", "old"]
    assert (target / "a").read_text() == "new"


def test_a_failure_leaves_what_was_there(tmp_path):
    path = tmp_path / "a"
    path.write_text("old")
    with pytest.raises(RuntimeError), written_aside(path) as aside:  # noqa: PT012
        aside.write_text("half")
        raise RuntimeError
    assert [p.name for p in tmp_path.iterdir()] == ["a"]
    assert path.read_text() == "old"


def test_a_place_that_cannot_be_written_is_an_input_error(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="cannot write into"), folder_aside(tmp_path / "file"):
        pass


@pytest.mark.parametrize("whole", [True, False])
def test_new_folders_go_if_the_work_in_them_fails(tmp_path, whole):
    (tmp_path / "old").mkdir()
    with pytest.raises(RuntimeError), made_folder(tmp_path / "old" / "a" / "b", whole):  # noqa: PT012
        if whole:
            (tmp_path / "old" / "a" / "b" / "half").touch()
        raise RuntimeError
    assert [path.name for path in tmp_path.rglob("*")] == ["old"]
    # Complete files are kept if they are useful without the rest.
    with pytest.raises(RuntimeError), made_folder(tmp_path / "old" / "a"):  # noqa: PT012
        (tmp_path / "old" / "a" / "data").touch()
        raise RuntimeError
    assert (tmp_path / "old" / "a" / "data").exists()


@pytest.mark.parametrize("source", [None, "/tmp/chaincor-1/dump.lammpstrj"])
def test_a_full_disk_is_reported_with_the_requested_file(tmp_path, source):
    """Name the requested file, even if the system's error names no file or a temporary one."""
    with pytest.raises(OSError, match="No space left") as caught, written_aside(tmp_path / "a"):
        raise OSError(errno.ENOSPC, "No space left on device", source)
    assert caught.value.filename == str(tmp_path / "a")
    with pytest.raises(OSError, match="No space left") as caught, folder_aside(tmp_path / "job"):
        raise OSError(errno.ENOSPC, "No space left on device", source)
    assert caught.value.filename == str(tmp_path / "job")
