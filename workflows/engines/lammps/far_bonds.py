"""Assign the far table, which covers very long bonds, to bonds in LAMMPS."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bond_table import FAR_BACK, FAR_OUT

if TYPE_CHECKING:
    from chaincor.workflows.engines.lammps.instance import LammpsChain


class FarBonds:
    """Assignment of the near or far table to each bond; at first every bond has the near table."""

    def __init__(self, chain: "LammpsChain") -> None:
        self._chain = chain
        #: Whether each bond has the far table; of shape (bonds,).
        self.far = np.zeros(len(chain.lengths()), dtype=bool)

    def steps_left(self) -> int:
        """Return the number of Verlet steps until the tables must be checked again."""
        lengths = self._chain.lengths()
        room = FAR_OUT - np.max(lengths, where=~self.far, initial=-np.inf)
        room = min(room, np.min(lengths, where=self.far, initial=np.inf) - FAR_BACK)
        fastest = float(np.max(np.abs(self._chain.between(self._chain.v))))
        # The steps take the fastest bond only half the way to the next change of its table, because
        # bonds may accelerate while they contract. With this reserve, the step at which a table
        # changes does not depend on how steps are grouped into runs.
        return max(1, int(0.5 * room / max(fastest * self._chain.timestep, 1e-9)))

    def change_tables(self) -> None:
        """Give very long bonds the far table, and bonds that became short again the near table."""
        lengths = self._chain.lengths()
        self.give_tables(np.where(self.far, lengths > FAR_BACK, lengths > FAR_OUT))

    def give_tables(self, far: NDArray[np.bool_]) -> None:
        """Give the bonds in `far` the far table and all other bonds the near table."""
        changed = np.flatnonzero(far != self.far)
        if len(changed) == 0:
            return
        lines = []
        for bond in changed.tolist():
            # The ids of the target's particles follow the ids of the chain's particles, and no bond
            # joins the two bodies.
            first = bond + (1 if bond < self._chain.particles - 1 else 2)
            lines += [
                f"group ends id {first} {first + 1}",
                f"set group ends bond {2 if far[bond] else 1}",
                "group ends delete",
            ]
        # In a run of zero steps, LAMMPS rebuilds its list of bonds with their types.
        self._chain.commands("\n".join([*lines, "run 0 post no"]))
        self.far = far
