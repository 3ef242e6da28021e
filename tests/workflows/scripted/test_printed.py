"""Numbers that a script printed, from its log."""

import math

import pytest

from chaincor.workflows.scripted.printed import printed_numbers

LOG = """LAMMPS (22 Jul 2025)
print "restitution = ${eta}"
restitution = 0.5
  contacts = 9
restitution = 0.75
restitution = 0.1.2
restitution_error = null
momentum_change = -nan
xrestitution = 3
last_contact_time is 7
"""


def test_the_last_number_of_each_name_counts():
    found = printed_numbers(
        LOG, ("restitution", "restitution_error", "contacts", "momentum_change")
    )
    assert found["contacts"] == 9
    assert math.isnan(found["restitution_error"])
    assert math.isnan(found["momentum_change"])
    # What was printed last is no number, and an older one is not what the script ended with.
    assert "restitution" not in found
    assert printed_numbers(LOG.replace("0.1.2", "null x"), ("restitution",)) == {
        "restitution": 0.75
    }


@pytest.mark.parametrize("name", ["last_contact_time", "wall_impulse"])
def test_what_is_not_printed_is_left_out(name):
    assert printed_numbers(LOG, (name,)) == {}
