"""Test that the page of JSON keys names exactly the keys that commands print."""

import json
import re

import pytest

from chaincor.analysis.observables import json_keys
from chaincor.workflows import cli
from tests.docs.documents import ROOT

PAGE = ROOT / "docs" / "reference" / "json.md"
SWEEP = """
[scene]
potential = "lj"
engine = "reference"
tolerance = 1e-4
[axes]
particles = [3]
speed = [0.1, 0.2]
"""
SMALL = ("--particles", "3", "--tolerance", "1e-4")
WARM = ("--potential", "harmonic", "--particles", "3", "--velocity", "0.1", "--temperature", "1e-3")
SCRIPT = ("in.x", "--observable", "x=(.*)", "--vary", "h=1:0.1:4", "--phases", "3")
OWN = ("--against", "stepper:eta")
# Each entry gives a section of the page, the command, and the path to the described object.
OBJECTS = [
    ("run", ("run", *SMALL), ()),
    ("run", ("run", *WARM, "--engine", "reference"), ()),
    ("error_parts", ("run", *SMALL), ("error_parts",)),
    ("run", ("run", *SMALL, "--sensitivity"), ()),
    ("sensitivity", ("run", *SMALL, "--sensitivity"), ("sensitivity",)),
    ("run --dry-run", ("run", *SMALL, "--dry-run"), ()),
    ("plan", ("run", *SMALL, "--dry-run"), ("plan",)),
    ("run --samples", ("run", *WARM, "--engine", "reference", "--samples", "3"), ()),
    ("analyze", ("analyze", "job"), ()),
    ("analyze", ("analyze", "two", "--target-particles", "2"), ()),
    ("validate", ("validate", *SMALL), ()),
    ("validations", ("validate", *SMALL), ("validations", 0)),
    ("comparisons", ("validate", *SMALL), ("validations", 0, "comparisons", 0)),
    ("validate --ladder", ("validate", *SMALL[:2], "--ladder", "--timestep", "0.1", *OWN), ()),
    ("timestep", ("timestep", *SCRIPT), ()),
    ("timestep", ("timestep", "in.run", "--vary", "lastdigit"), ()),
    ("observables", ("timestep", *SCRIPT), ("observables", 0)),
    ("observables", ("timestep", "in.run", "--vary", "lastdigit"), ("observables", 0)),
    ("parting", ("timestep", "in.run", "--vary", "lastdigit"), ("parting", 0)),
    ("ladders", ("timestep", *SCRIPT), ("ladders", 0)),
    ("rungs", ("timestep", *SCRIPT), ("observables", 0, "rungs", 0)),
    ("runs", ("timestep", *SCRIPT), ("ladders", 0, "runs", 0)),
    ("table", ("table", "good.table"), ()),
    ("sweep", ("sweep", "s.toml", "--store", "s.sqlite", "--workers", "1"), ()),
    ("sweep --dry-run", ("sweep", "s.toml", "--store", "s.sqlite", "--dry-run"), ()),
    ("to_compute", ("sweep", "s.toml", "--store", "s.sqlite", "--dry-run"), ("to_compute",)),
    ("show", ("show", "s.sqlite"), ()),
    ("doctor", ("doctor",), ()),
    ("findings", ("doctor",), ("findings", 0)),
    ("commands", ("doctor",), ("commands", 0)),
]
SLOW = [
    ("tradeoff", ("tradeoff", "--particles", "3", "--quick"), ()),
    ("tradeoff --calibrate", ("tradeoff", "--calibrate"), ()),
]
RUN = """
units lj
atom_style atomic
lattice fcc 0.8
region box block 0 2 0 2 0 2
create_box 1 box
create_atoms 1 box
mass 1 1.0
pair_style zero 1.2
pair_coeff * *
velocity all create 1.0 1
fix 1 all nve
run 20
"""
ROWS = "\n".join(f"{k} {k / 99} {(k / 99 - 0.5) ** 2 / 2} {0.5 - k / 99}" for k in range(1, 100))
TABLE = f"KEY\nN 99\n\n{ROWS}\n"
EVERYWHERE = {"schema", "versions", "processor"}


def sections():
    """Return all keys of each section, and the keys that are not always present."""
    text = PAGE.read_text()
    found = {}
    for title, body in re.findall(r"^##+ `?([^`\n]+)`?\n(.*?)(?=^##|\Z)", text, re.M | re.S):
        keys = re.findall(r"^\| (?!key )(.+?) \|", body, re.M)
        for command in re.findall(r"^```{observables} (\w+)", body, re.M):
            keys += [f"`{each.name}`" + " *" * rare for each, rare in json_keys(command)]
        named = [key for cell in keys for key in re.findall(r"`(\w+)`", cell)]
        rare = {k for cell in keys if cell.endswith("*") for k in re.findall(r"`(\w+)`", cell)}
        assert len(set(named)) == len(named), title
        found[title] = set(named), rare
    return found


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """Return a function that runs a command once in a prepared folder and returns its JSON."""
    folder = tmp_path_factory.mktemp("json")
    (folder / "s.toml").write_text(SWEEP)
    (folder / "stepper.py").write_text("def eta(scene):\n    return [scene.timestep] * 3\n")
    (folder / "in.x").write_text('variable h index 1\nprint "x=$(v_h^2:%.17g)"\n')
    (folder / "in.run").write_text(RUN)
    (folder / "good.table").write_text(TABLE)
    known = {}

    def run(arguments, capsys, monkeypatch):
        monkeypatch.chdir(folder)
        if arguments[0] == "analyze" and not (folder / arguments[1]).exists():
            targets = ("--target-particles", "2") if "two" in arguments else ()
            cli.run_command_line(
                ["run", *SMALL, *targets, "--dump", f"{arguments[1]}/dump.lammpstrj"]
            )
        if arguments[0] == "show" and not (folder / "s.sqlite").exists():
            cli.run_command_line(["sweep", "s.toml", "--store", "s.sqlite", "--workers", "1"])
        if arguments not in known:
            capsys.readouterr()
            assert cli.run_command_line([*arguments, "--json"]) == 0
            known[arguments] = json.loads(capsys.readouterr().out)
        return known[arguments]

    return run


def check(title, arguments, path, printed, capsys, monkeypatch):
    found = printed(arguments, capsys, monkeypatch)
    if not path:
        assert found["schema"] == 1
        assert found["versions"]["chaincor"]
        assert found["processor"]
    for step in path:
        found = found[step]
    named, rare = sections()[title]
    keys = set(found) - (set() if path else EVERYWHERE)
    assert keys - named == set(), "not on the page"
    assert named - set(found) - rare == set(), "not printed"


@pytest.mark.slow
@pytest.mark.parametrize(("title", "arguments", "path"), OBJECTS, ids=[o[0] for o in OBJECTS])
def test_keys_are_those_of_the_page(title, arguments, path, printed, capsys, monkeypatch):
    check(title, arguments, path, printed, capsys, monkeypatch)


@pytest.mark.slow
@pytest.mark.parametrize(("title", "arguments", "path"), SLOW, ids=[o[0] for o in SLOW])
def test_keys_of_studies(title, arguments, path, printed, capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    check(title, arguments, path, printed, capsys, monkeypatch)


def test_every_section_is_tried():
    tried = {title for title, _, _ in (*OBJECTS, *SLOW)}
    # Other tests try these sections.
    elsewhere = {"collect", "reproduce", "Every object"}
    assert set(sections()) - elsewhere == tried
