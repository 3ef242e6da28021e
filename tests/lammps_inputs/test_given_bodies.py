"""Test masses, targets, contacts and states of a scene: reading, checks, equal spellings."""

import math
import os
import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chaincor.lammps_inputs.bonds.potentials import Harmonic
from chaincor.lammps_inputs.errors import InputError, SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.given_bodies import given_bodies

FOUR = {"particles": 4}
STATE = "strain,velocity\n0,-0.1\n0.01,-0.2\n0,-0.1\n-0.02,-0.1\n"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "masses.txt").write_text("1 2\n3,4\n")
    (tmp_path / "state.csv").write_text(STATE)
    return tmp_path


@pytest.mark.parametrize(
    ("given", "wanted"),
    [
        ([1, 2], (1.0, 2.0)),
        ((1.0, 2.0), (1.0, 2.0)),
        (np.array([1.0, 2.0]), (1.0, 2.0)),
        ("1,2", (1.0, 2.0)),
        (" 1 , 2e0 ", (1.0, 2.0)),
        (3, (3.0,)),
        ("3", (3.0,)),
        ("masses.txt", (1.0, 2.0, 3.0, 4.0)),
    ],
)
def test_masses_are_read_from_lists_texts_and_files(given, wanted):
    assert Scene(masses=given, **FOUR).masses == wanted
    assert Scene(target_particles=4, target_masses=given).target_masses == wanted


BAD = [
    ({"masses": "1,,2"}, "masses is '1,,2': expected numbers with commas between them"),
    ({"masses": "absent.txt"}, "masses is 'absent.txt': expected numbers .* or a file of numbers"),
    ({"masses": ""}, "masses is ''"),
    ({"masses": "."}, "masses is '.'"),
    ({"masses": "/dev/zero"}, "masses is '/dev/zero'"),
    ({"masses": "1,2\nshell touch pwned"}, r"masses is '1,2\\nshell touch pwned'"),
    ({"masses": []}, r"masses is \[\]: .*at least 1 item"),
    ({"masses": [1, -1]}, "masses is -1: .*greater than 0"),
    ({"masses": "1,0"}, "masses is 0.0: .*greater than 0"),
    ({"masses": "nan"}, "masses is nan: .*finite"),
    ({"masses": [math.inf]}, "masses is inf"),
    ({"masses": [True, 1]}, r"masses is \[True, 1\]: expected masses"),
    ({"masses": True}, "masses is True: expected masses"),
    ({"masses": [[1], [2]]}, r"masses is \[1\]"),
    ({"masses": {"1": 2}}, "masses is {'1': 2}"),
    ({"masses": [1, 2, 3, 4, 5]}, "masses has 5 numbers. Give at most 4"),
    ({"masses": [1, 1e13]}, r"masses are 1 to 1e\+13. Give masses with a ratio of at most 1e\+12"),
    ({"masses": [1e13]} | {"target_particles": 1}, r"masses are 1 to 1e\+13"),
    ({"masses": [1e308] * 4}, r"masses are 1e\+308 to 1e\+308. Give masses from 1e-30 to 1e\+30"),
    ({"masses": [5e-324]}, "masses are 4.94066e-324"),
    ({"target_masses": [1]}, "target_masses has no effect without target_particles"),
    ({"target_particles": 0}, "target_particles is 0"),
    ({"target_particles": True}, "target_particles is True: expected a whole number"),
    (
        {"target_particles": 1, "target_masses": [1, 2]},
        "target_masses has 2 numbers. Give at most 1",
    ),
    ({"contact": "soft"}, "contact is 'soft'"),
    ({"contact_stiffness": 2.0}, "contact_stiffness goes with contact 'power'"),
    ({"contact": "hard", "contact_exponent": 2.0}, "contact_exponent goes with contact 'power'"),
    ({"contact": "power", "contact_exponent": 0.5}, "contact_exponent is 0.5"),
    ({"contact": "power", "contact_stiffness": 0.0}, "contact_stiffness is 0.0"),
    ({"contact": "power", "wall": "reflect"}, "wall 'reflect' is a rigid, hard wall"),
    ({"target_particles": 1, "wall": "reflect"}, "wall 'reflect' is a rigid, hard wall"),
    ({"compression": 1.0}, "compression is 1.0"),
    ({"compression": math.nan}, "compression is nan"),
    (
        {"compression": -0.9, "potential": "power", "power_order": 3, "power_c": -1.0},
        "compression is -0.9: a power bond of length 1.9 is not defined or does not hold",
    ),
    ({"initial": "absent.csv"}, "cannot read initial 'absent.csv'"),
    ({"initial": "state.csv", "particles": 5}, "initial has 4 particles, but the chain has 5"),
    ({"initial": "state.csv", "speed": 0.4}, "speed and the velocities in initial are both given"),
    ({"initial": "state.csv", "compression": 0.1}, "initial and compression are both given"),
    (
        {"potential": "hertz", "engine": "reference", "compression": 0.4, "velocity": 0.1},
        "beads fly apart with more energy",
    ),
]


