"""Define a slip of the paper and its check."""

from dataclasses import dataclass
from enum import StrEnum

from chaincor.workflows.reproduce.report import RIGHT as RIGHT_AS_PRINTED


class Kind(StrEnum):
    """Kind of an entry."""

    SLIP = "slip"
    FOLLOWS = "counted with eqs. (16), (18)"
    APPROXIMATION = "inconsistency of an approximation"
    REMARK = "remark"
    RIGHT = RIGHT_AS_PRINTED
    UNDECIDED = "undecided"


class Matters(StrEnum):
    """Consequence of a slip."""

    NOTHING = "no"
    NUMBER = "a number"
    STATEMENT = "a statement"


@dataclass(frozen=True)
class Slip:
    """A slip, or a suspected slip."""

    where: str  #: Place in the paper.
    printed: str  #: Text in the paper.
    correct: str  #: Corrected text; empty if the paper is right.
    evidence: str  #: Description of the check, with its numbers.
    confirmed: bool  #: Whether the check has the described result.
    kind: Kind = Kind.SLIP  #: Kind of the entry.
    #: Consequence of the slip; nothing for other entries.
    matters: Matters = Matters.NOTHING
