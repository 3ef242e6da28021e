"""Test that scripts whose timestep has no effect are refused, with the cause and a remedy."""

import pytest

from chaincor import timestep_study
from chaincor.lammps_inputs.errors import InputError

MELT = """
units lj
lattice fcc 0.8442
region box block 0 2 0 2 0 2
create_box 1 box
create_atoms 1 box
mass 1 1
{start}
pair_style lj/cut 1.5
pair_coeff * * 1 1
{fixes}
timestep 0.005
{end}
"""
MOVES = "velocity all create 1.0 4928"
REFUSED = {
    "no_run": (MOVES, "fix 1 all nve", "minimize 0 0 10 10", r"has no 'run', only 'minimize'"),
    "run_0": (MOVES, "fix 1 all nve", "run 0", "runs 0 steps"),
    "no_integrator": (MOVES, "", "run 20", "no fix that integrates, so no atom moves"),
    "two_integrators": (
        MOVES,
        "fix 1 all nve\nfix 2 all nvt temp 1 1 1",
        "run 20",
        r"line 11 of in\.x is 'fix 1 all nve'; line 12 of in\.x is 'fix 2 all nvt'",
    ),
    "own_choice": (
        MOVES,
        "fix 1 all nve\nfix 2 all dt/reset 10 1e-5 0.01 0.05 units box",
        "run 20",
        "'fix 2 all dt/reset'.*Remove this line.*run: chaincor timestep .*in.x",
    ),
    # In a perfect crystal at rest, all forces are 0 up to rounding, which takes longer to grow.
    "at_rest": ("", "fix 1 all nve", "pair_coeff * * 0 1\nrun 20", "kinetic energy is 0 at all"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_timestep_without_effect_is_refused(tmp_path, case):
    start, fixes, end, said = REFUSED[case]
    path = tmp_path / "in.x"
    path.write_text(MELT.format(start=start, fixes=fixes, end=end))
    with pytest.raises(InputError, match=said):
        timestep_study(path)


def test_a_run_in_an_included_file_or_in_an_if_is_found(tmp_path):
    """Find the run: the study continues until it refuses the quantity."""
    for number, end in enumerate(('if "1 > 0" then "run 20"', "include in.more")):
        (tmp_path / "in.more").write_text("run 20\n")
        path = tmp_path / f"in.{number}"
        path.write_text(MELT.format(start=MOVES, fixes="", end=end))
        with pytest.raises(InputError, match="no atom moves"):
            timestep_study(path)


def test_one_atom_moves_although_its_kinetic_energy_is_0_in_lammps(tmp_path):
    """Study one atom, although LAMMPS subtracts the motion of the centre of mass."""
    path = tmp_path / "in.x"
    one = MELT.replace("create_atoms 1 box", "create_atoms 1 single 0.1 0 0")
    one = one.replace("units lj", "units lj\natom_modify map array")
    fixes = "fix pull all spring/self 1.0\ndisplace_atoms all move 0.1 0 0\nfix 1 all nve"
    path.write_text(one.format(start="", fixes=fixes, end="variable x equal x[1]\nrun 200"))
    study = timestep_study(path, ["v_x:last"], phases=3)
    assert study.ladders[0].numbers[0].name == "v_x:last"
