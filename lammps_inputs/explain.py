"""Annotated jobs: an explanation for every command of an input script."""

import re
import textwrap
import tomllib
from functools import cache
from importlib.resources import files
from typing import NamedTuple

from chaincor.lammps_inputs.commands import join_lines

# Comments are narrow enough for a slide.
_WIDTH = 72
_SENTENCE_ENDS = re.compile(r"(?<=[.!?])\s")


class Explanation(NamedTuple):
    """Explanation of a command."""

    match: str  #: Regular expression that matches the beginning of the command.
    text: str  #: Effect of the command, why it is needed, and what happens without it.
    page: str  #: Name of the page of the LAMMPS manual.


def explain_script(script: str, others_own: bool = False, brief: bool = False) -> str:
    """
    Write an explanation above the first command of each kind.

    A `brief` explanation is one sentence. If the script has its own comment on the command, the
    page of the manual is added to this comment. Raises KeyError if a command has no explanation.
    With `others_own`, the script has commands of a user, which need no explanation.
    """
    lines: list[str] = [*_comment(_texts()["plain_heading" if brief else "heading"]), ""]
    explained: set[Explanation] = set()
    for raw, command in join_lines(script):
        try:
            found = explanation_of(raw.strip()) if command else None
        except KeyError:
            if not others_own:
                raise
            found = None
        if found is not None and found not in explained:
            explained.add(found)
            if brief and lines[-1].startswith("#"):
                lines[-1] += f" [{found.page}]"
            else:
                if lines[-1] and not lines[-1].startswith("# ----"):
                    lines.append("")
                text = _SENTENCE_ENDS.split(found.text)[0] if brief else found.text
                lines += _comment(f"{text} [{found.page}]")
        lines += raw.split("\n")
    return "\n".join(lines) + "\n"


def explain_data(data: str) -> str:
    """Write an explanation below the title of a data file; LAMMPS skips comments there."""
    title, rest = data.split("\n", 1)
    return "\n".join([f"# {title}", "", *_comment(_texts()["data"]), rest])


def explain_table(table: str) -> str:
    """Write an explanation above a bond table."""
    return "\n".join([*_comment(_texts()["table"]), table])


def explanation_of(command: str) -> Explanation:
    """Return the first explanation that matches a command; raise KeyError if there is none."""
    for entry in _texts()["command"]:
        if re.match(entry["match"], command):
            return Explanation(**entry)
    raise KeyError(f"explanations.toml has no entry for {command!r}. Add one")


@cache
def _texts() -> dict:
    text = files("chaincor.lammps_inputs").joinpath("explanations.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def _comment(text: str) -> list[str]:
    return [
        f"# {line}"
        for paragraph in text.strip().splitlines()
        for line in textwrap.wrap(paragraph, _WIDTH)
    ]
