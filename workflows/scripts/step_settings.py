"""Find how to run a script with a value of the ladder: by an option of lmp or an edited line."""

import shlex
from typing import TYPE_CHECKING

from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.script_text import ScriptText

if TYPE_CHECKING:
    from chaincor.workflows.scripts.study import ScriptStudy


def takes_option(script: ScriptText, name: str) -> bool:
    """Return whether ``-var NAME VALUE`` sets a variable of a script."""
    return all(command.words[2] in ("index", "delete") for command in script.of_variable(name))


def format_command(lmp: str, variables: dict[str, str], script: str) -> str:
    """Format the command of a run for a shell."""
    given = [word for name, value in variables.items() for word in ("-var", name, value)]
    return shlex.join([*shlex.split(lmp), *given, "-in", script])


def how_to_run(study: "ScriptStudy", name: str, value: str, fixed: dict[str, str]) -> str:
    """Return the command that runs a script with a value, and the lines to edit before."""
    script, kind = study.varied.script, study.varied.kind
    variables = {**({name: value} if kind == "variable" else {}), **fixed}
    options = {key: text for key, text in variables.items() if takes_option(script, key)}
    lines = [
        f"'variable {key} {script.of_variable(key)[0].words[2]} {text}' in "
        f"{script.of_variable(key)[0]}"
        for key, text in variables.items()
        if key not in options
    ]
    if kind == "step":
        lines.append(f"timestep {value}")
    elif kind == "setting":
        lines += _changed_lines(script, name, value)
    command = format_command("lmp", options, study.script.name)
    if kind == "step" and not options:
        return lines[0]
    return "; ".join([*lines, command]) if options or not lines else "; ".join(lines)


def where_to_set(study: "ScriptStudy", name: str) -> str:
    """Write where a script sets the value; empty if this is obvious."""
    if study.varied.kind != "setting":
        return ""
    lines = [str(c) for c in study.varied.script.commands if _change(c.words, name, "1")]
    return f", set in {', '.join(lines)}" if lines else ""


def _change(words: list[str], name: str, value: str) -> str:
    changed = list(words)
    Change(settings={name: value}).set_numbers(changed)
    return "" if changed == words else " ".join(changed)


def _changed_lines(script: ScriptText, name: str, value: str) -> list[str]:
    found = [(command, _change(command.words, name, value)) for command in script.commands]
    return [f"'{text}' in {command}" for command, text in found if text]
