"""Test that Ctrl-C in a notebook gives a short message and breaks nothing."""

import pytest

from tests.interrupting import interrupted

# The session imitates a notebook: a cell is interrupted, its traceback is shown, and the next cell
# runs. Background jobs of a shell ignore Ctrl-C, and processes that tests start there would, too.
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
    # The traceback has only the lines of the session and of collide(), because a notebook takes
    # seconds to show dozens of frames.
    assert found == "FRAMES 2 None None\nSAME True\n"