@pytest.mark.parametrize(("fields", "line"), BAD, ids=[str(fields)[:60] for fields, _ in BAD])
def test_bad_input_is_one_clear_line(fields, line):
    with pytest.raises(InputError, match=line) as caught:
        Scene(**(FOUR | fields))
    assert "\n" not in str(caught.value)
    assert caught.value.exit_status == 2


def test_a_state_that_flies_away_or_has_masses_twice_is_refused(folder):
    (folder / "away.csv").write_text("strain,velocity\n0,0.3\n0,-0.1\n")
    with pytest.raises(InputError, match=r"moves with velocity 0.1. Give"):
        Scene(particles=2, initial="away.csv")
    (folder / "heavy.csv").write_text("strain,mass\n0,1\n0,1e13\n")
    with pytest.raises(InputError, match="Give masses with a ratio of at most"):
        Scene(particles=2, initial="heavy.csv")
    (folder / "huge.csv").write_text("strain,velocity\n0,-0.1\n0,-0.1\n")
    for other in ({"initial": "huge.csv"}, {"temperature": 1e-5}):
        with pytest.raises(InputError, match="Give masses from 1e-30"):
            Scene(particles=2, masses=[1e308], **other)
    with pytest.raises(InputError, match="masses are given twice, in initial and in masses"):
        Scene(particles=2, initial="heavy.csv", masses=[1])
    (folder / "long.csv").write_text("strain\n0\n0.9\n")
    with pytest.raises(InputError, match=r"a bond of length 1.9 between"):
        Scene(particles=2, initial="long.csv", potential="power", power_order=3, power_c=-1.0)


def test_a_pipe_is_no_file_of_masses(folder):
    os.mkfifo(folder / "pipe")  # reading it would wait for ever
    with pytest.raises(InputError, match="masses is 'pipe'"):
        Scene(masses="pipe")


def test_one_scene_has_one_hash_however_it_is_written():
    def sha256(**fields):
        return Scene(**(FOUR | fields)).sha256

    plain = sha256()
    assert sha256(masses=[1, 1]) == sha256(masses=1) == plain
    assert sha256(contact="hard") == sha256(compression=0.0) == plain
    assert Scene(masses=[1, 1], **FOUR).line.is_standard
    twice = sha256(masses=[1, 2])
    assert twice == sha256(masses=[1, 2, 1, 2]) == sha256(masses="1,2") != plain
    # Masses of 2 give a different scene, because the bonds vibrate more slowly.
    assert sha256(masses=[2]) != plain
    assert sha256(masses=[2, 1]) != twice
    target = sha256(target_particles=3)
    assert target == sha256(target_particles=3, target_masses=[1, 1, 1], masses=[1]) != plain
    assert target != sha256(target_particles=3, target_masses=[1, 1, 2])
    soft = sha256(contact="power")
    assert soft == sha256(contact="power", contact_stiffness=1.0, contact_exponent=1.5) != plain
    assert soft != sha256(contact="power", contact_exponent=2.0)
    # The hash of the paper's scenes must not change, because stores use it as a key.
    assert Scene().sha256 == "95cc2342a4d3177b74bf6e36ee8dfab66bd865b5b6852dba67ea647de2912375"


def test_a_state_is_known_by_what_it_says(folder):
    first = Scene(initial="state.csv", **FOUR)
    (folder / "again.csv").write_text(STATE.replace("\n", "\r\n").replace("-0.1", "-1e-1"))
    assert Scene(initial="again.csv", **FOUR).sha256 == first.sha256
    (folder / "other.csv").write_text(STATE.replace("0.01", "0.02"))
    assert Scene(initial="other.csv", **FOUR).sha256 != first.sha256
    # The scene keeps the values that it has read, whatever happens to the file later.
    kept = Scene(initial="other.csv", **FOUR)
    (folder / "other.csv").unlink()
    assert kept.sha256 != first.sha256


def test_long_lists_are_known_by_their_hash():
    masses = [1.0] * 99 + [3.0]
    scene, other = Scene(masses=masses), Scene(masses=[*masses[1:], 1.0])
    assert scene.sha256 == Scene(masses=tuple(masses)).sha256 != other.sha256
    assert isinstance(scene.canonical_fields["masses"], str)


