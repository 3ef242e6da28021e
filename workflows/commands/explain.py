"""Implement ``chaincor explain``: explain printed words and errors."""

import re

import click

from chaincor.lammps_inputs.errors import meant
from chaincor.workflows.documents import DOCUMENTS
from chaincor.workflows.showing.terms import ALL_TERMS, OTHER_NAMES

_SECTION = re.compile(r"^### (\w+)\n(.*?)(?=^##|\Z)", re.MULTILINE | re.DOTALL)

# This pattern matches a row in the table of words that stopped jobs print. The row has three cells:
# word, cause and remedy.
_ROW = re.compile(r"^\| (`[A-Z ]+`.*?) \| (.*?) \| (.*?) \|$", re.MULTILINE)
_NAME = re.compile(r"`([A-Z ]+)`")


@click.command()
@click.argument("words", metavar="[WORD]...", nargs=-1)
def explain(words: tuple[str, ...]) -> None:
    """
    Explain an error or a word in the results, and what to do about it.

    Without a word, the command explains all words in the results, and lists the names of the
    errors.
    """
    page = (DOCUMENTS / "errors.md").read_text(encoding="utf-8")
    errors = dict(_SECTION.findall(page))
    for said, cause, remedy in _ROW.findall(page):
        errors |= dict.fromkeys(_NAME.findall(said), f"{cause}\n{remedy}")
    if not words:
        for name, text in ALL_TERMS.items():
            _paragraph(f"{name}: {text}.")
        _paragraph(f"names of errors, which `chaincor explain NAME` explains: {', '.join(errors)}")
        return
    word = " ".join(words)
    names = {**{name: name for name in (*ALL_TERMS, *errors)}, **OTHER_NAMES}
    near = meant(word, names)
    if near is None:
        raise click.UsageError(
            f"'{word}' is not explained. Use one of {', '.join((*ALL_TERMS, *errors))}"
        )
    name = names[near]
    if name in ALL_TERMS:
        _paragraph(f"{name}: {ALL_TERMS[name]}.")
        return
    click.echo(name)
    for paragraph in _plain(errors[name]).strip().splitlines():
        if paragraph:
            click.echo("")
            _paragraph(paragraph)


def _paragraph(text: str) -> None:
    click.echo(click.wrap_text(text, width=88, subsequent_indent="  "))


def _plain(text: str) -> str:
    """Remove the markup of Markdown."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    return text.replace("**", "").replace("`", "")
