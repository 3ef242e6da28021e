"""The commands of a LAMMPS script, read as LAMMPS reads them."""

import re

# What comes before a comment: a # in quotes begins none, nor behind a quote that stands alone.
_UNCOMMENTED = re.compile(r"""(?>"{3}.*?"{3}|"[^"]*"|'[^']*'|["'].*|[^#])*""", re.DOTALL)


def join_lines(text: str) -> list[tuple[str, str]]:
    """
    Return each command of a script, as it stands and as LAMMPS reads it.

    The second is without its comment, and with lines joined that ``&`` continues, in a comment as
    well, or that stand in triple quotes.
    """
    found: list[tuple[str, str]] = []
    raw: list[str] = []
    command, quoted = "", False
    for line in text.splitlines():
        raw.append(line)
        command += line.rstrip()
        # Counted at other lines, too, quotes that never end would take minutes.
        if '"' in line:
            quoted = command.count('"""') % 2 == 1
        if quoted:
            command += "\n"
        elif command.endswith("&"):
            command = command[:-1]
        else:
            found.append(("\n".join(raw), _without_comment(command)))
            raw, command = [], ""
    return found + ([("\n".join(raw), _without_comment(command))] if raw else [])


def commands_of(text: str) -> list[str]:
    """Return the commands of a script, with one space between their words."""
    found = [" ".join(command.split()) for _, command in join_lines(text)]
    return [command for command in found if command]


def _without_comment(command: str) -> str:
    own = _UNCOMMENTED.match(command)
    return own[0].rstrip() if own else ""
