"""Test that `explain` knows the row labels and column heads that commands print."""

import re
from pathlib import Path

import pytest

from chaincor.workflows.showing.terms import ALL_TERMS, OTHER_NAMES
from tests.workflows.scripts.test_bottom_line import CRYSTAL

SCRIPT = CRYSTAL.format(more="")
TABLE = "T\nN 60\n\n" + "".join(
    f"{k} {0.6 + 0.02 * k:.17g} {(0.02 * k - 0.4) ** 2:.17g} {-2 * (0.02 * k - 0.4):.17g}\n"
    for k in range(1, 61)
)
RESTART, SINGLE = (
    ("timestep", "in.x", "--vary", "restart"),
    ("timestep", "in.x", "pe", "--phases", "3"),
)
COMMANDS = [
    ("run", "--particles", "3"),
    ("validate", "--particles", "3"),
    ("table", "t.table"),
    ("table", "bad.table"),
    ("timestep", "in.x", "--phases", "3"),
    SINGLE,
    RESTART,
]
# At least two spaces follow a label, or the label is a single word before a colon.
_LABEL = re.compile(r"^([a-z_][\w ]*?(?= {2,})|[a-z_]+(?=: ))")
# Quantities of LAMMPS, which its manual explains, and names of files and of the variable.
_OTHERS = re.compile(r"(etotal|temp|pe|press|timestep|in\.x|.*\.table|page).*")


def labels(text: str) -> set[str]:
    lines = text.splitlines()
    found = {match[1] for line in lines if (match := _LABEL.match(line))}
    heads = [line for line in lines if line.startswith("quantity") or " scatter " in line]
    found |= {cell for line in heads for cell in re.split(r" {2,}", line.strip())}
    return {label for label in found if not _OTHERS.fullmatch(label)}


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_every_label_is_explained(command, chaincor, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("in.x").write_text(SCRIPT)
    Path("t.table").write_text(TABLE)
    Path("bad.table").write_text(TABLE.replace("N 60", "N 59"))
    _, out, _ = chaincor(*command)
    found = labels(out)
    assert found, out
    unknown = found - set(ALL_TERMS) - set(OTHER_NAMES)
    assert not unknown
