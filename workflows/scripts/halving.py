"""Find the middle of a script's last long run."""

import re

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.restarting import Halfway
from chaincor.workflows.scripts.script_run import Runner
from chaincor.workflows.scripts.script_text import ScriptText

# A run is long enough for a restart halfway if it has at least this many steps.
_LEAST_STEPS = 20


def find_halfway(runner: Runner, script: ScriptText) -> Halfway:
    """
    Run a script without changes, and return the middle of its last long run.

    Raise InputError if the script has no long run or uses ``clear``.
    """
    for command in script.commands:
        if command.words[0] == "clear" or re.search(r"[\"']\s*clear\s*[\"']", command.text):
            raise InputError(
                f"{command} is 'clear', which makes a restart impossible. Remove it from the script"
            )
    run = runner.run("as it stands", Change())
    if run.failure:
        raise runner.error("as it stands", run.failure)
    for number, (start, steps) in reversed(list(enumerate(run.lengths, 1))):
        if steps >= _LEAST_STEPS:
            file = runner.scratch / "halfway"
            return Halfway(number, start, start + steps // 2, start + steps, file)
    raise InputError(
        f"no run of {script.path.name} has the {_LEAST_STEPS} steps that a "
        "restart halfway needs. Lengthen the run"
    )
