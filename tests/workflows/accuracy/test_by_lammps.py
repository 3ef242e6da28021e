"""What a run of LAMMPS to a tolerance reports beside its own restitution."""

import numpy as np
import pytest

from chaincor import Scene, collide


@pytest.mark.parametrize(("particles", "speed"), [(22, 1.45), (26, 1.7)])
def test_the_reference_error_has_the_part_of_an_open_end(particles, speed):
    fields = {"potential": "morse", "morse_a": 6.0, "particles": particles, "speed": speed}
    found = collide(Scene(**fields, engine="lammps", tolerance=1e-4))
    alone = collide(Scene(**fields, engine="reference", tolerance=1e-4))
    assert found.ending == alone.ending == "open"
    # Both runs end with the same fragments, which differ by the steps alone: below a percent.
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
