"""A restart in the middle of a script: where it is written, and a script that begins with it."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.script_text import ScriptText

if TYPE_CHECKING:
    from chaincor.workflows.scripts.script_run import Runner

# Halves of shorter runs show nothing.
_LEAST_STEPS = 20
# Commands that make the box, in whose place the restart is read; and others that change a state,
# which the restart holds.
_MAKE_BOX = ("read_data", "create_box", "read_restart")
_CHANGE_STATE = (
    *("create_atoms", "replicate", "read_dump", "velocity", "displace_atoms", "set", "mass"),
    *("delete_atoms", "delete_bonds", "create_bonds", "change_box", "minimize", "balance"),
    *("reset_timestep", "reset_atoms", "reset_atom_ids", "reset_mol_ids", "displace_box"),
)


@dataclass(frozen=True)
class Halfway:
    """The middle of a script's last long run."""

    run: int  #: Which `run` of the script that is, from 1, as they are carried out.
    start: int  #: The step at which that run begins.
    step: int  #: The step at which the restart is written.
    end: int  #: The step at which that run ends.
    file: Path  #: The restart is this file, with the step behind a dot.
    reads: bool = False  #: Whether a script reads the restart instead of writing it.

    def replace_set_up(self, words: list[str]) -> list[str] | None:
        """Return what stands in a command's place where the restart is read; None: nothing else."""
        name = words[0]
        if name in _MAKE_BOX:
            read = f"read_restart {self.file}.{self.step}"
            return [
                f'if "${{chaincor_first}} == 0" then "{read}" "variable chaincor_first string 1"'
            ]
        static_group = name == "group" and len(words) > 2 and words[2] not in ("dynamic", "static")
        return [] if name in _CHANGE_STATE or static_group else None

    def before(self) -> list[str]:
        """Return commands before each run, where the restart is written."""
        once = f"ternary(step<{self.step},{self.step},{self.end * 1000})"
        return [
            f'if "${{chaincor_run}} == {self.run}" then '
            f'"variable chaincor_restart equal {once}" '
            f'"restart v_chaincor_restart {self.file}" else "restart 0"'
        ]


def find_halfway(runner: "Runner", script: ScriptText) -> Halfway:
    """
    Run a script as it stands, and return the middle of its last long run.

    Raises InputError where it has none, or empties its memory by ``clear``.
    """
    from chaincor.workflows.scripts.change import Change

    for command in script.commands:
        if command.words[0] == "clear" or re.search(r"[\"']\s*clear\s*[\"']", command.text):
            raise InputError(
                f"{command} is 'clear', after which a restart begins anew; expected a script "
                "without it"
            )
    run = runner.run("as it stands", Change())
    if run.failure:
        raise runner.error("as it stands", run.failure)
    for number, (start, steps) in reversed(list(enumerate(run.lengths, 1))):
        if steps >= _LEAST_STEPS:
            file = runner.scratch / "halfway"
            return Halfway(number, start, start + steps // 2, start + steps, file)
    raise InputError(
        f"no run of {script.path.name} has {_LEAST_STEPS} steps; expected a longer one, to write a "
        "restart in its middle"
    )
