"""The commands of a LAMMPS script, read as LAMMPS reads them."""

import re
from io import StringIO

# What comes before a comment: a # in quotes begins none, nor behind a quote that stands alone.
_UNCOMMENTED = re.compile(r"""(?>"{3}.*?"{3}|"[^"]*"|'[^']*'|["'].*|[^#])*""", re.DOTALL)

_SPACES = " \t\n\v\f\r"
_SPACED = re.compile(f"[{_SPACES}]+")
# A word begins with a quote and ends at the next such, or ends at the next space.
_WORD = re.compile(
    rf"""[{_SPACES}]*(?:"{{3}}(.*?)"{{3}}|"(?!"")([^"]*)"|'([^']*)'|(["'])|([^{_SPACES}]+))""",
    re.DOTALL,
)


def join_lines(text: str) -> list[tuple[str, str]]:
    """
    Return each command of a script, as it stands and as LAMMPS reads it.

    The second is without its comment, and with lines joined that ``&`` continues, in a comment as
    well, or that stand in triple quotes.
    """
    found: list[tuple[str, str]] = []
    raw: list[str] = []
    command, quoted, seen = "", False, 0
    for line in StringIO(text):  # which ends at no other character than "\n"
        raw.append(line.removesuffix("\n"))
        command += line.rstrip(_SPACES)
        # From where no more are: counted anew, quotes that never end would take minutes.
        while (at := command.find('"""', seen)) >= 0:
            quoted, seen = not quoted, at + 3
        seen = max(seen, len(command) - 3)
        if quoted:
            command += "\n"
        elif command.endswith("&"):
            command = command[:-1]
        else:
            found.append(("\n".join(raw), _without_comment(command)))
            raw, command, seen = [], "", 0
    return found + ([("\n".join(raw), _without_comment(command))] if raw else [])


def commands_of(text: str) -> list[str]:
    """Return the commands of a script, with one space between their words."""
    found = [_SPACED.sub(" ", command).strip(" ") for _, command in join_lines(text)]
    return [command for command in found if command]


def words_of(command: str) -> list[str]:
    """
    Return the words of a command, without the quotes that hold one together.

    Raises ValueError for a quote that begins a word and never ends.
    """
    words = []
    for found in _WORD.finditer(command):
        if found[4]:
            raise ValueError(f"{command!r} has a quote that never ends")
        words.append(found[found.lastindex or 0])
    return words


def _without_comment(command: str) -> str:
    own = _UNCOMMENTED.match(command)
    return own[0].rstrip() if own else ""
