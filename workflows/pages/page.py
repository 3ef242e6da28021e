"""Write a page as a single HTML file, with embedded figures and a list of files."""

import base64
import csv
import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined

from chaincor.analysis.atomic_write import folder_aside, publish
from chaincor.analysis.output_paths import judge_folder
from chaincor.workflows.pages.typesetting import (
    format_fitted,
    format_number,
    format_short,
    format_value,
    mark_up,
    symbols,
    typeset,
    without_links,
)
from chaincor.workflows.terminal_text import csv_cell

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# If an SVG figure has more bytes than this, the page embeds the figure as PNG.
_LARGEST_SVG = 400_000


def page_environment(package: str) -> Environment:
    """Return the Jinja environment for a package whose templates extend ``page.html.j2``."""
    environment = Environment(
        loader=ChoiceLoader([PackageLoader(package), PackageLoader("chaincor.workflows.pages")]),
        autoescape=lambda name: name is not None and name.endswith("html.j2"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["number"] = format_number
    environment.filters["short"] = format_short
    environment.filters["value"] = format_value
    environment.filters["fitted"] = format_fitted
    environment.filters["typeset"] = lambda text: typeset(without_links(text))
    environment.filters["marked"] = mark_up
    environment.filters["symbols"] = lambda text: mark_up(symbols(str(text)))
    return environment


def data_uri(rendered: Mapping[str, bytes]) -> str:
    """Return a figure as a data URI, in SVG, or in PNG if the SVG is missing or too large."""
    kind = "svg" if len(rendered.get("svg", bytes(_LARGEST_SVG + 1))) <= _LARGEST_SVG else "png"
    media = {"svg": "image/svg+xml", "png": "image/png"}[kind]
    return f"data:{media};base64,{base64.b64encode(rendered[kind]).decode()}"


def drawn_figures(
    folder: Path, about: Mapping[str, tuple[str, str]], alt: str
) -> list[dict[str, Any]]:
    """
    Return the PNG and SVG figures in a folder, in the order of `about`.

    `about` has a title and a caption for each name. `alt` describes the collision in the figures.
    """
    figures: list[dict[str, Any]] = []
    for key, (title, caption) in about.items():
        files = [path for kind in ("svg", "png") if (path := folder / f"{key}.{kind}").exists()]
        if files:
            image = data_uri({path.suffix[1:]: path.read_bytes() for path in files})
            shown = {"alt": f"{title}: {alt}", "image": image, "files": [f.name for f in files]}
            figures.append({"key": key, "title": title, "caption": caption} | shown)
    return figures


def listed_file(path: Path, holds: str) -> dict[str, Any]:
    """Return the entry for a file in a page: name, content, size in bytes and SHA-256."""
    with path.open("rb") as file:
        digest = hashlib.file_digest(file, "sha256").hexdigest()
    return {"name": path.name, "holds": holds, "size": path.stat().st_size, "sha256": digest}


def files_written(folder: Path, holds: Mapping[str, str]) -> list[dict[str, Any]]:
    """List the files in a folder; `holds` describes each by its name, or by ``*`` and suffix."""
    return [
        listed_file(path, holds.get(path.name, holds.get(f"*{path.suffix}", "")))
        for path in sorted(folder.iterdir())
    ]


def write_page(path: Path, package: str, contents: Mapping[str, Any]) -> None:
    """Write a page from the template with the same name."""
    template = page_environment(package).get_template(f"{path.name}.j2")
    path.write_text(template.render(**contents), encoding="utf-8")


@dataclass(frozen=True)
class StudyReport:
    """Writer of a study's files: page, JSON, tables as CSV, and figures as PNG and SVG."""

    name: str  #: Name of page, JSON file and template, without their endings.
    package: str  #: Package that contains the template.
    tables: Mapping[str, str]  #: Description of each table, by file name.
    #: Title and caption of each figure, by file name.
    figures: Mapping[str, tuple[str, str]]

    @property
    def page(self) -> str:
        """File name of the page."""
        return f"{self.name}.html"

    def judge(self, folder: Path) -> None:
        """Raise InputError if the folder is a file, or if the study would overwrite other files."""
        drawn = (f"{name}.{ending}" for name in self.figures for ending in ("png", "svg"))
        judge_folder(folder, self.page, (f"{self.name}.json", *self.tables, *drawn))

    def write(
        self,
        folder: Path,
        plain: Mapping[str, Any],
        tables: Mapping[str, Sequence[Mapping[str, Any]]],
        drawn: Mapping[str, "Axes"],
        contents: Mapping[str, Any],
    ) -> None:
        """
        Write the data first, then the figures and the page.

        If a figure fails, the data are already in the folder. `plain` is the content of the JSON
        file, `tables` maps names to rows, and `drawn` maps names to axes. `contents` are the values
        for the template of the page, and `shown` describes the subject of the figures.
        """
        data = f"{self.name}.json"
        holds = {data: "all numbers of the study", **self.tables}
        with folder_aside(folder) as aside:
            text = json.dumps(plain, indent=2, allow_nan=False)
            (aside / data).write_text(text + "\n", encoding="utf-8")
            for name, rows in tables.items():
                with (aside / name).open("w", newline="", encoding="utf-8") as stream:
                    writer = csv.DictWriter(stream, list(dict.fromkeys(k for r in rows for k in r)))
                    writer.writeheader()
                    writer.writerows({k: csv_cell(v) for k, v in row.items()} for row in rows)
            publish(aside, folder)
            for name, axes in drawn.items():
                for ending in ("png", "svg"):
                    axes.figure.savefig(aside / f"{name}.{ending}")  # type: ignore[union-attr]
            beside = {
                "versions": plain["versions"],
                "figures": drawn_figures(aside, self.figures, contents["shown"]),
                "written": files_written(aside, holds | {"*.png": "figure", "*.svg": "figure"}),
            }
            write_page(aside / self.page, self.package, {**contents, **beside})
