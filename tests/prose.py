"""
Check the prose that people read: docstrings, comments, messages and pages.

    python -m tests.prose [PATH ...]

ruff checks the form of docstrings; this module checks sentences. A sentence may not begin with a
noun clause or with a pronoun that needs an earlier noun, private words may not occur, and a
sentence of a page has at most 60 words. Prints one line for each finding; exit status 1 if there is
one.
"""

import ast
import io
import re
import sys
import tokenize
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("analysis", "benchmarks", "chaincor", "docs", "lammps_inputs", "workflows")
PAGES = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "paper.md")
# Texts of other authors or of an earlier release are not changed.
LEFT_OUT = ("docs/history",)
MOST_WORDS = 60

# A question may begin with any word.
_BEGINS_BADLY = re.compile(
    r"(?:What|Where|Of|Those|That of|None of|None)\b(?!.*\?$)(?! (?:course|type|kind)\b)", re.DOTALL
)
_PRIVATE = re.compile(r"\btold\b", re.IGNORECASE)
# Git marks the two sides of a conflict by such lines.
_CONFLICT = re.compile(r"[<>]{7} ")
_SENTENCE = re.compile(r"(?<=[.!?])\s+(?=[A-Z`\"'(*\[])")


def sentences(text: str) -> list[str]:
    """Return the sentences of a text, white space folded."""
    return [" ".join(part.split()) for part in _SENTENCE.split(text.strip()) if part.strip()]


def findings(text: str, most_words: int | None = None) -> Iterator[str]:
    """Yield the faults of a text, sentence by sentence."""
    for sentence in sentences(text):
        begin = sentence.lstrip("*_`\"'([")
        # Headings, titles and cells of tables have no full stop, and may be noun phrases.
        if _BEGINS_BADLY.match(begin) and sentence.rstrip("*_`\"')").endswith((".", ":", ";")):
            yield f"begins with {begin.split()[0]!r}: {sentence[:70]}"
        if _PRIVATE.search(sentence):
            yield f"says 'told': {sentence[:70]}"
        if most_words is not None and len(sentence.split()) > most_words:
            yield f"{len(sentence.split())} words: {sentence[:70]}"


def texts_of_python(source: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the text of each docstring, message and block of comments."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value:
            for paragraph in re.split(r"\n\s*\n", node.value):
                yield node.lineno, paragraph
        elif isinstance(node, ast.JoinedStr):
            parts = [v.value if isinstance(v, ast.Constant) else "0" for v in node.values]
            yield node.lineno, "".join(str(part) for part in parts)
    yield from _comments(source)


def _comments(source: str) -> Iterator[tuple[int, str]]:
    lines: list[str] = []
    first = last = 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type != tokenize.COMMENT:
            continue
        if lines and token.start[0] != last + 1:
            yield first, " ".join(lines)
            lines = []
        if not lines:
            first = token.start[0]
        lines.append(token.string.lstrip("#: "))
        last = token.start[0]
    if lines:
        yield first, " ".join(lines)


def texts_of_page(source: str) -> Iterator[tuple[int, str]]:
    """Yield the line and the text of each paragraph, item and cell of a page; code is left out."""
    source = re.sub(r"^```.*?^```", _blank, source, flags=re.MULTILINE | re.DOTALL)
    source = re.sub(r"<!--.*?-->|\$\$.*?\$\$", _blank, source, flags=re.DOTALL)
    paragraph: list[str] = []
    first = 0
    for number, line in enumerate([*source.splitlines(), ""], 1):
        starts = re.match(r"\s*(?:[-*] |\d+\. |\||#|>|!\[)", line)
        if (not line.strip() or starts) and paragraph:
            yield first, " ".join(paragraph)
            paragraph = []
        if not line.strip() or line.startswith("    "):
            continue
        if line.lstrip().startswith("|"):
            yield from ((number, cell.strip()) for cell in line.strip().strip("|").split("|"))
        elif line.startswith("#"):
            yield number, line.lstrip("# ")
        else:
            if not paragraph:
                first = number
            paragraph.append(re.sub(r"^\s*(?:[-*] |\d+\. |> )", "", line).strip())


def _blank(match: re.Match[str]) -> str:
    return "\n" * match[0].count("\n")


def check(path: Path) -> list[str]:
    """Return the findings in one file, each with its line."""
    source = path.read_text(encoding="utf-8")
    python = path.suffix == ".py"
    texts: Iterable[tuple[int, str]] = (texts_of_python if python else texts_of_page)(source)
    most = None if python else MOST_WORDS
    found = [(line, each) for line, text in texts for each in findings(text, most)]
    for number, line in enumerate(source.splitlines(), 1):
        if _CONFLICT.match(line):
            found.append((number, f"is left from a merge: {line[:70]}"))
    return [f"{path}:{line}: {each}" for line, each in found]


def files() -> list[Path]:
    """Return the files whose prose is checked."""
    found = [ROOT / page for page in PAGES]
    for folder in FOLDERS:
        for pattern in ("*.py", "*.md"):
            found += sorted((ROOT / folder).rglob(pattern))
    kept = (path for path in found if not str(path.relative_to(ROOT)).startswith(LEFT_OUT))
    return [path for path in kept if not path.parent.is_symlink()]


def main(arguments: list[str]) -> int:
    """Check the named files, or all files."""
    found = [line for path in map(Path, arguments) for line in check(path)]
    if not arguments:
        found = [line for path in files() for line in check(path)]
    print("\n".join(found) or "No finding.")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
