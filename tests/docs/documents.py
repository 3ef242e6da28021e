"""Run the Python, console and TOML blocks of a Markdown document, in order, in one folder."""

import os
import re
import shlex
import signal
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from sybil import Example, Sybil
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser

from chaincor.workflows.engines.lammps.library import lmp_environment
from tests.docs.printed_output import agrees

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])

# A program whose output is no terminal prints this each minute. On a busy machine, any program may
# take more than a minute.
_STILL_RUNNING = re.compile(r"^chaincor: .* after [\d.e+]+ (?:s|min|h)\n", re.MULTILINE)
_NAME = re.compile(r"# ([\w.-]+\.(?:py|toml))\n")


def run_document(path: Path, folder: Path) -> int:
    """
    Run every block of a document and return the number of blocks.

    Parameters
    ----------
    path : pathlib.Path
        The document. A Python or TOML block that begins with ``# name.ext`` is also written to that
        file. In a console block, lines that begin with ``$`` are commands. All commands of the
        document run in one shell, and each must succeed. The output on the page follows the
        command. It is compared by :func:`tests.docs.printed_output.agrees`, which compares numbers
        within their error bars.
    folder : pathlib.Path
        Folder in which the blocks run.

    Returns
    -------
    int
        Number of blocks run.

    Raises
    ------
    AssertionError
        If a command fails or prints other output. Errors of Python blocks are not caught.
    """
    before, path_before = Path.cwd(), list(sys.path)
    os.chdir(folder)
    sys.path.insert(0, str(folder))
    blocks = 0
    try:
        with _Shell(folder) as shell:
            sybil = Sybil(
                parsers=[
                    PythonCodeBlockParser(),
                    CodeBlockParser("console", shell.evaluate),
                    CodeBlockParser("toml", lambda example: None),
                ]
            )
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
    """A shell for all commands of a document, with this source tree installed."""

    def __init__(self, folder: Path) -> None:
        # The file is closed at exit.
        self._typed = tempfile.NamedTemporaryFile("w", suffix=".sh")  # noqa: SIM115
        self._commands = tempfile.TemporaryDirectory()
        self._bash = subprocess.Popen(
            ["bash"],
            cwd=folder,
            env=_environment(Path(self._commands.name)),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )

    def __enter__(self) -> "_Shell":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()
        self._bash.communicate()
        self._typed.close()
        self._commands.cleanup()

    def _end(self) -> None:
        if self._bash.poll() is None:
            os.killpg(self._bash.pid, signal.SIGKILL)

    def evaluate(self, example: Example) -> str | None:
        for command, wanted in _commands(example.parsed):
            status, printed = self._type(command)
            printed = _STILL_RUNNING.sub("", printed)
            said = f"$ {command}\n{printed}"
            assert status == 0, f"exit status {status}:\n{said}"
            if wanted and not agrees(wanted, printed):
                return f"expected:\n{wanted}\ngot:\n{said}"
        return None

    def _type(self, command: str) -> tuple[int, str]:
        """Run a command for at most half an hour; return its exit status and output."""
        self._typed.seek(0)
        self._typed.truncate()
        self._typed.write(command + "\n")
        self._typed.flush()
        assert self._bash.stdin is not None
        assert self._bash.stdout is not None
        mark = "the exit status was"
        self._bash.stdin.write(
            f". {self._typed.name} < /dev/null; status=$?; echo; echo {mark} $status\n"
        )
        self._bash.stdin.flush()
        guard = threading.Timer(1800, self._end)
        guard.start()
        try:
            printed = ""
            for line in self._bash.stdout:
                if line.startswith(mark):
                    return int(line.removeprefix(mark)), printed.removesuffix("\n")
                printed += line
        finally:
            guard.cancel()
        raise AssertionError(f"the shell ended:\n$ {command}\n{printed}")


def _environment(commands: Path) -> dict[str, str]:
    """Return the environment variables of a user who has installed this source tree."""
    chaincor = commands / "chaincor"
    program = "from chaincor.workflows.cli import main; main()"
    chaincor.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -c "{program}" "$@"\n')
    chaincor.chmod(0o755)
    return lmp_environment() | {
        "PATH": os.pathsep.join(
            [str(commands), str(Path(sys.executable).parent), os.environ["PATH"]]
        ),
        "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
        "COLUMNS": "100",
    }


def _commands(text: str) -> list[tuple[str, str]]:
    """Split a console block into commands and their output; ``\\`` continues a command."""
    found: list[tuple[str, str]] = []
    for part in re.split(r"^\$ ", text, flags=re.MULTILINE)[1:]:
        command = re.match(r"(?:.*\\\n)*.*", part)
        assert command is not None
        found.append((command[0], part[command.end() :].strip("\n")))
    return found
