"""Test runs that differ by rounding: runs of a liquid diverge, runs of a crystal do not."""

import math

import numpy as np
import pytest

from chaincor import timestep_study
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.description import _describe_comparison, describe_script_study
from chaincor.workflows.scripts.parting import (
    PARTED,
    Difference,
    PartingComparison,
    judge_distances,
)
from chaincor.workflows.scripts.quantities import RequestedNumbers
from chaincor.workflows.scripts.script_run import Runner
from chaincor.workflows.scripts.vary_options import read_ranks, read_switch

SCRIPT = """
units lj
lattice fcc {density}
region box block 0 3 0 3 0 3
create_box 1 box
create_atoms 1 box
mass 1 1.0
velocity all create {temperature} 87287
pair_style lj/cut 2.5
pair_coeff 1 1 1.0 1.0
fix 1 all nve
run 2500
"""


# Atoms of a cubic cell of a face-centred crystal.
FCC = np.array([[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]])


def script(tmp_path, density, temperature):
    path = tmp_path / "in.x"
    path.write_text(SCRIPT.format(density=density, temperature=temperature))
    return path


def frames_of(path, tmp_path, shaken):
    scratch = tmp_path / "scratch"
    scratch.mkdir(exist_ok=True)
    files = list(path.parent.glob("*.*"))
    done = Runner(path, files, RequestedNumbers(None, ()), find_lmp_command(), scratch, 600.0).run(
        f"{shaken}", Change(shaken=shaken, frames=True)
    )
    assert done.failure is None
    return done.frames


def with_data(path):
    """Let a script read its crystal, because atom ids of create_atoms depend on the processes."""
    cell = (4.0 / float(path.read_text().split("fcc ")[1].split()[0])) ** (1.0 / 3.0)
    corners = np.array(list(np.ndindex(3, 3, 3)))
    places = np.concatenate([corners + shift for shift in FCC]) * cell
    edge = f"0 {3.0 * cell:.17g}"
    lines = ["crystal", "", f"{len(places)} atoms", "1 atom types", ""]
    lines += [f"{edge} {axis}lo {axis}hi" for axis in "xyz"] + ["", "Atoms", ""]
    lines += [f"{k} 1 {x:.17g} {y:.17g} {z:.17g}" for k, (x, y, z) in enumerate(places, 1)]
    (path.parent / "crystal.data").write_text("\n".join([*lines, ""]))
    head, tail = path.read_text().split("lattice", 1)
    path.write_text(f"{head}read_data crystal.data\nmass{tail.split('mass', 1)[1]}")
    return path


@pytest.mark.slow
@pytest.mark.parametrize("vary", ["lastdigit", "ranks=1,2"])
def test_a_melt_parts_when_lyapunov_says(tmp_path, vary):
    path = with_data(script(tmp_path, 0.8442, 3.0))
    study = timestep_study(path, ["temp"], vary=vary)
    (found,) = study.comparisons
    assert found.kind == "chaos"
    # The Lyapunov exponent comes from a displacement that is a million times larger. The fit begins
    # when the displacement has grown 1000 times, in the direction of fastest growth. It ends at
    # half the distance that is called parted.
    first, second = (frames_of(path, tmp_path, shaken) for shaken in (0.0, 1e-9))
    apart = np.sqrt(np.mean(np.sum((first.positions - second.positions) ** 2, axis=2), axis=1))
    apart /= first.spacing
    inside = (apart > 1000.0 * apart[0]) & (apart < 0.5 * PARTED)
    growth = np.polyfit(first.times[inside], np.log(apart[inside]), 1)[0]
    expected = math.log(PARTED / found.distances[found.distances > 0.0][0]) / growth
    assert 0.5 < found.parted / expected < 2.0
    assert 0.5 < found.growth / growth < 2.0
    assert "chaos" in describe_script_study(study)
    print(f"{vary}: parted at {found.parted:.3g}, by Lyapunov {expected:.3g}; "
          f"growth {found.growth:.3g}, by Lyapunov {growth:.3g}")  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("vary", ["lastdigit", "ranks=1,2"])
def test_a_crystal_does_not_part(tmp_path, vary):
    path = with_data(script(tmp_path, 1.0, 0.1))
    (found,) = timestep_study(path, ["temp"], vary=vary).comparisons
    assert found.kind in ("same", "together")
    assert found.parted is None
    # Rounding of 2500 steps, in units of the distance between neighbours.
    assert np.max(found.distances) < 1e-10
    assert found.agrees("temp:mean")
    print(f"{vary}: {found.kind}, at most {np.max(found.distances):.2g} apart")


def test_a_run_may_begin_without_particles(tmp_path):
    """Ignore frames without particles, which `fix pour` has at first."""
    path = script(tmp_path, 1.0, 0.1)
    head = path.read_text().split("create_atoms")[0]
    more = "mass 1 1.0\npair_style lj/cut 2.5\npair_coeff 1 1 1.0 1.0\nfix 1 all nve\nrun 9\n"
    path.write_text(f"{head}{more}create_atoms 1 single 1 1 1 units box\nrun 5\n")
    found = frames_of(path, tmp_path, 0.0)
    times, positions, spacing = found.times, found.positions, found.spacing
    assert times == pytest.approx(0.005 * np.arange(15))
    assert np.all(np.isnan(positions[:10]))
    assert np.all(positions[10:] == 1.0)
    # The box has 3 cells per edge with 4 particles each at density 1, but contains a single
    # particle.
    assert spacing == pytest.approx(3.0 * 4.0 ** (1.0 / 3.0))


