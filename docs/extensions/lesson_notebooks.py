"""Make each lesson a notebook while the site is built, and link it from the lesson's page."""

from pathlib import Path

from docutils import nodes
from sphinx.application import Sphinx

from chaincor.workflows.lessons.notebooks import lesson_pages, notebook

_FOLDER = "notebooks"
_KINDS = {"with solutions": ("", True), "to hand in": ("hand_in/", False)}


def _link(app: Sphinx, doctree: nodes.document) -> None:
    """Put links to both notebooks below the title of a lesson."""
    page = lesson_pages().get(Path(app.env.docname).name)
    if page is None or Path(app.env.doc2path(app.env.docname)).resolve() != page.resolve():
        return
    links = ", ".join(
        f'<a href="../{_FOLDER}/{folder}{page.stem}.ipynb" download>{name}</a>'
        for name, (folder, _) in _KINDS.items()
    )
    text = f'<p class="notebook">As a notebook: {links}</p>'
    title = next(iter(doctree.findall(nodes.title)))
    title.parent.insert(title.parent.index(title) + 1, nodes.raw("", text, format="html"))


def _write(app: Sphinx, exception: Exception | None) -> None:
    if exception is not None or app.builder.name != "html":
        return
    for folder, solutions in _KINDS.values():
        place = Path(app.outdir) / _FOLDER / folder
        place.mkdir(parents=True, exist_ok=True)
        for name, page in lesson_pages().items():
            text = notebook(page, solutions=solutions)
            (place / f"{name}.ipynb").write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Add links when a page is read, and write notebooks when the site is complete."""
    app.connect("doctree-read", _link)
    app.connect("build-finished", _write)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
