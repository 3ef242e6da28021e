"""Test that lessons become notebooks and run from a new kernel."""

import base64
import json
import os
import re
import sys

import nbformat
import pytest
from nbclient import NotebookClient

from chaincor.workflows.lessons.notebooks import lesson_pages, notebook
from tests.docs.documents import ROOT

PAGES = lesson_pages()
PAGE = """# A lesson

See [the next](2_tables.md) and [how to](../howto.md).

![What no code of the page draws.](../images/drawing.svg)

```console
$ chaincor run \\
    --where "speed<1"
one two
$ chaincor run --speed 0; echo "exit status $?"
...
$ cat job/in.chain
...
$ (cd job && lmp -in in.chain 2> /dev/null | grep -o "Bond.*missing")
Bond atoms 1 2 missing
$ (cd job && lmp -in in.chain | tail -8)
...
```

```toml
# sweep.toml
[axes]
```

```python
# mine.py
X = 1
```

```python
axes = result.plot.energy()
axes.figure.savefig("own.png")
```

![What the plot at 1 v* shows.](../images/own.png)

```python
figure.savefig("other.png")
```

![What another figure shows.](../images/other.png)

```text
left as it is
```

## Exercises

**1.** How much?

```python
check("1.1", ...)
```

<details>
<summary>Solution</summary>

So much.

```python
secret = 1
```

</details>

Next: more.
"""


def sources(text, kind="code"):
    return [
        cell.source for cell in nbformat.reads(text, as_version=4).cells if cell.cell_type == kind
    ]


@pytest.fixture
def page(tmp_path):
    path = tmp_path / "pages" / "1_lesson.md"
    path.parent.mkdir()
    path.write_text(PAGE)
    (tmp_path / "images").mkdir()
    (tmp_path / "images" / "drawing.svg").write_text("<svg/>")
    return path


def test_cells_of_a_page(page):
    assert sources(notebook(page)) == [
        'from chaincor.workflows.lessons import begin, show_figure\n\nbegin("1_lesson")',
        '!chaincor run --where "speed<1"',
        '!chaincor run --speed 0\nprint("exit status", _exit_code)',
        'print(open("job/in.chain").read())',
        'printed = !cd job && lmp -in in.chain\nprint(*printed.grep("Bond.*missing"), sep="\\n")',
        'printed = !cd job && lmp -in in.chain\nprint(*printed[-8:], sep="\\n")',
        "%%writefile sweep.toml\n# sweep.toml\n[axes]",
        "%%writefile mine.py\n# mine.py\nX = 1",
        'axes = result.plot.energy()\naxes.figure.savefig("own.png")\n\nshow_figure("own.png")',
        'figure.savefig("other.png")\n\nshow_figure("other.png")',
        'check("1.1", ...)',
        "secret = 1",
    ]
    prose = "\n".join(sources(notebook(page), "markdown"))
    assert prose.startswith("# A lesson")
    assert "See [the next](2_tables.ipynb) and how to." in prose
    assert r"*What the plot at 1 v\* shows.*" in prose
    assert "```text\nleft as it is\n```" in prose
    assert "<details>" not in prose
    assert "**Solution.**\n\nSo much." in prose


@pytest.mark.parametrize(
    "command", ["sed -i s/1/2/ a", "for k in 1 2; do lmp; done", "chaincor run | cat", "a 'b c'"]
)
def test_what_windows_cannot_do_is_in_no_lesson(page, command):
    page.write_text(f"# A lesson\n\n```console\n$ {command}\n```\n")
    with pytest.raises(ValueError, match="needs a shell"):
        notebook(page)


def test_a_picture_that_no_code_draws_is_in_the_notebook(page):
    cells = nbformat.reads(notebook(page), as_version=4).cells
    # JupyterLab shows an SVG picture from its address, but not an attached one.
    (data,) = re.findall(
        r"!\[What no code of the page draws.\]\(data:image/svg\+xml;base64,(.*)\)",
        "\n".join(cell.source for cell in cells),
    )
    assert base64.b64decode(data) == b"<svg/>"


def test_hand_in_has_the_question_and_not_the_solution(page):
    text = notebook(page, solutions=False)
    assert "How much?" in text
    assert "Next: more." in text
    assert sources(text)[-1] == 'check("1.1", ...)'
    # The text must not describe the picture, because an exercise may ask for its content.
    for gone in ("Solution", "So much", "secret", "details", "What the plot at 1 v", "another"):
        assert gone not in text


