"""Scouting: where it helps, and where LAMMPS is left to say what it cannot follow."""

import pytest

from lammps_inputs.errors import TableError
from lammps_inputs.scene import Scene
from workflows.collision import collide
from workflows.scouting import scout


def test_scouted_bonds_are_those_of_the_collision():
    found = scout(Scene(particles=10, speed=0.4, timestep=0.05))
    exact = collide(Scene(particles=10, speed=0.4, engine="reference", tolerance=1e-8))
    assert found.contacts == exact.contacts
    # Seen at the ends of steps: a share of the strain is missed, at most a tenth.
    assert found.bond_min - 1.0 == pytest.approx(exact.bond_min - 1.0, rel=0.1)
    assert found.bond_max - 1.0 == pytest.approx(exact.bond_max - 1.0, rel=0.1)


@pytest.mark.parametrize("velocity", [4.0, 10.0, 1e10])
def test_bonds_too_sharp_for_any_step_are_not_scouted(velocity):
    # A log bond at 4 v* is compressed to 1e-7: steps that follow it would take hours.
    scene = Scene(potential="log", particles=2, velocity=velocity, timestep=0.01)
    assert scout(scene) is None


def test_bonds_too_short_for_a_table_are_refused():
    with pytest.raises(TableError, match="lower the speed, or use engine 'reference'"):
        collide(Scene(potential="log", particles=2, velocity=10.0, timestep=0.01))
