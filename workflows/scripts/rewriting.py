"""
A user's script made obey: other steps for the same time, samples of numbers, no dumps.

Nothing of the script is edited but commands that run, write frames, or set what is varied.
"""

import re
from pathlib import Path

from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.script_text import join_lines
from chaincor.workflows.scripts.settings import set_numbers
from chaincor.workflows.scripts.timed_runs import included_files, timed_run

_LEFT_OUT = ("dump", "undump", "dump_modify", "restart")
# What may stand in a command's place where nothing shall.
_NOTHING = "variable chaincor_none string 0"
_NO_VALUES = ("loop", "delete", "world", "universe", "uloop")
_RESETS = ("reset_timestep", "read_restart")
_LARGEST = 10_000_000
_QUOTED = re.compile(r"\"([^\"]*)\"|'([^']*)'")


def rewrite_folder(folder: Path, script: Path, change: Change) -> None:
    """Rewrite a copy of the script, and of what it may include, and write what these include."""
    for path in folder.rglob("*"):
        if path == script or _may_be_included(path):
            path.write_text(rewrite(path.read_text("utf-8", "replace"), folder, change), "utf-8")
    head = "variable chaincor_shift string 0\nvariable chaincor_first string 1\n"
    script.write_text(head + script.read_text("utf-8"), "utf-8")
    for name, text in included_files(folder, change).items():
        (folder / name).write_text(text, "utf-8")


def _may_be_included(path: Path) -> bool:
    if not path.is_file() or path.stat().st_size > _LARGEST or path.suffix in (".py", ".md"):
        return False
    data = path.read_bytes()
    return b"\0" not in data[:4096] and bool(re.search(rb"(?m)^\s*(run|variable|fix|dump)\s", data))


def rewrite(text: str, folder: Path, change: Change) -> str:
    """Return the text of a script with its commands changed."""
    lines: list[str] = []
    for raw, command in join_lines(text):
        words = command.split()
        if words and words[0] == "if":
            lines.append(_QUOTED.sub(lambda found: _quoted(found, folder, change), command))
            continue
        changed = _command(command, folder, change)
        lines += [raw] if changed == [command] else (changed or [_NOTHING])
    return "\n".join([*lines, ""])


def _quoted(found: re.Match[str], folder: Path, change: Change) -> str:
    """Rewrite a command in quotes, as it stands behind ``then``."""
    quote, text = found[0][0], found[1] if found[1] is not None else found[2]
    if not text.split():
        return found[0]
    commands = _command(text, folder, change)
    return " ".join(f"{quote}{each}{quote}" for each in commands or [_NOTHING])


def _command(command: str, folder: Path, change: Change) -> list[str]:
    """Return what stands in a command's place."""
    words = command.split()
    if not words:
        return [command]
    name = words[0]
    if name == "run" and len(words) > 1:
        return timed_run(words, folder)
    if name in _LEFT_OUT:
        return []
    if name in _RESETS:
        return [command, "variable chaincor_shift string 0"]
    is_value = name == "variable" and len(words) > 2 and words[2] not in _NO_VALUES
    if is_value and words[1] in change.variables:
        return [f"variable {words[1]} index {change.variables[words[1]]}"]
    before = set_numbers(words, change)
    if words[:2] == ["thermo_style", "custom"]:
        if not change.printed:
            # LAMMPS prints many fixes at multiples of their period alone, and a run at another step
            # seldom ends at one; the columns stay as many.
            words = ["time" if re.match(r"[fv]_", word) else word for word in words]
        # LAMMPS knows no keyword that its thermo output does not have.
        keywords = [each for each in change.quantities if not re.match(r"[cfv]_", each)]
        words += [each for each in keywords if each not in words]
    return [*before, " ".join(words)] if before or words != command.split() else [command]
