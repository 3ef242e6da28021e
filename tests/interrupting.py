"""Interrupt a Python session while it works, as a user would."""

import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.waiting import HANGS


def interrupted(folder: Path, program: str, seconds: float) -> str:
    """
    Run a program, send it Ctrl-C some time after its line BEGINS, and return what it prints then.

    Parameters
    ----------
    folder : pathlib.Path
        Where it runs, from a file: worker processes import it.
    program : str
        Python.
    seconds : float
        How long to wait: to somewhere inside, anywhere will do.

    Returns
    -------
    str
        Standard output after the line; what it complains about follows.
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
