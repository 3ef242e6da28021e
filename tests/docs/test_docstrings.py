"""Examples in the docstrings of what users call run as they stand."""

import doctest

import pytest

import chaincor


@pytest.mark.parametrize("name", ["Scene", "UserBond", "collide"])
def test_an_example_prints_what_it_says(name):
    (example,) = doctest.DocTestFinder(recurse=False).find(getattr(chaincor, name), name)
    assert example.examples
    said: list[str] = []
    assert doctest.DocTestRunner().run(example, out=said.append).failed == 0, "".join(said)
