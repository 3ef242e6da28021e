"""Test the comparison of pages with printed output."""

import pytest

from tests.docs.printed_output import agrees

PAGE = """restitution   eta = 0.77079976 +- 8.6e-08
contacts      84, the last at t = 154.12
energy drift  -1.3e-14
time 0.502 s for this run
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("0.77079976", "0.77079970"),  # within 8.6e-8
        ("8.6e-08", "4.1e-07"),
        ("154.12", "154.13"),
        ("-1.3e-14", "2.0e-15"),
        ("0.502 s", "17 s"),
        ("eta =  ", "eta = "),
    ],
)
def test_output_of_another_processor_agrees(old, new):
    assert agrees(PAGE, PAGE.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("0.77079976", "0.77080"),
        ("8.6e-08", "8.6e-06"),
        ("8.6e-08", "0.0"),
        ("84,", "85,"),
        ("154.12", "154.14"),
        ("-1.3e-14", "-1.3e-4"),
        ("contacts", "hits"),
        ("0.502 s", "soon"),
        ("154.12", "nan"),
    ],
)
def test_another_output_is_found(old, new):
    assert old in PAGE
    assert not agrees(PAGE, PAGE.replace(old, new))


def test_error_on_its_own_line_is_the_bar_of_a_number():
    job = "restitution = 0.70887399571\nrestitution_error = 4.7e-10"
    assert agrees(job, job.replace("9571", "9562"))
    assert not agrees(job, job.replace("9571", "8571"))
    assert not agrees(job, job.replace("4.7e-10", "4.7e-08"))


def test_ten_digits_of_a_long_number_are_compared():
    assert agrees("energy = 0.0054203751061886263", "energy = 0.0054203751062")
    assert not agrees("energy = 0.0054203751061886263", "energy = 0.0054203761")


def test_dots_stand_for_anything():
    assert agrees("eta = 0.5\n...\nend 3", "eta = 0.5\nany 7 lines\nof text\nend 3")
    assert not agrees("eta = 0.5\n...\nend 3", "eta = 0.5\nany\nend 4")


def test_digits_before_dots_are_the_first_of_a_number():
    assert agrees("1 0.8... 1...", "1 0.824 1.413")
    assert not agrees("1 0.8... 1...", "1 0.834 2.413")
    assert not agrees("1 0.82... 1...", "1 0.83 1.413")
