"""Bonds in LAMMPS that get so long that they need the table for long ones."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bond_table import FAR_BACK, FAR_OUT

if TYPE_CHECKING:
    from chaincor.workflows.engines.lammps.instance import LammpsChain


class FarBonds:
    """Which bonds of a chain have the far table, and when one is due to change; at first none."""

    def __init__(self, chain: "LammpsChain") -> None:
        self._chain = chain
        #: Whether a bond has the far one; of shape (bonds,).
        self.far = np.zeros(len(chain.lengths()), dtype=bool)

    def steps_left(self) -> int:
        """Return how many Verlet steps no bond needs at least to be due for its other table."""
        lengths = self._chain.lengths()
        room = FAR_OUT - np.max(lengths, where=~self.far, initial=-np.inf)
        room = min(room, np.min(lengths, where=self.far, initial=np.inf) - FAR_BACK)
        fastest = float(np.max(np.abs(self._chain.between(self._chain.v))))
        # Half the room: bonds may speed up while they fall together. The step of the change is then
        # the same however steps are divided into runs.
        return max(1, int(0.5 * room / max(fastest * self._chain.timestep, 1e-9)))

    def change_tables(self) -> None:
        """Give bonds that got very long the far table, and those that came back the near one."""
        lengths = self._chain.lengths()
        self.give_tables(np.where(self.far, lengths > FAR_BACK, lengths > FAR_OUT))

    def give_tables(self, far: NDArray[np.bool_]) -> None:
        """Give bonds the far table, or the near one."""
        changed = np.flatnonzero(far != self.far)
        if len(changed) == 0:
            return
        lines = []
        for bond in changed.tolist():
            # The target's particles follow the chain's.
            first = bond + (1 if bond < self._chain.particles - 1 else 2)
            lines += [
                f"group ends id {first} {first + 1}",
                f"set group ends bond {2 if far[bond] else 1}",
                "group ends delete",
            ]
        # A set-up rebuilds the list of bonds with their types, and takes no step.
        self._chain.commands("\n".join([*lines, "run 0 post no"]))
        self.far = far
