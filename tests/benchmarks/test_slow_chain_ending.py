"""Test the contacts of a harmonic chain while the push of the chain decreases."""

import math

import pytest

from benchmarks.slow_chains.ending import excess, interval_at, interval_under, steady_contacts
from chaincor.analysis.slow_chains.curve import FRONT_LEAD
from chaincor.analysis.slow_chains.harmonic import PressedEnd


def test_lead_of_the_front_follows_from_the_interval_between_contacts():
    # The interval is known to 5e-6, and the lead changes by 0.3 times the interval.
    assert steady_contacts(2.29954)[0] == pytest.approx(FRONT_LEAD, abs=3e-6)


@pytest.mark.parametrize("push", [0.8, 0.6])
def test_contacts_keep_their_action_while_the_push_decreases(push):
    # An interval differs from the adiabatic one by terms of the order of the rate. Over half an
    # interval the push falls by 1.2 rates, and the interval grows by at most 1.4 times as much.
    rate = 1e-3
    assert interval_at(push, rate) == pytest.approx(interval_under(push), abs=3.0 * rate)
    assert interval_under(push) > interval_under(1.0) + 0.1


def test_predicted_contacts_are_those_of_the_search():
    rate = 0.004
    end = PressedEnd(rate)
    while end.next_contact(until=1.0 / rate + 40.0, steady=False):
        pass
    searched = math.fsum(end.momenta) - 0.5 / rate
    # Contacts are found to 1e-13, and the last contacts amplify errors.
    assert excess(rate) == pytest.approx(searched, abs=1e-6)
