"""A restart in the middle of a script: where it is written, and a script that begins with it."""

from dataclasses import dataclass
from pathlib import Path

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
