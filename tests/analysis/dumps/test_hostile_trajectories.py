"""Test that damaged and hostile trajectories for ASE are refused in one line and run no code."""

import os
import pickle
import struct

import numpy as np
import pytest

pytest.importorskip("ase")

from chaincor.analysis.dumps.other_trajectories import open_trajectory
from chaincor.lammps_inputs.errors import InputError


class Command:
    """Object that makes a folder when it is unpickled."""

    def __init__(self, folder):
        self.folder = folder

    def __reduce__(self):
        return os.mkdir, (self.folder,)


def refusal(path, content):
    """Return the message with which a trajectory is refused."""
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        list(open_trajectory(path).frames())
    return str(error.value)


def trajectory(path, frames=3):
    """Return the bytes of a trajectory of ASE."""
    from ase import Atoms
    from ase.io import write

    positions = np.arange(9.0).reshape(3, 3)
    write(path, [Atoms("Ar3", positions, momenta=positions + k) for k in range(frames)])
    return path.read_bytes()


@pytest.mark.parametrize("suffix", ["traj", "extxyz"])
def test_no_pickle_is_loaded(tmp_path, suffix):
    made = tmp_path / "made"
    content = b"PickleTrajectory" + pickle.dumps(Command(str(made)))
    assert refusal(tmp_path / f"old.{suffix}", content).startswith("cannot read the trajectory")
    assert refusal(tmp_path / f"bare.{suffix}", pickle.dumps(Command(str(made))))
    assert not made.exists()


def test_a_trajectory_whose_header_promises_too_much_is_refused(tmp_path):
    whole = trajectory(tmp_path / "whole.traj")
    # The number of frames and the place of their offsets follow the tag and the version.
    many = whole[:32] + struct.pack("<q", 2**50) + whole[40:]
    assert "cannot read the trajectory" in refusal(tmp_path / "many.traj", many)
    large = whole.replace(b'"ndarray": [[3, 3]', b'"ndarray": [[9, 9]'.replace(b"9, 9", b"3,9E9"))
    if large != whole:
        assert "cannot read the trajectory" in refusal(tmp_path / "large.traj", large)


def test_columns_of_any_width_are_refused(tmp_path):
    head = b'2\nProperties=species:S:1:pos:R:3:vel:R:%d pbc="F F F"\nAr 0 0 0 1\nAr 1 0 0 1\n'
    assert "cannot read" in refusal(tmp_path / "wide.extxyz", head % 10**12)
    many = b'%d\nProperties=species:S:1:pos:R:3:vel:R:3 pbc="F F F"\nAr 0 0 0 1 0 0\n'
    assert "cannot read" in refusal(tmp_path / "many.extxyz", many % 10**12)


@pytest.mark.parametrize("seed", range(20))
def test_a_damaged_trajectory_is_read_or_refused(tmp_path, seed):
    random = np.random.default_rng(seed)
    content = bytearray(trajectory(tmp_path / "whole.traj"))
    for place in random.integers(0, len(content), 4):
        content[place] = int(random.integers(256))
    path = tmp_path / "damaged.traj"
    path.write_bytes(bytes(content[: random.integers(1, len(content))] if seed % 2 else content))
    said, frames = "", []
    try:
        frames = list(open_trajectory(path).frames())
    except InputError as error:
        said = str(error)
    assert len(frames) <= 3
    assert bool(frames) != bool(said)
    assert "\n" not in said
