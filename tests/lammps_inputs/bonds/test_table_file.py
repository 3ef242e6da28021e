"""Users' tables: few digits are enough, and what they cannot be is said."""

import hashlib
import pickle

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.bonds.table_file import read_bond_table
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.scene import Scene


def write_table(path, digits, scale=1.0):
    # Rows that do not meet length 1, as of a table that was scaled.
    strains = np.linspace(-0.0987655, 0.2, 401)
    rows = zip(scale * (1.0 + strains), LennardJones().force(strains), strict=True)
    lines = [f"{i} {r:.{digits}f} 0 {f:.{digits}f}" for i, (r, f) in enumerate(rows, 1)]
    path.write_text("\n".join(["KEY", "N 401", "", *lines, ""]))
    return path


@pytest.mark.parametrize("digits", [5, 8, 12])
def test_the_zero_is_found_within_the_digits(tmp_path, digits):
    bond = read_bond_table(write_table(tmp_path / "few.table", digits))
    assert abs(float(bond.force(0.0))) < 1e-9
    # Length 1 moved by no more than the last digits.
    assert abs(bond.strain_max - 0.2) < 3.0 * 10.0**-digits
    # Within 1.25 times half a unit of both columns, the stiffness being 13 at most here.
    strains = np.linspace(-0.05, 0.15, 50)
    allowed = 1e-9 + 20.0 * 10.0**-digits
    assert bond.force(strains) == pytest.approx(LennardJones().force(strains), abs=allowed)


def test_a_table_scaled_wrong_is_told_where_its_zero_is(tmp_path):
    path = write_table(tmp_path / "wrong.table", 8, scale=1.05)
    with pytest.raises(TableError, match=r"with nothing at length 1\.05\d*; expected no force"):
        read_bond_table(path)


def test_scenes_of_one_table_share_its_bond(tmp_path):
    path = write_table(tmp_path / "t.table", 8)
    scene = Scene(potential="table", bond_file=path, particles=3, velocity=0.01)
    assert scene.replace(velocity=0.02).bond is scene.bond
    write_table(path, 7)
    assert scene.replace(velocity=0.02).bond is not scene.bond


def test_a_scene_of_a_table_can_be_sent_to_another_process(tmp_path):
    path = write_table(tmp_path / "t.table", 8)
    scene = Scene(potential="table", bond_file=path, particles=3, velocity=0.01)
    content = path.read_bytes()
    path.unlink()
    sent = pickle.loads(pickle.dumps(scene))
    # By its content: one object in a process, with the loops compiled for it.
    assert sent.bond is scene.bond
    assert sent.sha256 == scene.sha256
    assert sent.canonical_fields["bond_file"] == hashlib.sha256(content).hexdigest()


@pytest.mark.parametrize("word", ["1e400", "-1e400"])
def test_numbers_beyond_all_are_refused(tmp_path, word):
    path = write_table(tmp_path / "huge.table", 8)
    lines = path.read_text().splitlines()
    index, length, energy, _ = lines[20].split()
    lines[20] = f"{index} {length} {energy} {word}"
    path.write_text("\n".join(lines))
    with pytest.raises(TableError, match=r"expected at least 4 rows .* of finite numbers"):
        read_bond_table(path)
