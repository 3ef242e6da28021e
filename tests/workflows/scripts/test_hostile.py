"""Test that no option becomes a command, and that every refusal is one line."""

import contextlib
import random
import string

import pytest

from chaincor import timestep_study
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.quantities import check_pattern
from chaincor.workflows.scripts.script_run import ScriptRunError
from chaincor.workflows.scripts.vary_options import read_fixed, read_ladder
from tests.extremes.test_injection import ATTACKS

SCRIPT = """
variable timestep index 0.1
variable seed index 1
print "x = $(0.5+v_timestep^2:%.17g)"
"""
HARMLESS = ["timestep=0.1:0.01:8", "rows=1000,10000", "timestep", "0.1", "=", ":", ",", "-var"]


def hostile(count):
    """Return texts from attacks, combined options, and random characters, from a fixed seed."""
    dice = random.Random(17)
    alphabet = string.printable + "\u2028\x85\x00\u0660"
    for _ in range(count):
        parts = [
            dice.choice(ATTACKS),
            dice.choice(HARMLESS),
            "".join(dice.choice(alphabet) for _ in range(dice.randrange(1, 12))),
        ]
        dice.shuffle(parts)
        yield "".join(parts[: dice.randrange(1, 4)])


@pytest.mark.parametrize("read", [read_ladder, lambda text: read_fixed((text,))])
def test_what_is_read_holds_names_and_numbers_alone(read):
    refused = 0
    for text in hostile(300):
        try:
            found = read(text)
        except InputError:
            refused += 1
            continue
        given = [{found.name: found.text(found.coarse)}] if hasattr(found, "name") else found
        for variables in given:
            for name, value in variables.items():
                assert name.isascii()
                assert name.isidentifier()
                assert set(value) <= set("0123456789.+-eE")
                float(value)
    assert refused > 200


@pytest.mark.slow
def test_hostile_options_on_the_command_line(tmp_path, monkeypatch, chaincor):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in.x").write_text(SCRIPT)
    before = sorted(path.name for path in tmp_path.iterdir())
    good = {"--vary": "timestep=0.1:0.01:4", "--observable": r"x = (\S+)"}
    for k, text in enumerate(hostile(120)):
        if text in HARMLESS:
            continue
        name = ("--vary", "--fix", "--observable", "--lmp", "script", "--seeds")[k % 6]
        options = {**good, "script": "in.x", "--phases": "3", name: text}
        # A pattern or a path may be harmless. In this case, the run itself must fail or be refused.
        if name == "--observable":
            options["--vary"] = "seed=1:1:1"
        path = options.pop("script")
        arguments = [word for pair in options.items() for word in pair]
        status, out, err = chaincor("timestep", *arguments, "--", path)
        assert status in (1, 2), (name, text)
        assert len(err.strip().splitlines()) == 1, (name, text, err)
        assert out == ""
    assert sorted(path.name for path in tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("pattern", "said"),
    [
        ("x = (", "no regular expression"),
        (r"x = \S+", "0 groups"),
        (r"(x) = (\S+)", "2 groups"),
        ("x" * 2000, "2000 characters"),
        ("(?P<n>x)(?P=m)", "no regular expression"),
    ],
)
def test_patterns_that_are_none(pattern, said):
    with pytest.raises(InputError, match=said):
        check_pattern(pattern)


def test_hostile_patterns_are_only_ever_patterns(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    dice = random.Random(5)
    for _ in range(25):
        pattern = dice.choice(ATTACKS) + dice.choice(["(", ")", r"(\S+)", "", "(?#"])
        with contextlib.suppress(InputError):
            check_pattern(pattern)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "refusal"),
    [
        ({"script": None}, "script is None. Give a path"),
        ({"quantities": [3]}, "quantities is 3. Give a text"),
        ({"fix": {"a": 1}}, "fix is {'a': 1}. Give a text or a list of texts"),
        ({"vary": 3}, "vary is 3. Give a text"),
        ({"observable": b"(.)"}, "observable is b'(.)'. Give a text"),
        ({"lmp": 3}, "lmp is 3. Give a text"),
        ({"seeds": "5"}, "seeds is '5'. Give a whole number, 1 or more"),
        ({"phases": 3.5}, "phases is 3.5. Give a whole number, 1 or more"),
        ({"tolerance": "1"}, "the tolerance is '1'. Give a positive finite number"),
        ({"timeout": "1"}, "the time limit of a run is '1'. Give a positive finite number"),
    ],
)
def test_arguments_of_another_type_are_refused_by_name(options, refusal):
    with pytest.raises(InputError) as refused:
        timestep_study(**{"script": "in.x"} | options)
    assert str(refused.value) == refusal


def test_one_quantity_may_be_given_as_a_text(tmp_path):
    script = tmp_path / "in.x"
    script.write_text("units lj\nrun 1\n")
    with pytest.raises(ScriptRunError, match=r"chaincor timestep \S+in.x pe --timeout 1$"):
        timestep_study(script, "pe", timeout=0.01)
