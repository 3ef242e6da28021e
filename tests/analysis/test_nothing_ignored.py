"""Test that every fact in a dump or an option is used or refused."""

import numpy as np
import pytest

from chaincor.analysis.collision_frames import Known
from chaincor.analysis.dumps.chain_frames import ChainLayout
from chaincor.analysis.dumps.dump import Dump
from chaincor.analysis.frame_analysis import analyze_frames
from chaincor.analysis.job_analysis import analyze_job
from chaincor.analysis.job_folder import find_job
from chaincor.lammps_inputs.bonds.potentials import Harmonic
from chaincor.lammps_inputs.errors import InputError
from tests.analysis.conftest import collide_harmonic

TIMES = np.arange(0.0, 90.0, 1.0)
ETA20 = 0.86850360724  # reference_values.json


def states(path):
    dump = Dump(path)
    return list(ChainLayout.from_frame(dump.first()).states(dump, 0.005))


def test_scaled_positions_follow_the_bounds_of_their_own_frame(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, columns="id xs vx v_time", moving_box=True)
    for state, time in zip(states(path), TIMES, strict=True):
        # In boxes of length 210 to 390, x is exact to some eps times 390.
        np.testing.assert_allclose(state.displacements, harmonic20.state(time)[0], atol=1e-12)


@pytest.mark.parametrize(
    "columns", ["id x ix vx v_time", "id xs ix vx v_time", "id x xu vx v_time"]
)
def test_wrapped_positions_are_unwrapped(harmonic20, dump_writer, columns):
    """Use a box of length 21, which the rebounding chain leaves through a periodic boundary."""
    path = dump_writer.write(harmonic20, TIMES, columns=columns, wrap=21.0, box="pp pp pp")
    for state, time in zip(states(path), TIMES, strict=True):
        np.testing.assert_allclose(state.displacements, harmonic20.state(time)[0], atol=1e-12)
    assert analyze_frames(Dump(path), Known(bond=Harmonic())).contacts == 17


def test_positions_wrapped_without_images_are_refused(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, "x", "id x vx v_time", wrap=21.0, box="pp pp pp")
    with pytest.raises(InputError, match=r"wraps round the periodic box.*'xu'"):
        analyze_frames(Dump(path))


def test_scaled_positions_in_a_tilted_box_are_refused(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, columns="id xs vx v_time", box="xy xz yz ff pp pp")
    text = path.read_text().replace("-0.5 0.5\n", "-0.5 0.5 0.0\n").replace("200.0\n", "200.0 0\n")
    path.write_text(text)
    with pytest.raises(InputError, match="tilted box"):
        analyze_frames(Dump(path))


def test_displacements_of_another_origin_are_refused(harmonic20, dump_writer):
    """Use displacements from initial positions, which `compute displace/atom` gives."""
    path = dump_writer.write(harmonic20, TIMES, columns="id x vx v_displacement v_time")
    lines = path.read_text().splitlines()
    rows = [line.split() for line in lines]
    shifted = [
        " ".join([*row[:3], repr(float(row[3]) - 0.5), row[4]]) if len(row) == 5 else line
        for line, row in zip(lines, rows, strict=True)
    ]
    path.write_text("\n".join(shifted) + "\n")
    with pytest.raises(
        InputError, match=r"v_displacement = -0.5 at x = 0. Dump the variable x - \(id - 1\)"
    ):
        analyze_frames(Dump(path))


def test_ids_from_the_far_end_with_displacements_are_refused(harmonic20, dump_writer):
    path = dump_writer.write(
        harmonic20, TIMES, columns="id x vx v_displacement v_time", reverse_ids=True
    )
    with pytest.raises(InputError, match="ids that count from the wall"):
        analyze_frames(Dump(path))


