"""Add commands that write a restart file halfway through a script, or that start from this file."""

from dataclasses import dataclass
from pathlib import Path

# `read_restart` replaces the commands in _MAKE_BOX. The commands in _CHANGE_STATE are dropped,
# because the restart file already contains the state that they produce.
_MAKE_BOX = ("read_data", "create_box", "read_restart")
_CHANGE_STATE = (
    *("create_atoms", "replicate", "read_dump", "velocity", "displace_atoms", "set", "mass"),
    *("delete_atoms", "delete_bonds", "create_bonds", "change_box", "minimize", "balance"),
    *("reset_timestep", "reset_atoms", "reset_atom_ids", "reset_mol_ids", "displace_box"),
)


@dataclass(frozen=True)
class Halfway:
    """The middle of a script's last long run."""

    run: int  #: Number of the `run` in the order of execution, counted from 1.
    start: int  #: Step at which the run begins.
    step: int  #: Step at which the restart is written.
    end: int  #: Step at which the run ends.
    file: Path  #: Name of the restart file, without the dot and the step at its end.
    reads: bool = False  #: Whether the script reads the restart file instead of writing it.

    def replace_set_up(self, words: list[str]) -> list[str] | None:
        """Return the commands that replace one before the restart; None to keep the command."""
        name = words[0]
        if name in _MAKE_BOX:
            read = f"read_restart {self.file}.{self.step}"
            return [
                f'if "${{chaincor_first}} == 0" then "{read}" "variable chaincor_first string 1"'
            ]
        static_group = name == "group" and len(words) > 2 and words[2] not in ("dynamic", "static")
        return [] if name in _CHANGE_STATE or static_group else None

    def before(self) -> list[str]:
        """Return the commands that are added before each run and write the restart file."""
        once = f"ternary(step<{self.step},{self.step},{self.end * 1000})"
        return [
            f'if "${{chaincor_run}} == {self.run}" then '
            f'"variable chaincor_restart equal {once}" '
            f'"restart v_chaincor_restart {self.file}" else "restart 0"'
        ]
