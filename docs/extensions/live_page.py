"""Provide a directive that shows the live page inside a page."""

from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

FILE = "live.html"


class LivePage(SphinxDirective):
    """``{live-page}`` shows the page that ``chaincor explore`` writes."""

    def run(self) -> list[nodes.Node]:
        """
        Show the live page in a frame.

        Returns
        -------
        list of docutils.nodes.Node
            The frame, for HTML.
        """
        above = "../" * self.env.docname.count("/")
        frame = (
            f'<iframe class="live-page" src="{above}{FILE}" loading="lazy" '
            'title="A chain meets a wall: a page that computes collisions"></iframe>'
            f'<p class="live-page"><a href="{above}{FILE}">The whole page</a>: energies, modes, '
            "hits, the restitution at every speed, masses, targets, temperature.</p>"
        )
        return [nodes.raw("", frame, format="html")]


def write_page(app: Sphinx) -> None:
    """Write the live page into the folder of the site."""
    if app.builder.format == "html":
        from chaincor.workflows.pictures.live_page import live_page

        Path(app.outdir, FILE).write_text(live_page(), encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("live-page", LivePage)
    app.connect("builder-inited", write_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
