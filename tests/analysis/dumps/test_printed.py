"""Test the numbers that a script printed into its log."""

import math

import pytest

from chaincor.analysis.dumps.printed import printed_error, printed_numbers

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
    # The last printed text is no number, and an earlier number is not the result of the script.
    assert "restitution" not in found
    assert printed_numbers(LOG.replace("0.1.2", "null x"), ("restitution",)) == {
        "restitution": 0.75
    }


@pytest.mark.parametrize("name", ["last_contact_time", "wall_impulse"])
def test_what_is_not_printed_is_left_out(name):
    assert printed_numbers(LOG, (name,)) == {}


def test_an_error_is_taken_from_the_log_of_the_run_alone(tmp_path):
    logs = [tmp_path / "a.log", tmp_path / "b.log"]
    logs[0].write_text("restitution = 0.25\nrestitution_error = 1e-9\n")
    logs[1].write_text("restitution = 0.5\nrestitution_error = 1e-6\n")
    error, says = printed_error(logs, 0.5 + 1e-9, 1e-8)
    assert error == 1e-6 + 1e-8
    assert "printed in b.log, 1.0e-06" in says
    error, says = printed_error(logs[:1], 0.5, 1e-8)
    assert error is None
    assert (
        "belongs to restitution = 0.25, but the dump gives 0.5, so they are from different runs"
        in says
    )


@pytest.mark.parametrize("word", ["null", "nan", "inf", "-1e-9"])
def test_what_is_no_error_is_none(tmp_path, word):
    log = tmp_path / "log.lammps"
    log.write_text(f"restitution = 0.5\nrestitution_error = {word}\n")
    assert printed_error([log], 0.5, 0.0) == (None, None)
