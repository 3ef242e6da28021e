"""Provide a directive that documents every name in ``chaincor.__all__``."""

import importlib
import inspect

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class PublicNames(SphinxDirective):
    """``{public-names}`` makes a section for each public name, with its whole docstring."""

    def run(self) -> list[nodes.Node]:
        """
        Make a section for each name.

        Returns
        -------
        list of docutils.nodes.Node
            One section for each name, in alphabetical order.
        """
        chaincor = importlib.import_module("chaincor")
        sections: list[nodes.Node] = []
        for name in chaincor.__all__:
            title = nodes.title("", "", nodes.literal("", name))
            section = nodes.section("", title, ids=[nodes.make_id(f"name-{name}")], names=[name])
            kind = "class" if inspect.isclass(getattr(chaincor, name)) else "function"
            text = f"```{{eval-rst}}\n.. auto{kind}:: chaincor.{name}\n   :no-index:\n"
            if kind == "class":
                text += "   :members:\n   :no-inherited-members:\n"
            lines = StringList((text + "```").splitlines(), source=f"chaincor.{name}")
            self.state.nested_parse(lines, self.content_offset, section)
            sections.append(section)
        return sections


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("public-names", PublicNames)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