def test_the_same_page_gives_the_same_file(page):
    assert notebook(page) == notebook(page)
    nbformat.validate(nbformat.reads(notebook(page), as_version=4))


@pytest.mark.parametrize("name", PAGES)
def test_a_lesson_hides_all_of_its_solutions(name):
    page = PAGES[name].read_text()
    assert page.count("<summary>Solution</summary>") == page.count("</details>") > 0
    text = notebook(PAGES[name], solutions=False)
    for mark in ("Solution", "details>", "../images", "assert check"):
        assert mark not in text


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_a_lesson_runs_from_a_clean_kernel(name, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    # The path is that of a Jupyter that was started without activating the environment.
    monkeypatch.setenv("PATH", os.defpath)
    # First the cells of the notebook without solutions run; then the solutions run in order.
    book = nbformat.reads(notebook(PAGES[name], solutions=False), as_version=4)
    asked = [cell.source for cell in book.cells if cell.cell_type == "code"]
    for cell in nbformat.reads(notebook(PAGES[name]), as_version=4).cells:
        if cell.cell_type == "code":
            if asked and cell.source == asked[0]:
                asked.pop(0)
            else:
                cell["id"] = f"solution-{len(book.cells)}"
                book.cells.append(cell)
    assert not asked
    for cell in book.cells:
        if cell.source.startswith("!") and "_exit_code" not in cell.source:
            cell.source += "\nassert _exit_code == 0"
    assert book.cells[-1].id.startswith("solution")
    NotebookClient(book, timeout=1200, resources={"metadata": {"path": str(tmp_path)}}).execute()
    assert (tmp_path / f"{name}_files").is_dir()
    for cell in book.cells:
        if re.match("print|!", cell.source):
            assert "".join(output.text for output in cell.outputs).strip(), cell.source
    shown = [str(output) for cell in book.cells for output in cell.get("outputs", [])]
    assert sum("image/png" in text for text in shown) >= 1
    # Each picture with an alternative text is shown once, with this text.
    texts = [
        output.metadata["image/png"]["alt"]
        for cell in book.cells
        for output in cell.get("outputs", [])
        if "alt" in output.get("metadata", {}).get("image/png", {})
    ]
    page = PAGES[name].read_text()
    words = dict(re.findall(r"^!\[([^\]]*)\]\(\.\./images/([\w.-]+)\)", page, re.MULTILINE))
    code = "".join(re.findall(r"^```\w+\n(.*?)^```", page, re.MULTILINE | re.DOTALL))
    drawn = {text for text, picture in words.items() if picture in code}
    assert drawn
    assert drawn <= set(texts)
    assert all(texts)


def test_lessons_are_written_and_nothing_is_overwritten(tmp_path, chaincor):
    folder = tmp_path / "lessons"
    status, out, _ = chaincor("lessons", "-o", str(folder))
    assert status == 0
    assert sorted(folder.iterdir()) == sorted(folder / f"{name}.ipynb" for name in PAGES)
    assert len(PAGES) == 9
    assert len(out.split()) == 9
    kernel = json.loads((folder / "4_modes.ipynb").read_text())["metadata"]["kernelspec"]
    assert kernel["name"] == "python3"
    (folder / "4_modes.ipynb").write_text("mine")
    status, _, err = chaincor("lessons", "-o", str(folder))
    assert status == 2
    assert "exists already. Give a new folder, or replace the file with --force" in " ".join(
        err.split()
    )
    assert (folder / "4_modes.ipynb").read_text() == "mine"
    assert chaincor("lessons", "-o", str(folder), "--solutions", "--force")[0] == 0
    assert "Solution" in (folder / "4_modes.ipynb").read_text()


def test_without_jupytext_it_says_what_to_install(tmp_path, chaincor, monkeypatch):
    monkeypatch.setitem(sys.modules, "jupytext", None)
    status, _, err = chaincor("lessons", "-o", str(tmp_path / "lessons"))
    assert status == 1
    assert "pip install chaincor[notebook]" in " ".join(err.split())
    assert not (tmp_path / "lessons").exists()
