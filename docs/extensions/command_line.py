"""Provide a directive that shows the help of all commands."""

from typing import Any

import click
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class CommandHelp(SphinxDirective):
    """
    ``{command-help}`` makes a section for each command, with what ``--help`` prints.

    The output of ``chaincor run --help-scene`` is the last section.
    """

    def run(self) -> list[nodes.Node]:
        """
        Make a section from the help of each command.

        Returns
        -------
        list of docutils.nodes.Node
            One section for each command, and one for the scene's options.
        """
        from chaincor.workflows.cli import program

        context = click.Context(program, info_name="chaincor", max_content_width=96)
        sections: list[nodes.Node] = []
        for name in program.list_commands(context):
            command = program.get_command(context, name)
            if command is None:
                raise self.error(f"chaincor {name} cannot be loaded")
            own: Any = click.Context(command, info_name=name, parent=context, max_content_width=96)
            sections.append(_section(f"chaincor {name}", command.get_help(own)))
            if name == "run":
                scene = _section("chaincor run --help-scene", command.scene_help(own))
        return [*sections, scene]


def _section(title: str, text: str) -> nodes.section:
    section = nodes.section("", nodes.title("", title), ids=[nodes.make_id(title)], names=[title])
    section += nodes.literal_block(text, text, language="text")
    return section


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("command-help", CommandHelp)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
