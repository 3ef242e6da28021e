"""What numbers look like to a reader."""

import pytest

from chaincor.workflows.reproduce.typesetting import (
    format_number,
    format_short,
    format_value,
    typeset,
)


@pytest.mark.parametrize(
    ("value", "error", "shown"),
    [
        (0.80976, 1.4e-5, "0.80976 ± 0.00001"),
        (-0.0318, 0.031, "−0.032 ± 0.031"),
        (4.9e-10, 1.6e-7, "4.9e−10 ± 2e−7"),
        (0.87, 0.0, "0.8700"),
        (1.0, 0.0, "1"),
        (float("nan"), 0.1, "–"),
    ],
)
def test_value_is_shown_to_the_digits_of_its_error(value, error, shown):
    assert format_value(value, error) == shown


def test_numbers_have_minus_signs_and_short_exponents():
    assert format_number(-0.66667) == "−0.6667"
    assert format_number(1e-5) == "1e−5"
    assert format_number(1e10) == "1e+10"
    assert format_number(10000.0) == "10000"
    assert format_number(None) == "–"
    assert format_short(0.06666) == "0.0667"
    assert format_short(-2e-7) == "−2e−7"
    assert format_short(float("nan")) == "–"


def test_minus_signs_in_text_are_told_from_hyphens():
    assert (
        typeset("n = 10-20, in-house, -0.63 at 0.4 v*")
        == "n = 10-20, in-house, −0.63 at 0.4\u00a0v*"
    )
