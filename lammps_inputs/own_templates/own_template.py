"""Template of a user: text and values, and rendering in a sandbox."""

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Any

from chaincor.lammps_inputs.errors import SceneError, one_line
from chaincor.lammps_inputs.isolated import Isolated, IsolatedError
from chaincor.lammps_inputs.own_templates.rules import check_commands, check_whole
from chaincor.lammps_inputs.small_file import read_small_file

_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}", re.ASCII)
# Pattern of a number or a plain word. It excludes line ends, and characters that LAMMPS would
# substitute, split, or read as a comment or a continuation.
_WORD = re.compile(r"[A-Za-z0-9.+-][A-Za-z0-9_.+/-]{0,79}", re.ASCII)
# Options of rendering for templates of users and of this package.
RENDERING: dict[str, Any] = {
    "trim_blocks": True,
    "lstrip_blocks": True,
    "keep_trailing_newline": True,
}
_BASE = "job.in.j2"
# Largest total number of rounds in all loops and macros of a template. Nested loops could run for
# days.
_MOST_ROUNDS = 200_000
# Statement that says that the commands of the template exert forces.
_OTHER_FORCES = re.compile(r"\{%-?\s*set\s+other_forces\s*=\s*true\s*-?%\}")
_REPORT = re.compile(r"\{%-?\s*block\s+report\b")
_EXTENDS = re.compile(r"\{%-?\s*extends\b")


@dataclass(frozen=True)
class OwnTemplate:
    """Template that extends ``job.in.j2``, or is a whole script."""

    text: str  #: Text of the template.
    #: Additional values for the template, as text.
    settings: dict[str, str] = field(default_factory=dict)

    @classmethod
    def from_file(cls, path: Path, given: tuple[str, ...] = ()) -> "OwnTemplate":
        """
        Read a template, and settings ``NAME=VALUE``.

        Raises SceneError if the file cannot be read, or a setting is not a name with a number or a
        plain word.
        """
        try:
            text = read_small_file(path)
        except (OSError, ValueError) as error:
            reason = error.strerror if isinstance(error, OSError) else error
            raise SceneError(
                f"the template {str(path)!a} cannot be read: {reason}. Give a text file"
            ) from None
        return cls(text, parse_settings(given))

    @property
    def other_forces(self) -> bool:
        """Whether the template states that its commands exert forces on the chain."""
        return _OTHER_FORCES.search(self.text) is not None

    @property
    def reports(self) -> bool:
        """Whether the template prints additional results."""
        return _REPORT.search(self.text) is not None

    @property
    def whole(self) -> bool:
        """Whether the template is a whole script, which extends no other template."""
        return _EXTENDS.search(self.text) is None

    def render(self, values: dict[str, Any], plain: str | None = None) -> str:
        """
        Render the template: as a whole script, or as a job whose blocks the template replaces.

        `plain` is the job without these blocks. Commands that are not in `plain` come from the
        template and are checked. Rendering runs in a separate process, with limited time and
        memory. Raises SceneError if the template is not jinja2, names an unknown block or value,
        tries to leave the sandbox, exceeds the limits, or has a command that would break the job.
        """
        try:
            return _RENDERED(self, values, plain)
        except IsolatedError as error:
            raise SceneError(
                f"the template cannot be rendered: {error}. Shorten its computations"
            ) from None

    def render_here(self, values: dict[str, Any], plain: str | None) -> str:
        """Render the template in this process; see :meth:`render`."""
        from jinja2 import PackageLoader, StrictUndefined, meta, nodes
        from jinja2.exceptions import SecurityError, TemplateError
        from jinja2.sandbox import ImmutableSandboxedEnvironment

        loader = PackageLoader("chaincor.lammps_inputs", "templates")
        # No escaping is needed, because the text is not HTML, and values of users are numbers or
        # words.
        environment = ImmutableSandboxedEnvironment(
            loader=loader, undefined=StrictUndefined, **RENDERING
        )
        environment.globals["begin_round"] = _counter_of_rounds()
        try:
            tree = environment.parse(self.text)
            named = meta.find_undeclared_variables(tree)
            if list(meta.find_referenced_templates(tree)) != ([] if self.whole else [_BASE]):
                raise SceneError(
                    f"the template extends or includes a file other than {_BASE}. Begin it with "
                    f'{{% extends "{_BASE}" %}}, or write a whole script'
                )
            if not self.whole:
                known = environment.get_template(_BASE).blocks
                for block in tree.find_all(nodes.Block):
                    if block.name not in known:
                        raise SceneError(
                            f"line {block.lineno} of the template has the block "
                            f"{block.name[:40]!a}, which the job lacks. Use one of "
                            f"{', '.join(sorted(known))}"
                        )
            self._refuse_settings(named, values)
            kinds: tuple[Any, ...] = (nodes.For, nodes.Macro, nodes.CallBlock)
            for repeated in tree.find_all(kinds):
                begins = nodes.Call(nodes.Name("begin_round", "load"), [], [], None, None)
                repeated.body.insert(0, nodes.ExprStmt(begins, lineno=repeated.lineno))
            text = environment.from_string(tree).render(self.settings | values)
        except SecurityError as error:
            raise SceneError(
                "the template uses a forbidden operation: "
                f"{_one_line(error).rstrip('.')}. Use values and filters, such as "
                "{{ 2 * particles }}"
            ) from None
        except (
            *(TemplateError, ArithmeticError, TypeError, ValueError, LookupError),
            RecursionError,
        ) as error:
            line = getattr(error, "lineno", None)
            where = "" if line is None else f", line {line}"
            reason = _one_line(error) or type(error).__name__
            raise SceneError(
                f"the template cannot be rendered{where}: {reason}; correct it, or give missing "
                "values by --set NAME=VALUE"
            ) from None
        if plain is None:
            check_whole(text)
        else:
            check_commands(text, plain, composed=values["composed"], other_forces=self.other_forces)
        return text

    def _refuse_settings(self, named: set[str], values: dict[str, Any]) -> None:
        for name in self.settings:
            if name in values:
                raise SceneError(
                    f"--set {name} is a value of the job itself. Use another name, or set the "
                    "job's value by its own option or in the scene file"
                )
            if name not in named:
                others = ", ".join(sorted(named - set(values)))
                raise SceneError(
                    f"the template does not use --set {name}. Leave it out"
                    + (f", or use one of {others}" if others else "")
                )


_RENDERED = Isolated(OwnTemplate.render_here, seconds=2, megabytes=1000)


def parse_settings(given: tuple[str, ...]) -> dict[str, str]:
    """Split settings ``NAME=VALUE``; raise SceneError if a name or value is not valid."""
    settings: dict[str, str] = {}
    for text in given:
        name, equals, value = text.partition("=")
        if not equals or not _NAME.fullmatch(name) or name in settings:
            raise SceneError(
                f"--set is given {text[:60]!a}. Write NAME=VALUE with a name of small letters, "
                "digits and _, and give each name once"
            )
        if not _WORD.fullmatch(value):
            raise SceneError(
                f"--set {name} is given {value[:60]!a}. Give a number or a plain word of "
                "letters, digits and _.+-/"
            )
        settings[name] = value
    return settings


def _counter_of_rounds() -> Callable[[], None]:
    """Return the function that a template calls in each round of a loop and in each macro."""
    rounds = count(1)

    def begin_round() -> None:
        if next(rounds) > _MOST_ROUNDS:
            raise SceneError(
                f"the loops and macros of the template take more than {_MOST_ROUNDS:,} rounds. "
                "Shorten what they loop over"
            )

    return begin_round


def _one_line(error: Exception) -> str:
    return one_line(error)[:200]
