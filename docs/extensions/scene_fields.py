"""Provide a directive that lists the keys of a scene from its fields."""

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective


class SceneFields(SphinxDirective):
    """``{scene-fields}`` makes a definition list of all keys."""

    def run(self) -> list[nodes.Node]:
        """
        Describe each key.

        Returns
        -------
        list of docutils.nodes.Node
            One definition list.
        """
        from chaincor.lammps_inputs.scene import Scene

        entries = nodes.definition_list()
        for name, field in Scene.model_fields.items():
            text = field.description or ""
            if field.default is not None and "[default" not in text:
                text += f" [default: {field.default}]"
            meaning = nodes.definition("", nodes.paragraph("", text))
            term = nodes.term("", "", nodes.literal("", name))
            entries += nodes.definition_list_item("", term, meaning)
        return [entries]


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("scene-fields", SceneFields)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