def test_toml_reads_back(folder):
    scene = Scene(
        masses="1,2",
        target_particles=3,
        target_masses=[1, 2, 0.1],
        contact="power",
        contact_stiffness=7.0,
        compression=0.02,
        **FOUR,
    )
    assert tomllib.loads(scene.to_toml())["target_masses"] == [1.0, 2.0, 0.1]
    assert Scene.from_toml(scene.to_toml()) == scene
    moving = Scene(initial="state.csv", **FOUR)
    assert Scene.from_toml(moving.to_toml()).sha256 == moving.sha256


def test_files_are_looked_for_beside_the_scene_file(folder):
    deep = folder / "deep"
    deep.mkdir()
    (deep / "scene.toml").write_text('particles = 4\ninitial = "s.csv"\ntarget_particles = 2\n')
    (deep / "s.csv").write_text(STATE)
    (deep / "mine.txt").write_text("1 3")
    assert Scene.from_file(deep / "scene.toml").initial_state.strains[0] == 0.01
    (deep / "two.toml").write_text('particles = 4\nmasses = "mine.txt"\n')
    assert Scene.from_file("deep/two.toml").masses == (1.0, 3.0)
    # A list of numbers is not taken for a file name.
    (deep / "three.toml").write_text('particles = 4\nmasses = "1,2"\n')
    assert Scene.from_file("deep/three.toml").masses == (1.0, 2.0)


def test_a_scene_becomes_one_line():
    scene = Scene(
        potential="harmonic", velocity=0.1, masses=[1, 2], particles=3, target_particles=2,
        target_masses=[5, 6], compression=0.25,
    )  # fmt: skip
    line = scene.line
    assert line.masses.tolist() == [6.0, 5.0, 1.0, 2.0, 1.0]
    assert (line.first, line.targets, line.gap) == (2, 2, 1)
    assert line.strains.tolist() == [0.0, 0.0, -0.25, -0.25]
    assert line.velocities.tolist() == [0.0, 0.0, -0.1, -0.1, -0.1]
    assert given_bodies(scene).keys() == {
        "masses", "target_particles", "target_masses", "compression",
    }  # fmt: skip
    # These are omega^2 of the fastest bond and of waves in the slower body.
    assert scene.problem.fast_stiffness == Harmonic().stiffness / 1.0
    assert scene.problem.slow_stiffness == pytest.approx(1.0 / 5.5, rel=1e-15)


def test_a_state_brings_velocities_and_masses(folder):
    moving = Scene(initial="state.csv", masses=[1, 1, 1, 3], **FOUR)
    # The momentum of 0.1 + 0.2 + 0.1 + 0.3 is divided by a mass of 6.
    assert moving.impact_velocity == pytest.approx(0.7 / 6.0, rel=1e-15)
    (folder / "heavy.csv").write_text("position,mass\n0.5,2\n1.5,1\n")
    heavy = Scene(particles=2, initial="heavy.csv", velocity=0.2)
    assert heavy.line.chain_masses.tolist() == [2.0, 1.0]
    assert heavy.line.velocities.tolist() == [0.0, -0.2, -0.2]
    assert heavy.line.strains.tolist() == [0.5, 0.0]


@settings(max_examples=100)
@given(st.lists(st.sampled_from([0.5, 1.0, 2.0]), min_size=1, max_size=6), st.integers(1, 12))
def test_a_list_and_what_it_repeats_are_one_scene(masses, particles):
    masses = masses[:particles]
    spelled = [masses[i % len(masses)] for i in range(particles)]
    short = Scene(masses=masses, particles=particles)
    long = Scene(masses=spelled, particles=particles)
    assert short.sha256 == long.sha256
    assert (short.line.is_standard) == (set(spelled) == {1.0})


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("mases.txt", "masses is 'mases.txt': expected numbers .* cannot be read: No such file"),
        ("/dev/zero", "cannot be read: it is no plain file"),
        ("1,x,3", "masses is '1,x,3': expected numbers with commas"),
        ("words.txt", "masses is 'words.txt': the file holds 'two'. Give numbers"),
        ("empty.txt", "masses is 'empty.txt': the file is empty. Give numbers"),
    ],
)
def test_masses_of_a_file_say_what_is_wrong_with_it(given, words, folder):
    (folder / "words.txt").write_text("1, two 3\n")
    (folder / "empty.txt").write_text(" \n")
    with pytest.raises(SceneError, match=words):
        Scene(masses=given, **FOUR)


def test_masses_without_an_order_are_refused():
    with pytest.raises(SceneError, match=r"masses is .*: a set has no order. Give a list"):
        Scene(masses={2.0, 1.0}, **FOUR)


def test_a_file_of_masses_that_a_scene_file_names_is_named_as_text(folder):
    (folder / "scene.toml").write_text('particles = 4\nmasses = "absent.txt"\n')
    with pytest.raises(SceneError, match=r"masses is '[^']*absent\.txt': expected"):
        Scene.from_file(folder / "scene.toml")
