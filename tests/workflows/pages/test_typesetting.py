"""Test the typesetting of numbers."""

import pytest

from chaincor.workflows.pages.typesetting import (
    format_fitted,
    format_number,
    format_short,
    format_value,
    mark_up,
    typeset,
    without_links,
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


def test_minus_signs_in_text_are_distinguished_from_hyphens():
    assert (
        typeset("n = 10-20, in-house, -0.63 at 0.4 v*")
        == "n = 10-20, in-house, −0.63 at 0.4\u00a0v*"
    )


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("1 − η ∝ n^(−2/3)", "1 − η ∝ n<sup>−2/3</sup>"),
        ("|c|^(−1/(r−2)), c s^r", "|c|<sup>−1/(r−2)</sup>, c s<sup>r</sup>"),
        ("x_(j+1) − x_j < U_LJ(x)", "x<sub>j+1</sub> − x<sub>j</sub> &lt; U<sub>LJ</sub>(x)"),
        ("[E_j](#mode_spectra)", '<a href="#mode_spectra">E<sub>j</sub></a>'),
        ("<script> [x](http://a)", "&lt;script&gt; [x](http://a)"),
    ],
)
def test_formulas_and_links_are_marked_up_and_nothing_else(text, shown):
    assert mark_up(text) == shown


def test_links_are_words_where_there_is_no_page():
    assert without_links("see [the fits](#fits), n^(2/3)") == "see the fits, n^(2/3)"


def test_a_fit_through_two_points_shows_no_digits_it_cannot_have():
    assert format_fitted(-0.02113, float("nan")) == "−0.021 (no bar)"
    assert format_fitted(-0.0318, 0.031) == "−0.032 ± 0.031"
    assert format_fitted(float("nan"), float("nan")) == "–"
