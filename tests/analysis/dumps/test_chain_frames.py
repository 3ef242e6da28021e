import numpy as np
import pytest

from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.dump import Dump
from chaincor.lammps_inputs.errors import InputError

TIMES = np.arange(0.0, 5.0, 0.5)


def first_states(path, timestep=None):
    dump = Dump(path)
    layout = ChainLayout.from_frame(dump.first())
    return layout, list(layout.states(dump, timestep))


@pytest.mark.parametrize(
    ("columns", "error"),
    [
        ("id x vx v_displacement v_time", 0.0),
        # Positions up to 20 round displacements to 2^-49. Scaled positions, times a box length of
        # 210, round them to a few times 2^-53 * 210.
        ("id x vx", 2.0**-48),
        ("id type xu vx", 2.0**-48),
        ("id type xs vx", 210 * 2.0**-51),
    ],
)
def test_displacements_come_from_the_best_column(harmonic20, dump_writer, columns, error):
    path = dump_writer.write(harmonic20, TIMES, columns=columns)
    layout, states = first_states(path, 0.005)
    assert layout.time_known == ("v_time" in columns)
    for time, state in zip(TIMES, states, strict=True):
        u, v = harmonic20.state(time)
        assert np.max(np.abs(state.displacements - u)) <= error
        np.testing.assert_array_equal(state.velocities, v)
        assert state.time == pytest.approx(time, abs=1e-12)


def test_ids_counted_towards_the_wall_are_turned_round(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, columns="id x vx", reverse_ids=True, shuffle=True)
    layout, states = first_states(path, 0.005)
    np.testing.assert_array_equal(layout.rows[0], np.arange(19, -1, -1))
    np.testing.assert_array_equal(states[3].velocities, harmonic20.state(TIMES[3])[1])


def test_time_of_dump_modify_is_used(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, columns="id x vx", time_item=True)
    layout, states = first_states(path)
    assert layout.time_known
    assert [state.time for state in states] == list(TIMES)


@pytest.mark.parametrize(
    ("columns", "missing"),
    [("id x", "velocities"), ("id vx", "positions"), ("id y vx", "positions")],
)
def test_missing_columns_are_named(harmonic20, dump_writer, columns, missing):
    path = dump_writer.write(harmonic20, TIMES, columns=columns)
    with pytest.raises(InputError, match=f"no {missing}.*Dump at least 'id x vx'"):
        first_states(path)


def test_lost_particles_and_blown_up_runs_are_named(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES[:2])
    text = path.read_text()
    last_row = text.rstrip().rindex("\n")
    lost = text[:last_row] + "\n"
    head, tail = lost.rsplit("ITEM: NUMBER OF ATOMS\n20", 1)
    path.write_text(head + "ITEM: NUMBER OF ATOMS\n19" + tail)
    with pytest.raises(InputError, match="has 19 particles, but the first frame has 20"):
        first_states(path)
    path.write_text(text[:last_row] + "\n20 19 nan 0 0.5\n")
    with pytest.raises(InputError, match=r"not a number.*blew up"):
        first_states(path)
    path.write_text(text.replace(" 0.5\n", " nan\n"))  # the time of the second frame
    with pytest.raises(InputError, match=r"not a number.*blew up"):
        first_states(path)
