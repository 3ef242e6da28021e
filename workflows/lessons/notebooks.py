"""Make Jupyter notebooks from the lessons' pages, with or without solutions."""

import base64
import mimetypes
import re
from collections.abc import Iterator
from pathlib import Path

from chaincor.workflows.documents import DOCUMENTS
from chaincor.workflows.errors import MissingLibraryError

# A page is split at its code blocks, solutions and pictures. The text between them becomes prose
# cells.
_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```\n", re.MULTILINE | re.DOTALL)
_SOLUTION = re.compile(
    r"^<details>\n<summary>Solution</summary>\n(.*?)^</details>\n", re.MULTILINE | re.DOTALL
)
_PICTURE = re.compile(r"^!\[([^\]]*)\]\(\.\./images/([\w.-]+)\)\n", re.MULTILINE)
_COMMAND = re.compile(r"^\$ ((?:.*\\\n)*.*)", re.MULTILINE)
# Shells on Windows lack these commands. Cells run Python code instead.
_CAT = re.compile(r"cat (\S+)")
_STATUS = re.compile(r"(.*); echo \"exit status \$\?\"")
_PART_OF_OUTPUT = re.compile(r"\((cd \S+ && .*?)(?: 2> /dev/null)? \| (grep|tail) -?(?:o )?(.*)\)")
# Outside of quotes, these characters have a special meaning. A command with one of them needs a
# shell.
_OF_A_SHELL = re.compile(r"[|;&<>$`()*']")
_FILE = re.compile(r"# ([\w.-]+\.(?:py|toml))\n")
_LINK = re.compile(r"\[([^\]]*)\]\((?!http)([^)]*)\)")

# The metadata does not contain the version of Python, which differs between readers.
_METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python", "file_extension": ".py", "mimetype": "text/x-python"},
}


def lesson_pages() -> dict[str, Path]:
    """Return the pages that become notebooks: eight lessons, then the page for a class."""
    found = [*(DOCUMENTS / "tutorials").glob("*.md"), DOCUMENTS / "course" / "class.md"]
    return {path.stem: path for path in sorted(found, key=lambda path: path.stem)}


def words_of_picture(lesson: str, name: str) -> str:
    """Return the alternative text of a picture in a lesson's page; empty if there is none."""
    page = lesson_pages().get(lesson)
    found = _PICTURE.findall(page.read_text(encoding="utf-8")) if page else []
    return next((words for words, picture in found if picture == name), "")


def notebook(page: Path, *, solutions: bool = True) -> str:
    """
    Convert a lesson's page to a notebook; equal pages give equal texts.

    A block of Python code becomes a cell. Each command in a console block becomes a cell that runs
    the command, also on Windows. The output in the page is omitted. If a block begins with the name
    of a file, it becomes a cell that writes the file.

    If a cell saves a picture, it also shows the picture with the alternative text from the page.
    Only a notebook with solutions prints this text below the picture, because the text may reveal
    an answer. Other pictures are embedded. Solutions are in ``<details>`` with the summary
    *Solution*. A notebook without solutions is meant for handing in. Raise MissingLibraryError if
    jupytext is missing.
    """
    try:
        import jupytext
    except ImportError:
        raise MissingLibraryError(
            "notebooks need jupytext, which is not installed. Install it: pip install "
            "chaincor[notebook]"
        ) from None
    text = page.read_text(encoding="utf-8")
    text = _SOLUTION.sub(r"**Solution.**\n\1" if solutions else "", text)
    title, _, rest = text.partition("\n")
    parts = [title, _cell(_BEGIN.format(page.stem)), *_parts(rest, solutions, page)]
    made = jupytext.reads("\n\n".join(part for part in parts if part), fmt="md")
    made.metadata = _METADATA
    for number, cell in enumerate(made.cells):
        cell["id"] = f"cell-{number}"
    return str(jupytext.writes(made, fmt="ipynb"))


_BEGIN = """from chaincor.workflows.lessons import begin, show_figure

begin("{}")"""
# This code shows the picture that a cell saved, with its alternative text.
_SHOW = '\n\nshow_figure("{}")'
_SAVED = re.compile(r'savefig\("([\w.-]+)"')


def _parts(text: str, captions: bool, page: Path) -> Iterator[str]:
    """Yield the prose cells and code cells of a page, in order."""
    place = 0
    drawn = "".join(code for _, code in _BLOCK.findall(text))
    for found in re.finditer(f"{_BLOCK.pattern}|{_PICTURE.pattern}", text, _BLOCK.flags):
        yield _without_links(text[place : found.start()])
        kind, code, words, picture = found.groups()
        if picture is None:
            yield from _cells(kind, code, found[0])
        elif picture not in drawn:
            yield f"![{words}]({_data(page, picture)})"
        else:
            # A shell command wrote this picture, and no Python cell has shown it yet.
            if f'savefig("{picture}"' not in drawn:
                yield _cell(_SHOW.format(picture).strip())
            if captions:
                yield "*{}*".format(words.replace("*", r"\*"))
        place = found.end()
    yield _without_links(text[place:])


def _cells(kind: str, code: str, whole: str) -> Iterator[str]:
    named = _FILE.match(code)
    if kind == "console":
        for command in _COMMAND.findall(code):
            yield _cell(_portable(command))
    elif named and kind in ("python", "toml"):
        yield _cell(f"%%writefile {named[1]}\n{code}")
    elif kind == "python":
        saved = _SAVED.search(code)
        yield _cell(code.rstrip() + (_SHOW.format(saved[1]) if saved else ""))
    else:
        yield whole


def _portable(command: str) -> str:
    """
    Convert a command on a page to a form that IPython can run without bash.

    Raise ValueError if the command needs a feature of a shell that IPython and Python lack.
    """
    line = re.sub(r"\s*\\\n\s*", " ", command)
    if found := _CAT.fullmatch(line):
        return f'print(open("{found[1]}").read())'
    if found := _PART_OF_OUTPUT.fullmatch(line):
        run, tool, which = found.groups()
        part = f"printed[-{which}:]" if tool == "tail" else f"printed.grep({which})"
        return f'printed = !{run}\nprint(*{part}, sep="\\n")'
    status = _STATUS.fullmatch(line)
    alone = status[1] if status else line
    if not alone.startswith("chaincor ") or _OF_A_SHELL.search(re.sub(r'"[^"]*"', "", alone)):
        raise ValueError(f"{command!r} needs a shell. Use a command that Windows can run, too")
    return f"!{alone}" + ('\nprint("exit status", _exit_code)' if status else "")


def _cell(code: str) -> str:
    return f"```python\n{code.rstrip()}\n```"


def _data(page: Path, name: str) -> str:
    """Return a picture as a data URI, because JupyterLab does not show attached SVG files."""
    kind, _ = mimetypes.guess_type(name)
    data = (page.parent / ".." / "images" / name).read_bytes()
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


def _without_links(text: str) -> str:
    """Replace links to lessons by links to notebooks, and other links by plain text."""

    def link(found: re.Match[str]) -> str:
        words, target = found.groups()
        lesson = re.fullmatch(r"(?:\.\./tutorials/)?(\d_\w+)\.md", target)
        return f"[{words}]({lesson[1]}.ipynb)" if lesson else words

    return _LINK.sub(link, text).strip()
