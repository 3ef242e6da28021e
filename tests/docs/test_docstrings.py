"""Test that the examples in docstrings of public functions run."""

import doctest

import pytest

import chaincor

# These examples take minutes. The page docs/reproduction.md and other tests run them.
TOO_LONG = {"reproduce"}
# These examples start processes or programs.
SLOW = {"Store", "sweep", "timestep_study", "to_pandas", "tradeoff"}


@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow) if n in SLOW else n for n in chaincor.__all__],
)
def test_an_example_prints_what_it_says(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (docstring,) = doctest.DocTestFinder(recurse=False).find(getattr(chaincor, name), name)
    run = [example for example in docstring.examples if doctest.SKIP not in example.options]
    assert docstring.examples
    assert (name in TOO_LONG) == (len(run) < len(docstring.examples))
    said: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    assert runner.run(docstring, out=said.append).failed == 0, "".join(said)
