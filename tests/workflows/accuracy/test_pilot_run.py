"""Test when a pilot run is made, and when LAMMPS itself reports a motion that it cannot follow."""

from dataclasses import replace

import pytest

from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.errors import TableError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.pilot_run import usual_pilot_run
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps import engine as lammps


def test_scouted_bonds_are_those_of_the_collision():
    scene = Scene(particles=10, speed=0.4, timestep=0.05)
    found = usual_pilot_run(scene.problem)
    exact = collide(Scene(particles=10, speed=0.4, engine="reference", tolerance=1e-8))
    assert found.end.contacts == exact.contacts
    # Bond lengths are sampled at the ends of steps, which miss at most a tenth of the strain.
    printed = found.to_dict()
    assert printed["bond_min"] - 1.0 == pytest.approx(exact.bond_min - 1.0, rel=0.1)
    assert printed["bond_max"] - 1.0 == pytest.approx(exact.bond_max - 1.0, rel=0.1)


@pytest.mark.parametrize(("particles", "speed"), [(6, 0.4), (10, 0.4), (20, 0.1), (10, 0.8)])
@pytest.mark.parametrize("dumped", [False, True])
def test_a_table_of_scouted_bonds_is_not_outgrown(particles, speed, dumped, tmp_path):
    dump = {"dump": tmp_path / "dump.lammpstrj"} if dumped else {}
    scene = Scene(particles=particles, speed=speed, table_points=1001, **dump)
    bonds = usual_pilot_run(scene.problem).table_range()
    numerics = replace(Numerics.from_scene(scene), bond_range=bonds)
    used = lammps.run(scene.problem, numerics).details["table"]
    made = tabulate(scene.bond, bonds, numerics.table, 1001)
    assert (used["shortest"], used["longest"]) == (made.lengths[0], made.longest)


@pytest.mark.parametrize("velocity", [4.0, 10.0, 1e10])
def test_bonds_too_sharp_for_any_step_are_not_scouted(velocity):
    # A log bond at 4 v* is compressed to a length of 1e-7. Steps that resolve this would take
    # hours.
    scene = Scene(potential="log", particles=2, velocity=velocity, timestep=0.01)
    assert usual_pilot_run(scene.problem) is None


def test_bonds_too_short_for_a_table_are_refused():
    with pytest.raises(TableError, match="Lower the speed, or use engine 'reference'"):
        collide(Scene(potential="log", particles=2, velocity=10.0, timestep=0.01))
