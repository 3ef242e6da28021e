"""The paper's slips, read from the page ``paper_slips.md`` that their tests write."""

import re
from dataclasses import dataclass

from chaincor.workflows.documents import DOCUMENTS

# What the page says of an entry that was suspected, and is right.
RIGHT = "right as printed"


@dataclass(frozen=True)
class Slip:
    """A slip of the paper, or something that was suspected to be one."""

    #: Place in the paper, and what it prints.
    where: str
    printed: str  #: See ``where``.
    correct: str  #: What it should be; empty where the print is right.
    kind: str  #: ``slip``, or what else the entry is.
    matters: str  #: What follows from a slip; a dash for entries that are none.
    evidence: str  #: The check, with its numbers.


def read_slips() -> tuple[str, tuple[Slip, ...]]:
    """Return how many slips there are, in a sentence, and the slips in the paper's order."""
    page = (DOCUMENTS / "paper_slips.md").read_text(encoding="utf-8")
    head, *entries = re.split(r"\n## \d+\. ", page)
    return head.strip().rpartition("\n")[2].removesuffix("."), tuple(map(_slip, entries))


def _slip(entry: str) -> Slip:
    where, _, rest = entry.partition("\n")
    said = dict(line[2:].split(": ", 1) for line in rest.splitlines() if line.startswith("- "))
    return Slip(
        where=where,
        printed=said["Printed"],
        correct="" if said.get("Kind") == RIGHT else said["Correct"],
        kind=said.get("Kind", "slip"),
        matters=said.get("Matters", "–"),
        evidence=said["Evidence"],
    )
