"""A figure of the report: what it shows, its data, and how it is drawn."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from chaincor.analysis.figures.style import SETTINGS
from chaincor.workflows.reproduce.tables import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Canvas

# Element ids of SVG files are made from this, so that equal data give equal files.
_SALT = "chaincor"


@dataclass(frozen=True)
class Figure:
    """
    A figure of the report.

    Attributes
    ----------
    key : str
        Name of its files.
    title : str
        What it is, in a few words.
    caption : str
        What it shows, how it was made, and what to see.
    table : Table or None
        Its data; None for a drawing without any.
    draw : callable
        Makes the Matplotlib figure.
    alt : str
        What is to be seen, for those who do not see it.
    """

    key: str
    title: str
    caption: str
    table: Table | None
    draw: "Callable[[], Canvas]"
    alt: str

    def render(self) -> dict[str, bytes]:
        """Draw the figure: the contents of its ``png`` and its ``svg`` file, by these names."""
        import matplotlib as mpl

        with mpl.rc_context(SETTINGS | {"svg.hashsalt": _SALT}):
            canvas = self.draw()
            rendered = {}
            for kind in ("png", "svg"):
                buffer = io.BytesIO()
                canvas.savefig(
                    buffer, format=kind, metadata={"Date": None} if kind == "svg" else {}
                )
                rendered[kind] = buffer.getvalue()
        return rendered
