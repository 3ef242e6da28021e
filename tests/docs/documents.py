"""Run the code of a Markdown document: Python, console and TOML blocks, in order, in one folder."""

import doctest
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

from sybil import Example, Sybil
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])

_CHECKER = doctest.OutputChecker()
_LOOSELY = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
_NAME = re.compile(r"# ([\w.-]+\.(?:py|toml))\n")


def run_document(path: Path, folder: Path) -> int:
    """
    Run every block of a document and return how many there were.

    Parameters
    ----------
    path : pathlib.Path
        The document. A Python or TOML block that begins with ``# name.ext`` is also written to
        that file. In a console block, lines that begin with ``$`` are commands for bash, which
        must succeed; what follows is their output, ``...`` standing for anything.
    folder : pathlib.Path
        An empty folder, in which everything happens.

    Returns
    -------
    int
        Number of blocks run.

    Raises
    ------
    AssertionError
        If a command fails or prints something else; errors of Python blocks pass through.
    """
    shell = _Shell(folder)
    sybil = Sybil(
        parsers=[
            PythonCodeBlockParser(),
            CodeBlockParser("console", shell.evaluate),
            CodeBlockParser("toml", lambda example: None),
        ]
    )
    before, path_before = Path.cwd(), list(sys.path)
    os.chdir(folder)
    sys.path.insert(0, str(folder))
    blocks = 0
    try:
        for example in sybil.parse(path).examples():
            _write_named_file(example, folder)
            example.evaluate()
            blocks += 1
    finally:
        os.chdir(before)
        sys.path[:] = path_before
    return blocks


def _write_named_file(example: Example, folder: Path) -> None:
    text = str(example.parsed)
    named = _NAME.match(text)
    if named:
        (folder / named[1]).write_text(text, encoding="utf-8")


class _Shell:
    """Runs console blocks as a user's terminal would, with this source tree installed."""

    def __init__(self, folder: Path) -> None:
        from chaincor.workflows.engines.lammps.library import find_mpi_library

        commands = folder / ".bin"
        commands.mkdir()
        chaincor = commands / "chaincor"
        program = "from chaincor.workflows.cli import main; main()"
        chaincor.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -c "{program}" "$@"\n')
        chaincor.chmod(0o755)
        self.environment = os.environ | {
            "PATH": os.pathsep.join(
                [str(commands), str(Path(sys.executable).parent), os.environ["PATH"]]
            ),
            "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
            "COLUMNS": "100",
        }
        mpi = find_mpi_library()
        if mpi is not None:
            self.environment["LD_LIBRARY_PATH"] = str(mpi.parent)

    def evaluate(self, example: Example) -> str | None:
        for command, wanted in _commands(example.parsed):
            done = subprocess.run(
                ["bash", "-c", command],
                env=self.environment,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                timeout=300,
            )
            said = f"$ {command}\n{done.stdout}"
            assert done.returncode == 0, f"exit status {done.returncode}:\n{said}"
            if wanted and not _CHECKER.check_output(wanted, done.stdout, _LOOSELY):
                return f"expected:\n{wanted}\ngot:\n{said}"
        return None


def _commands(text: str) -> list[tuple[str, str]]:
    """Split a console block into commands and their output; ``\\`` continues a command."""
    found: list[tuple[str, str]] = []
    for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        command = re.match(r"(?:.*\\\n)*.*", part)
        assert command is not None
        found.append((command[0], part[command.end() :].strip("\n")))
    return found
