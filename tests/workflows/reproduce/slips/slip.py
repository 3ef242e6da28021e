"""Define a slip of the paper and its check."""

from dataclasses import dataclass
from enum import StrEnum

from chaincor.workflows.reproduce.report import RIGHT as RIGHT_AS_PRINTED


class Kind(StrEnum):
    """What an entry is."""

    SLIP = "slip"
    FOLLOWS = "counted with eqs. (16), (18)"
    APPROXIMATION = "inconsistency of an approximation"
    REMARK = "remark"
    RIGHT = RIGHT_AS_PRINTED
    UNDECIDED = "undecided"


class Matters(StrEnum):
    """What follows from a slip."""

    NOTHING = "no"
    NUMBER = "a number"
    STATEMENT = "a statement"


@dataclass(frozen=True)
class Slip:
    """A slip, or something that was suspected to be one."""

    where: str  #: Place in the paper.
    printed: str  #: What it prints.
    correct: str  #: What it should be; empty where the print is right.
    evidence: str  #: The check, with its numbers.
    confirmed: bool  #: Whether the check came out as said.
    kind: Kind = Kind.SLIP  #: Whether it counts as a slip.
    #: What follows from it; of entries that do not count, nothing.
    matters: Matters = Matters.NOTHING
