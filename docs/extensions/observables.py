"""Provide a directive that makes a table of observables from their list."""

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class Observables(SphinxDirective):
    """``{observables} run`` or ``{observables} analyze`` makes a table of JSON keys."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """
        Make a row for each observable.

        Returns
        -------
        list of docutils.nodes.Node
            One table.
        """
        from chaincor.analysis.observables import json_keys

        table, group = nodes.table(), nodes.tgroup(cols=3)
        table += group
        group += [nodes.colspec(colwidth=width) for width in (25, 60, 15)]
        head, body = nodes.thead(), nodes.tbody()
        group += [head, body]
        head += _row(*(nodes.paragraph("", text) for text in ("key", "meaning", "unit")))
        for each, rare in json_keys(self.arguments[0]):
            key = nodes.paragraph("", "", nodes.literal("", each.name), nodes.Text(" *" * rare))
            body += _row(key, nodes.paragraph("", each.meaning), nodes.paragraph("", each.unit))
        return [table]


def _row(*cells: nodes.Node) -> nodes.row:
    return nodes.row("", *(nodes.entry("", cell) for cell in cells))


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("observables", Observables)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
