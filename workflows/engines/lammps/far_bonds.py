"""Assign the table for long bonds to bonds in LAMMPS that become very long."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bond_table import FAR_BACK, FAR_OUT

if TYPE_CHECKING:
    from chaincor.workflows.engines.lammps.instance import LammpsChain


class FarBonds:
    """Assignment of tables to bonds; at first every bond has the near table."""

    def __init__(self, chain: "LammpsChain") -> None:
        self._chain = chain
        #: Whether a bond has the far table; of shape (bonds,).
        self.far = np.zeros(len(chain.lengths()), dtype=bool)

    def steps_left(self) -> int:
        """Return a number of Verlet steps during which no bond can need another table."""
        lengths = self._chain.lengths()
        room = FAR_OUT - np.max(lengths, where=~self.far, initial=-np.inf)
        room = min(room, np.min(lengths, where=self.far, initial=np.inf) - FAR_BACK)
        fastest = float(np.max(np.abs(self._chain.between(self._chain.v))))
        # Only half the distance to the end of the table is used, because bonds may speed up while
        # they contract. The step at which a table changes then does not depend on the division of
        # steps into runs.
        return max(1, int(0.5 * room / max(fastest * self._chain.timestep, 1e-9)))

    def change_tables(self) -> None:
        """Set the far table for very long bonds, and the near table for bonds that came back."""
        lengths = self._chain.lengths()
        self.give_tables(np.where(self.far, lengths > FAR_BACK, lengths > FAR_OUT))

    def give_tables(self, far: NDArray[np.bool_]) -> None:
        """Set the far or the near table for each bond."""
        changed = np.flatnonzero(far != self.far)
        if len(changed) == 0:
            return
        lines = []
        for bond in changed.tolist():
            # Particles of the target follow those of the chain.
            first = bond + (1 if bond < self._chain.particles - 1 else 2)
            lines += [
                f"group ends id {first} {first + 1}",
                f"set group ends bond {2 if far[bond] else 1}",
                "group ends delete",
            ]
        # A run of no steps rebuilds the list of bonds with their types.
        self._chain.commands("\n".join([*lines, "run 0 post no"]))
        self.far = far
