"""Write a restart halfway through a script, and make a script begin with it."""

from dataclasses import dataclass
from pathlib import Path

# `read_restart` replaces the first commands, which make the box. The other commands are dropped,
# because they change a state that the restart file contains.
_MAKE_BOX = ("read_data", "create_box", "read_restart")
_CHANGE_STATE = (
    *("create_atoms", "replicate", "read_dump", "velocity", "displace_atoms", "set", "mass"),
    *("delete_atoms", "delete_bonds", "create_bonds", "change_box", "minimize", "balance"),
    *("reset_timestep", "reset_atoms", "reset_atom_ids", "reset_mol_ids", "displace_box"),
)


@dataclass(frozen=True)
class Halfway:
    """The middle of a script's last long run."""

    run: int  #: Number of the `run`, from 1, in the order of execution.
    start: int  #: Step at which the run begins.
    step: int  #: Step at which the restart is written.
    end: int  #: Step at which the run ends.
    file: Path  #: Name of the restart file, without the dot and the step at its end.
    reads: bool = False  #: Whether a script reads the restart instead of writing it.

    def replace_set_up(self, words: list[str]) -> list[str] | None:
        """Return the replacement of a command that precedes the restart, or None to keep it."""
        name = words[0]
        if name in _MAKE_BOX:
            read = f"read_restart {self.file}.{self.step}"
            return [
                f'if "${{chaincor_first}} == 0" then "{read}" "variable chaincor_first string 1"'
            ]
        static_group = name == "group" and len(words) > 2 and words[2] not in ("dynamic", "static")
        return [] if name in _CHANGE_STATE or static_group else None

    def before(self) -> list[str]:
        """Return the commands that precede each run and write the restart."""
        once = f"ternary(step<{self.step},{self.step},{self.end * 1000})"
        return [
            f'if "${{chaincor_run}} == {self.run}" then '
            f'"variable chaincor_restart equal {once}" '
            f'"restart v_chaincor_restart {self.file}" else "restart 0"'
        ]