def test_verdicts_on_distances():
    times = np.linspace(0.0, 10.0, 201)
    assert judge_distances(times, np.zeros(201))[0] == "same"
    assert judge_distances(times, np.full(201, 1e-14)) == ("together", None, None)
    kind, parted, growth = judge_distances(times, 1e-14 * np.exp(4.0 * times))
    assert kind == "chaos"
    # The time is ln(1e12)/4 = 6.908, rounded up to the next sample.
    assert parted == pytest.approx(6.95)
    assert growth == pytest.approx(4.0, rel=1e-6)
    assert judge_distances(times, np.full(201, 0.3))[0] == "at once"


def test_a_mean_whose_error_is_not_known_is_called_one():
    numbers = {
        "temp:mean": Difference(0.1, 1e-3, math.inf, 3.0),
        "pe:drift": Difference(0.2, 1e-3, math.nan, math.nan),
        "pe:last": Difference(0.2, 1e-16, math.nan, math.nan),
    }
    parted = PartingComparison(
        "last digit", "together", None, None, np.zeros(1), np.zeros(1), numbers
    )
    mean, drift, last = _describe_comparison(parted)[-3:]
    said = "too few samples for a bar (3 correlation times: run 10 times longer)"
    assert mean.endswith(f"difference 0.001: {said}")
    assert drift.endswith("difference 0.001: not a mean")
    assert last.endswith("difference 1e-16: agrees up to roundings")


CRYSTAL = """
units lj
lattice fcc 0.8442
region box block 0 3 0 3 0 3
create_box 1 box
create_atoms 1 box
mass 1 1.0
velocity all create 0.1 87287 {loop}
pair_style lj/cut 2.5
pair_coeff 1 1 1.0 1.0
fix 1 all nve
run 100
"""


@pytest.mark.slow
def test_particles_that_lammps_numbers_otherwise_are_matched_by_position(tmp_path):
    """Match particles by position: `create_atoms` numbers them by process, velocities by place."""
    path = tmp_path / "in.x"
    path.write_text(CRYSTAL.format(loop="loop geom"))
    (found,) = timestep_study(path, ["temp"], vary="ranks=1,2").comparisons
    assert found.kind == "together"
    assert found.renumbered
    # Rounding of 100 steps, in units of the distance between neighbours.
    assert np.max(found.distances) < 1e-10
    assert found.agrees("temp:mean")
    path.write_text(CRYSTAL.format(loop=""))
    study = timestep_study(path, ["temp"], vary="ranks=1,2")
    (found,) = study.comparisons
    assert found.kind == "at once"
    assert "numbered the particles differently" in found.causes[0]
    assert "loop geom" in study.summary


@pytest.mark.slow
def test_a_restart_halfway_goes_on_as_one_run_does(tmp_path):
    path = tmp_path / "in.x"
    path.write_text(CRYSTAL.format(loop="") + "run 300\n")
    (found,) = timestep_study(path, ["temp"], vary="restart").comparisons
    assert found.what == "restart read at step 250 instead of one run"
    # Times are those of steps 250 to 400, with a time step of 0.005.
    assert found.times[0] == pytest.approx(1.25)
    assert found.times[-1] == pytest.approx(2.0)
    assert found.kind in ("same", "together")
    assert found.agrees("temp:mean")
    # Random forces start again, because no restart file contains their state.
    path.write_text(path.read_text() + "fix 2 all langevin 0.1 0.1 0.1 4711\nrun 200\n")
    (found,) = timestep_study(path, ["temp"], vary="restart").comparisons
    assert found.kind == "at once"
    assert "fix 2 all langevin" in found.causes[0]


@pytest.mark.slow
def test_values_of_a_switch_are_compared(tmp_path):
    path = tmp_path / "in.x"
    switch = "variable hot index 0\nif '${hot} > 0' then 'velocity all scale 0.2'\nrun 100"
    path.write_text(CRYSTAL.format(loop="").replace("run 100", switch))
    study = timestep_study(path, ["temp"], vary="hot=0:1:2")
    (found,) = study.comparisons
    assert found.what == "hot = 1 instead of 0"
    assert found.kind == "at once"
    assert "different velocities" in study.summary


def test_switches_are_whole_numbers():
    assert read_switch("use_restart=0:1:2") == ("0", "1")
    assert read_switch("way=0:4:3") == ("0", "2", "4")
    assert read_switch("way=3,1,2") == ("3", "1", "2")
    for text in ("h=0.1:0.01:4", "n=10:20:5", "n=0:1", "n"):
        assert read_switch(text) is None
    with pytest.raises(InputError, match="each value of the switch once"):
        read_switch("way=1,1")


def test_ranks_are_numbers():
    assert read_ranks("ranks=1,2,4") == (1, 2, 4)
    for text in ("ranks", "ranks=1", "ranks=1,1", "ranks=0,2", "ranks=1,99", "ranks=a,b"):
        with pytest.raises(InputError, match="Give "):
            read_ranks(text)
