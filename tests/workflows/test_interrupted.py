"""Test that Ctrl-C in a notebook gives a short message and breaks nothing."""

import pytest

from tests.interrupting import interrupted

# What a notebook does: a cell is interrupted, its traceback is shown, the next cell runs.
# A shell's background jobs ignore Ctrl-C, and so would what tests start there.
SESSION = """
import signal, traceback
signal.signal(signal.SIGINT, signal.default_int_handler)
from chaincor import Scene, collide

small = Scene(particles=5, tolerance=1e-4, engine="{engine}")
before = collide(small).restitution
print("BEGINS", flush=True)
try:
    collide(Scene(particles=30000, engine="{engine}"))
except KeyboardInterrupt as interrupt:
    frames = traceback.extract_tb(interrupt.__traceback__)
    print("FRAMES", len(frames), interrupt.__cause__, interrupt.__context__)
print("SAME", collide(small).restitution == before)
"""


@pytest.mark.slow_cases
@pytest.mark.parametrize("engine", ["lammps", "reference"])
@pytest.mark.slow
def test_the_session_goes_on(engine, tmp_path):
    found = interrupted(tmp_path, SESSION.format(engine=engine), 1.0)
    # The line of the session and that of collide(): a notebook takes seconds to show dozens.
    assert found == "FRAMES 2 None None\nSAME True\n"
