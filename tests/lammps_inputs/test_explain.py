"""Test that an annotated job has the commands of the plain job, and explains each of them."""

import re
from itertools import pairwise
from pathlib import Path

import pytest

from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.chain_data import format_data
from chaincor.lammps_inputs.explain import (
    explain_data,
    explain_script,
    explain_table,
    explanation_of,
)
from chaincor.lammps_inputs.scene import Scene

GOLDEN = sorted((Path(__file__).parents[1] / "golden").glob("*-*.in"))
JOBS = [path for path in GOLDEN if not path.name.startswith("setup")]


def commands(text):
    stripped = (line.strip() for line in text.splitlines())
    return [line for line in stripped if line and not line.startswith("#")]


@pytest.mark.parametrize("path", JOBS, ids=lambda p: p.stem)
def test_explaining_changes_no_command(path):
    lean = path.read_text()
    explained = explain_script(lean)
    assert commands(explained) == commands(lean)
    assert len(explained) > 1.5 * len(lean)


@pytest.mark.parametrize("path", JOBS, ids=lambda p: p.stem)
def test_the_first_command_of_each_kind_has_its_comment_right_above(path):
    lines = explain_script(path.read_text()).splitlines()
    seen, quoted = set(), False
    for above, line in pairwise(lines):
        inside = quoted
        quoted ^= line.count('"""') == 1
        if inside:  # a line of a text that a command prints
            continue
        if line and not line.strip().startswith("#") and not above.endswith("&"):
            explanation = explanation_of(line.strip())
            if explanation not in seen:
                assert above.startswith("#")
                assert above.endswith(f"[{explanation.page}]")
            seen.add(explanation)
    assert len(seen) > 30


def test_a_command_without_an_explanation_is_an_error():
    with pytest.raises(KeyError, match="no entry for 'pair_style"):
        explain_script("pair_style lj/cut 2.5\n")


def test_no_comment_can_be_mistaken_for_a_command():
    # A trailing & would continue the comment. LAMMPS ignores $ and quotes in comments.
    text = explain_script(JOBS[0].read_text())
    assert not re.search(r"^#.*&$", text, flags=re.MULTILINE)
    assert '"""' not in text
    assert max(map(len, (line for line in text.splitlines() if line.startswith("#")))) <= 100


def test_data_and_table_keep_their_rows():
    data = format_data(Scene(particles=3, velocity=0.1).line)
    assert commands(explain_data(data)) == commands(data)[1:]  # the title becomes a comment
    table = tabulate(LennardJones(), (0.9, 1.1), "spline", 11).to_text()
    assert commands(explain_table(table)) == commands(table)
