"""Test that LAMMPS and lammpsio read and write the data file without loss of a bit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from chaincor.lammps_inputs.chain_data import format_data, initial_state
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps.library import load_lammps

# Strains keep coordinates, in any order, inside the box of the file; they may be as small as
# 1e-300.
finite = {"allow_nan": False, "allow_infinity": False, "allow_subnormal": False}
chains = st.integers(1, 12).flatmap(
    lambda n: st.tuples(
        arrays(float, n, elements=st.floats(-25.0, 25.0, **finite)),
        arrays(float, n, elements=st.floats(-1e6, 1e6, **finite)),
    )
)


def before_the_wall(strains, velocities):
    """Return a chain whose first strain is its distance from the wall."""
    masses = np.concatenate(([np.inf], np.ones(len(strains))))
    return Line(masses, 1, strains, np.concatenate(([0.0], velocities)))


def through_lammps(folder, line):
    """Read the data file with LAMMPS, write it again with LAMMPS, and parse the new file."""
    (folder / "chain.data").write_text(format_data(line))
    instance = load_lammps().lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"])
    instance.commands_string(
        f"""
        units lj
        boundary f f f
        atom_style bond
        atom_modify sort 0 0 map array
        comm_modify cutoff 3.0
        bond_style zero
        read_data "{folder}/chain.data"
        bond_coeff 1 1.0
        write_data "{folder}/again.data" nocoeff
        """
    )
    instance.close()
    return parse(folder / "again.data")


def parse(path):
    sections, name = {}, None
    for line in path.read_text().splitlines():
        words = line.split("#")[0].split()
        if words and words[0] in ("Masses", "Atoms", "Velocities", "Bonds"):
            name = words[0]
            sections[name] = []
        elif words and name:
            sections[name].append([float(word) for word in words])
    return {name: np.array(sorted(rows)) for name, rows in sections.items()}


@settings(max_examples=25)
@given(chains)
def test_round_trip_through_lammps_keeps_every_bit(tmp_path_factory, chain):
    line = before_the_wall(*chain)
    positions, velocities = initial_state(line)
    again = through_lammps(tmp_path_factory.mktemp("data"), line)
    n = len(positions)
    assert np.array_equal(again["Atoms"][:, 0], np.arange(1, n + 1))
    assert np.array_equal(again["Atoms"][:, 3], positions)
    assert np.array_equal(again["Velocities"][:, 1], velocities)
    if n > 1:
        ids = np.arange(1, n)
        assert np.array_equal(np.sort(again["Bonds"][:, 2:]), np.array([ids, ids + 1]).T)


def test_lammpsio_reads_the_same_chain(tmp_path):
    lammpsio = pytest.importorskip("lammpsio")
    rng = np.random.default_rng(7)
    velocities = rng.normal(size=30) * 10.0 ** rng.integers(-12, 3, 30)
    line = before_the_wall(rng.uniform(0.0, 0.5, 30), velocities)
    positions, _ = initial_state(line)
    path = tmp_path / "chain.data"
    # lammpsio does not know atom_style bond, which has the columns of atom_style molecular.
    text = format_data(line).replace("Atoms # bond", "Atoms # molecular")
    path.write_text(text)
    snapshot = lammpsio.DataFile(path, atom_style="molecular").read()
    order = np.argsort(snapshot.id if snapshot.has_id() else np.arange(30))
    assert np.array_equal(snapshot.position[order, 0], positions)
    assert np.array_equal(snapshot.velocity[order, 0], velocities)
    assert np.all(snapshot.mass == 1.0)
    assert np.array_equal(snapshot.bonds.members, np.array([np.arange(1, 30), np.arange(2, 31)]).T)


def test_the_chain_starts_at_the_wall():
    positions, velocities = initial_state(Scene(particles=4, velocity=0.25).line)
    assert positions.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert velocities.tolist() == [-0.25] * 4


def test_one_particle_has_no_bonds():
    text = format_data(Scene(particles=1, velocity=0.1).line)
    assert "0 bonds" in text
    assert "\nBonds" not in text


two_bodies = st.tuples(st.integers(1, 6), st.integers(0, 6)).flatmap(
    lambda sizes: st.tuples(
        st.just(sizes[1]),
        arrays(float, sum(sizes), elements=st.sampled_from([1.0, 1.0 / 3.0, 1e-9, 7e8])),
    )
)


@settings(max_examples=15)
@given(two_bodies)
def test_masses_and_bonds_of_two_bodies_keep_every_bit(tmp_path_factory, bodies):
    targets, masses = bodies
    count = len(masses)
    n = count - targets
    along = np.concatenate((masses[n:][::-1] if targets else [np.inf], masses[:n]))
    at_rest = np.zeros(len(along))
    line = Line(along, len(along) - n, at_rest[1:], at_rest)
    again = through_lammps(tmp_path_factory.mktemp("data"), line)
    of_type = dict(again["Masses"].tolist())
    # LAMMPS writes masses with 16 digits or more.
    assert [of_type[kind] for kind in again["Atoms"][:, 2]] == pytest.approx(masses, rel=1e-15)
    assert len(of_type) == len(set(masses.tolist()))
    assert again["Atoms"][:, 1].tolist() == [1.0] * n + [2.0] * targets
    ids = np.array([*range(1, n), *range(n + 1, count)])
    if len(ids):
        assert np.array_equal(np.sort(again["Bonds"][:, 2:]), np.array([ids, ids + 1]).T)


def test_masses_are_written_to_the_last_bit():
    text = format_data(Scene(particles=2, masses=(1.0 / 3.0, 0.1), velocity=0.1).line)
    rows = text[text.index("Masses") : text.index("Atoms #")].split()[1:]
    assert sorted(map(float, rows[1::2])) == [0.1, 1.0 / 3.0]


def test_the_plain_chain_has_the_plain_file():
    plain = format_data(Scene(particles=5, velocity=0.9).line)
    assert format_data(Scene(particles=5, velocity=0.9, masses=(1.0,)).line) == plain
    assert "-450 450 xlo xhi" in plain


def test_two_bodies_touch_where_they_meet():
    scene = Scene(particles=3, target_particles=3, velocity=0.25, compression=0.125)
    positions, velocities = initial_state(scene.line)
    assert positions.tolist() == [0.0, 0.875, 1.75, 0.0, -1.0, -2.0]
    assert velocities.tolist() == [-0.25] * 3 + [0.0] * 3
