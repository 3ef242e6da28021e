"""One slip of the paper."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Slip:
    """
    A slip, or an equation that was suspected and found right.

    Attributes
    ----------
    where : str
        Place in the paper.
    printed : str
        What it prints.
    correct : str
        What it should be; empty where the print is right.
    evidence : str
        The check, with its numbers.
    confirmed : bool
        Whether the check came out as said.
    """

    where: str
    printed: str
    correct: str
    evidence: str
    confirmed: bool
