"""Split LAMMPS scripts into commands and words, like LAMMPS."""

import re
from io import StringIO

# Pattern of the text before a comment. A # in quotes, or after an unclosed quote, does not begin a
# comment.
_UNCOMMENTED = re.compile(r"""(?>"{3}.*?"{3}|"[^"]*"|'[^']*'|["'].*|[^#])*""", re.DOTALL)

_SPACES = " \t\n\v\f\r"
_SPACED = re.compile(f"[{_SPACES}]+")
# A quoted word ends at the next quote of the same type. Any other word ends at the next space.
_WORD = re.compile(
    rf"""[{_SPACES}]*(?:"{{3}}(.*?)"{{3}}|"(?!"")([^"]*)"|'([^']*)'|(["'])|([^{_SPACES}]+))""",
    re.DOTALL,
)


def join_lines(text: str) -> list[tuple[str, str]]:
    """
    Return each command of a script in two forms: as written, and as LAMMPS reads it.

    The second form has no comment. Lines are joined if ``&`` continues them, even in a comment, or
    if they are in triple quotes.
    """
    found: list[tuple[str, str]] = []
    raw: list[str] = []
    command, quoted, seen = "", False, 0
    for line in StringIO(text):  # lines end only at "\n"
        raw.append(line.removesuffix("\n"))
        command += line.rstrip(_SPACES)
        # The search continues after the text already searched. If the text were searched from its
        # beginning for each line, an unclosed quote would cost minutes.
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
    Return the words of a command, without the quotes around a word.

    Raises ValueError if a quote begins a word and is never closed.
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
