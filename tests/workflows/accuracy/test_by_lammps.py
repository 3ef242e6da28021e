"""Test the restitution of the reference engine that is given with a LAMMPS result."""

import numpy as np
import pytest

from chaincor import Scene, collide
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.workflows.errors import BondRangeError

LJ = LennardJones()


@pytest.mark.parametrize(("particles", "speed"), [(22, 1.45), (26, 1.7)])
def test_the_reference_error_has_the_part_of_an_open_end(particles, speed):
    fields = {"potential": "morse", "morse_a": 6.0, "particles": particles, "speed": speed}
    found = collide(Scene(**fields, engine="lammps", tolerance=1e-4))
    alone = collide(Scene(**fields, engine="reference", tolerance=1e-4))
    assert found.ending == alone.ending == "open"
    # The two runs end with the same fragments; different steps change their energies by less than a
    # percent.
    assert found.reference_error == pytest.approx(alone.restitution_error, rel=0.01)
    assert found.reference_error > 100.0 * found.error_parts.step
    assert found.restitution_error >= found.error_parts.ending


def test_the_spread_of_arrays_holds_their_errors():
    # The two runs of LAMMPS differ by less than their common error of the contact times.
    fields = {
        "potential": "morse",
        "morse_a": 6.0,
        "compression": 0.0141,
        "particles": 19,
        "velocity": 0.0022789226184068367,
    }
    found = collide(Scene(**fields, engine="lammps", tolerance=1e-5))
    right = collide(Scene(**fields, engine="reference", tolerance=1e-10))
    for name in ("contact_times", "contact_speeds", "velocities", "mode_energies"):
        error = np.max(np.abs(getattr(found, name) - getattr(right, name)))
        assert error <= found.details["spread"][name] + right.details["spread"][name]


def lj_file(path, shortest):
    """Write an lj bond as a table of 200 rows up to length 1.086, and return the path."""
    lengths = np.linspace(shortest, 1.086, 200)
    energies, forces = LJ.energy(lengths - 1.0), LJ.force(lengths - 1.0)
    rows = [
        f"{k} {r:.17g} {u:.17g} {f:.17g}"
        for k, (r, u, f) in enumerate(zip(lengths, energies, forces, strict=True), 1)
    ]
    path.write_text("LJ\nN 200\n\n" + "\n".join(rows) + "\n")
    return path


@pytest.mark.parametrize("tolerance", [1e-3, 1.2922527573836723e-05, 1e-7])
def test_steps_that_leave_the_data_of_a_bond_are_shortened(tmp_path, tolerance):
    # Bond lengths are 0.927 to 1.0187. At the second tolerance, the run with the longer step had a
    # bond of 1.0888.
    scene = Scene(
        potential="table",
        bond_file=lj_file(tmp_path / "lj.table", 0.8960789501761179),
        particles=3,
        velocity=0.06760197453537611,
        engine="lammps",
        tolerance=tolerance,
    )
    found = collide(scene)
    right = collide(scene.replace(engine="reference", tolerance=1e-8))
    assert found.tolerance_met
    assert abs(found.restitution - right.restitution) <= found.restitution_error


def test_a_bond_that_leaves_its_data_after_the_last_contact_is_named(tmp_path):
    # LAMMPS must follow the chain until no contact can come. By then a bond has stretched to 1.086.
    scene = Scene(
        potential="table",
        bond_file=lj_file(tmp_path / "lj.table", 0.7450414379981184),
        particles=13,
        velocity=0.06486069004847878,
        engine="lammps",
        tolerance=0.0026902945492491377,
    )
    with pytest.raises(BondRangeError, match=r"its data reach from 0\.745.* to 1\.086") as refused:
        collide(scene)
    assert "timestep" not in str(refused.value)
