"""Define options that several commands share, and print results."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from chaincor.workflows.json_output import json_text
from chaincor.workflows.terminal_text import printable

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene

POSITIVE = click.FloatRange(min=0.0, min_open=True)
ONE_OR_MORE = click.IntRange(min=1)
PATH = click.Path(path_type=Path)
FILE = click.Path(dir_okay=False, path_type=Path)
FOLDER = click.Path(file_okay=False, path_type=Path)


def option(
    shown: str, text: str, kind: Any = None, *, name: str | None = None, **more: Any
) -> Callable[[Callable], Callable]:
    """
    Return a click option from its usage, such as ``-o, --output DIR``, and its help.

    An option without a placeholder and without a kind is a flag. `name` is the name of the
    parameter, if it differs from the option's. `more` are further settings for click.
    """
    words = shown.split()
    names = [word.rstrip(",") for word in words if word.startswith("-")]
    metavar = " ".join(words[len(names) :]) or None
    if metavar is None and kind is None:
        more["is_flag"] = True
    if name is not None:
        names.append(name)
    return click.option(*names, type=kind, metavar=metavar, help=text, **more)


json_option = option("--json", "print one JSON object", name="as_json")


def page_option(page: str, figures: str = "figures") -> Callable[[Callable], Callable]:
    """Return the option for the folder to which a study writes its page and files."""
    text = f"write a page ({page}) with {figures}, CSV and JSON into this folder"
    return option("-o, --output DIR", text, FOLDER)


def say(text: object, *, err: bool = False) -> None:
    """Print a text with escaped control characters, which file names may contain."""
    click.echo(printable(str(text), keep="\n\t"), err=err)


def tell(plain: Mapping[str, Any], text: str, as_json: bool, scene: "Scene | None" = None) -> None:
    """Print a result as text, or as one JSON object with the keys common to all results."""
    say(json_text(plain, scene) if as_json else text)


def tell_page(page: Path, as_json: bool) -> None:
    """Print the path of a written page, except with JSON, where only one object is printed."""
    if not as_json:
        say(f"page: {page}")
