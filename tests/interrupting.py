"""Interrupt a Python session while it works, as a user would."""

import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.waiting import HANGS


def interrupted(folder: Path, program: str, seconds: float) -> str:
    """
    Run a program, send it Ctrl-C after its line BEGINS, and return its further output.

    Parameters
    ----------
    folder : pathlib.Path
        Folder of the program's file, which worker processes import.
    program : str
        Python source.
    seconds : float
        Time from the line BEGINS to Ctrl-C; any time within the work serves.

    Returns
    -------
    str
        Standard output after the line, followed by standard error.
    """
    (folder / "session.py").write_text(program)
    session = subprocess.Popen(
        [sys.executable, "session.py"],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert session.stdout is not None
    assert session.stdout.readline() == "BEGINS\n", session.stderr.read()
    time.sleep(seconds)
    session.send_signal(signal.SIGINT)
    out, err = session.communicate(timeout=HANGS)
    return out + err
