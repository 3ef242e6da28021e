"""Test that the state of a chain is read exactly from CSV, or refused in one line."""

import os

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.initial_state import read_initial_state


@pytest.fixture
def state_file(tmp_path):
    path = tmp_path / "state.csv"

    def write(text):
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def test_positions_become_a_gap_and_strains(state_file):
    state = read_initial_state(state_file("position,velocity\n0.5,-0.1\n1.25,0\n2.5,-0.25\n"))
    assert state.gap == 0.5
    assert state.strains.tolist() == [-0.25, 0.25]
    assert state.velocities.tolist() == [-0.1, 0.0, -0.25]
    assert state.masses is None


def test_strains_keep_every_digit(state_file):
    # A strain of 1e-17 would be lost in a difference of positions.
    state = read_initial_state(state_file("strain,mass\n0,2\n1e-17,1\n-1e-17,3\n"))
    assert state.strains.tolist() == [1e-17, -1e-17]
    assert state.masses.tolist() == [2.0, 1.0, 3.0]
    assert state.velocities is None


@pytest.mark.parametrize(
    "text",
    [
        "\ufeffstrain,velocity\n0,-1\n0.5,-2\n",
        "velocity,strain\n-1,0\n-2,0.5\n",
        " strain , velocity \r\n 0 , -1 \r\n\r\n 0.5 , -2 \r\n",
        '"strain","velocity"\n"0","-1"\n"0.5","-2"',
    ],
)
def test_what_spreadsheets_make_of_it_is_the_same(state_file, text):
    state = read_initial_state(state_file(text))
    assert (state.gap, state.strains.tolist()) == (0.0, [0.5])
    assert state.velocities.tolist() == [-1.0, -2.0]


BAD = [
    # contents, what the line must say
    ("", "has the columns ''. Write a header with position or strain"),
    ("velocity\n-1\n", "has the columns 'velocity'"),
    ("position,strain\n1,0\n", "has the columns 'position, strain'"),
    ("position,position\n1,0\n", "has the columns 'position, position'"),
    ("position,colour\n1,0\n", "has the columns 'position, colour'"),
    ("position;velocity\n0;-1\n", "has the columns 'position;velocity'"),
    ("0,-1\n1,-1\n", "has the columns '0, -1'"),
    ('"posi\nshell touch pwned"\n0\n', "has the columns"),
    ("position\n", "has no particles"),
    ("position,velocity\n0,-1\n1\n", "has '1' for particle 2. Give 2 numbers"),
    ("position\n0\nnan\n", "has 'nan' for particle 2"),
    ("position\n0\n1e400\n", "has '1e400' for particle 2"),
    ("position\n0\n1e200\n", "has '1e200' for particle 2. Give 1 numbers of at most 1e\\+100"),
    ("position\n0\none\n", "has 'one' for particle 2"),
    ("position\n-0.1\n1\n", "has particle 1 at -0.1, inside the target"),
    ("position\n0\n0\n", "has no room between particles 1 and 2"),
    ("position\n0\n1\n0.5\n", "has no room between particles 2 and 3"),
    ("strain\n0\n-1\n", "has no room between particles 1 and 2"),
    ("position,mass\n0,1\n1,0\n", "has a mass of 0"),
    (b"\xff\xfe\x00position\n", "cannot read initial"),
    (b"position\n0\n\x00\n", "state.csv'"),
    ('"' + "x" * 200_000, "cannot read initial"),
]


@pytest.mark.parametrize(("text", "line"), BAD, ids=[str(text)[:20] for text, _ in BAD])
def test_a_broken_file_is_one_clear_line(state_file, text, line):
    with pytest.raises(SceneError, match=line) as caught:
        read_initial_state(state_file(text))
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


def test_what_is_no_file_is_refused_before_it_is_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")  # would wait for ever
    for path, why in ((tmp_path / "pipe", "no plain file"), (tmp_path, "a folder")):
        with pytest.raises(SceneError, match=f"cannot read initial .*: it is {why}"):
            read_initial_state(path)
    with pytest.raises(SceneError, match="No such file"):
        read_initial_state(tmp_path / "nowhere.csv")


cells = st.one_of(
    st.floats(width=32).map(str), st.text(max_size=4), st.sampled_from(["", "position", "strain"])
)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(st.lists(cells, max_size=3), max_size=4),
    st.sampled_from(["position", "strain,velocity", "position,velocity,mass", ""]),
)
@pytest.mark.slow
def test_no_file_escapes(state_file, rows, header):
    text = header + "\n" + "\n".join(",".join(row) for row in rows)
    line = ""
    try:
        state = read_initial_state(state_file(text.encode("utf-8", "replace")))
    except SceneError as error:
        line = str(error)
    else:
        assert state.gap >= 0.0
        assert np.all(state.strains > -1.0)
    assert len(line.splitlines()) < 2