def test_other_units_are_refused(harmonic20, dump_writer):
    path = dump_writer.write(harmonic20, TIMES, units="real")
    with pytest.raises(InputError, match=r"units real\. Use units lj"):
        analyze_frames(Dump(path))
    path = dump_writer.write(harmonic20, TIMES, units="lj")
    assert analyze_frames(Dump(path)).restitution == pytest.approx(ETA20, abs=1e-11)
    (path.parent / "in.mine").write_text("units metal\natom_style bond\nrun 1\n")
    with pytest.raises(InputError, match="sets units metal"):
        analyze_job(find_job(path.parent))
    # A log has the command with the value of its variable; a script has the name of the variable.
    (path.parent / "in.mine").write_text("units ${u}\natom_style bond\nrun 1\n")
    assert analyze_job(find_job(path.parent)).restitution == pytest.approx(ETA20, abs=1e-11)
    (path.parent / "log.lammps").write_text("LAMMPS (22 Jul 2025)\nunits ${u}\nunits real\n")
    with pytest.raises(InputError, match=r"log\.lammps sets units real, but units lj are given"):
        analyze_job(find_job(path.parent))


def test_motion_sideways_is_refused(harmonic20, dump_writer):
    columns = "id x vx vy vz v_time"
    still = dump_writer.write(harmonic20, TIMES, columns=columns)
    assert analyze_frames(Dump(still)).contacts == 17
    path = dump_writer.write(harmonic20, TIMES, columns=columns, sideways=1e-3)
    with pytest.raises(InputError, match=r"move sideways.*vy is up to 0.001"):
        analyze_frames(Dump(path))


def test_a_timestep_for_a_dump_that_carries_the_time_is_refused(harmonic20, dump_writer):
    with pytest.raises(InputError, match=r"contains the time.*Drop the timestep"):
        analyze_frames(Dump(dump_writer.write(harmonic20, TIMES)), Known(timestep=0.1))


def test_digits_are_those_of_velocities_a_decade_above_the_impact(dump_writer):
    """Print six digits: the last digit of 0.0999 is ten times finer than that of 0.11."""
    collision = collide_harmonic(20, 0.0999)
    path = dump_writer.write(collision, np.arange(-3.0, 120.0, 0.25), "x", "id x vx", "%g")
    for bond in (None, Harmonic()):
        assert analyze_frames(Dump(path), Known(bond=bond, timestep=0.005)).contacts == 17


@pytest.mark.parametrize("bonds", [18, 20])
def test_what_is_not_one_open_chain_is_refused(harmonic20, dump_writer, bonds):
    path = dump_writer.write(harmonic20, TIMES)
    (path.parent / "my.data").write_text(
        f"two chains, or a ring\n\n20 atoms\n{bonds} bonds\n1 atom types\n\nMasses\n\n1 1\n\n"
    )
    with pytest.raises(InputError, match=f"{bonds} bonds between 20 particles"):
        analyze_job(find_job(path.parent))


def test_restitution_above_one_is_a_contradiction(bounce):
    analysis = analyze_frames(Dump(bounce(0.11)), Known(timestep=1.0))
    assert analysis.restitution == pytest.approx(1.21)
    assert "restitution is above 1 by 2.1e-01" in analysis.contradictions[0]
    assert analysis.contradictions[0] in analysis.caveats


def test_momentum_that_rises_far_from_the_wall_is_a_contradiction(harmonic20, dump_writer):
    """Analyse a collision that happens half a chain away from the stated wall position."""
    path = dump_writer.write(harmonic20, np.arange(-3.0, 90.0, 0.25), columns="id x vx v_time")
    lines = [line.split() for line in path.read_text().splitlines()]
    moved = [
        " ".join([row[0], repr(float(row[1]) + 10.0), *row[2:]])
        if len(row) == 4 and row[0] != "ITEM:"
        else " ".join(row)
        for row in lines
    ]
    path.write_text("\n".join(moved) + "\n")
    analysis = analyze_frames(Dump(path))
    assert any("out of reach" in text for text in analysis.contradictions)
    assert analysis.contacts is None
