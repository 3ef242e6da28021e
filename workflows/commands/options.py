"""What several commands have: options, the print of a result."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from chaincor.workflows.json_output import json_text

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene

POSITIVE = click.FloatRange(min=0.0, min_open=True)
ONE_OR_MORE = click.IntRange(min=1)
PATH = click.Path(path_type=Path)
FILE = click.Path(dir_okay=False, path_type=Path)
FOLDER = click.Path(file_okay=False, path_type=Path)

json_option = click.option("--json", "as_json", is_flag=True, help="print one JSON object")


def page_option(page: str, figures: str = "figures") -> Callable[[Callable], Callable]:
    """Return the option that says where a study's page and its files go."""
    text = f"write a page ({page}) with its {figures}, CSV and JSON here"
    return click.option("-o", "--output", type=FOLDER, metavar="DIR", help=text)


def tell(plain: Mapping[str, Any], text: str, as_json: bool, scene: "Scene | None" = None) -> None:
    """Print a result: as one JSON object with what all of them have, or as text."""
    click.echo(json_text(plain, scene) if as_json else text)
