"""Test that the program explains the words in results, and its errors."""

import pytest

from chaincor.workflows.showing.terms import ALL_TERMS, OTHER_NAMES
from tests.docs.test_errors_page import named_errors


def test_all_is_listed(chaincor):
    status, out, _ = chaincor("explain")
    assert status == 0
    plain = " ".join(out.split())
    assert all(f"{name}: {text}." in plain for name, text in ALL_TERMS.items())
    assert all(name in plain for name in named_errors())


@pytest.mark.parametrize("word", [*ALL_TERMS, *OTHER_NAMES, "ETA", "momentum-residual"])
def test_each_word_leads_to_its_term(chaincor, word):
    status, out, _ = chaincor("explain", *word.split())
    assert status == 0
    term = out.partition(":")[0]
    assert term == OTHER_NAMES.get(word, word if word in ALL_TERMS else term)
    assert term in ALL_TERMS


def test_no_other_name_hides_a_term(chaincor):
    assert not set(OTHER_NAMES) & set(ALL_TERMS)
    # One term is a row label of `analyze`, the other an ending that `run` prints.
    assert chaincor("explain", "vibration")[1].startswith("vibration: share of the energy")
    said = " ".join(chaincor("explain", "open")[1].split())
    assert "open (another contact may still come; the error bar allows for it)" in said


@pytest.mark.parametrize("name", sorted(named_errors()))
def test_each_error_has_cause_and_remedy(chaincor, name):
    status, out, _ = chaincor("explain", name)
    assert status == 0
    assert out.startswith(f"{name}\n\nCause. ")
    assert "\nRemedy. " in out
    assert "](" not in out
    assert "`" not in out


def test_an_unknown_word(chaincor):
    status, out, err = chaincor("explain", "phlogiston")
    assert (status, out) == (2, "")
    assert "'phlogiston' is not explained. Use one of v*, restitution (energy)" in err
