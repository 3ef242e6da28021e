"""What an engine returns: the raw outcome of one collision, before any analysis."""

from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.workflows.engines.ending import Ending

# A stable integration does not double the energy: far more than any step that resolves its bonds
# can be off.
MOST_ENERGY_GROWTH = 2.0


@dataclass(frozen=True)
class Frames:
    """
    Snapshots of the motion.

    Attributes
    ----------
    times : ndarray of shape (frames,)
        Time since the first contact.
    displacements : ndarray of shape (frames, n)
        u_i = x_i - (i - 1).
    velocities : ndarray of shape (frames, n)
        Velocities, positive away from the wall.
    target_displacements, target_velocities : ndarray of shape (frames, M), or None
        The same of a free target, from the contact outward, along x as the chain's.
    """

    times: NDArray[np.float64]
    displacements: NDArray[np.float64]
    velocities: NDArray[np.float64]
    target_displacements: NDArray[np.float64] | None = None
    target_velocities: NDArray[np.float64] | None = None

    def state(self, frame: int) -> ChainState:
        """Return both bodies in one frame, counted from 0."""
        chain = float(self.times[frame]), self.displacements[frame], self.velocities[frame]
        if self.target_displacements is None or self.target_velocities is None:
            return ChainState(frame, *chain)
        target = self.target_displacements[frame], self.target_velocities[frame]
        return ChainState(frame, *chain, *target)

    @property
    def targets(self) -> int:
        """Particles of a free target."""
        return 0 if self.target_displacements is None else self.target_displacements.shape[1]

    def along_x(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return displacements and velocities of all, from a target's far end to the chain's."""
        if self.target_displacements is None or self.target_velocities is None:
            return self.displacements, self.velocities
        return (
            np.hstack((self.target_displacements[:, ::-1], self.displacements)),
            np.hstack((self.target_velocities[:, ::-1], self.velocities)),
        )

    def until(self, end: float) -> "Frames":
        """Return the frames up to a time."""
        shown = self.times <= end
        arrays = {f.name: getattr(self, f.name) for f in fields(self)}
        return replace(self, **{k: v[shown] for k, v in arrays.items() if v is not None})


@dataclass(frozen=True)
class Outcome:
    """
    Raw outcome of one collision.

    Time is counted from the first contact; lengths are in natural bond lengths; velocities are
    positive away from the wall. The final state is the one right after the last contact, which
    no engine's choice of when to stop can change.

    Attributes
    ----------
    engine, wall, scheme : str
        What was run; exact propagators report scheme ``modal`` or ``hard-sphere``.
    timestep : float or None
        The composed step H; None for exact propagators.
    displacements, velocities : ndarray of shape (n,)
        State right after the last contact.
    contact_times, contact_speeds : ndarray of shape (contacts,)
        When particle 1 hit the wall and how fast (> 0) it came in, the first hit included.
    impulses : ndarray of shape (contacts,)
        Momentum given by the wall at each contact, taken from the incoming state alone, so that
        their sum checks the change of momentum.
    ending : Ending
        Whether it is proved, argued or open that no further contact comes (see ``ending.py``).
    duration : float
        Simulated time from the first contact to the end.
    bond_min, bond_max : float
        Shortest and longest bond up to the last contact, to the resolution of the steps.
    energy_start, energy_end : float
        Total energy at the first contact and after the last.
    fragments : int
        Connected pieces at the last contact.
    lasted : float
        Time from the initial state to the end of the last contact; 0 where none is known.
    seconds : float
        Wall-clock time of the integration alone.
    force_evaluations : int
        Evaluations of all bond forces.
    crossed : bool
        Whether particles passed through each other (harmonic chains, in-house only).
    frames : Frames or None
        Snapshots, where they were asked for.
    target_displacements, target_velocities : ndarray of shape (M,)
        State of a free target, from the contact outward, both along x as the chain's; empty for
        the wall.
    numerics : Numerics or None
        All settings of a run by LAMMPS.
    details : dict
        What only one engine knows, such as the certificate of a bond table.
    """

    engine: str
    wall: str
    scheme: str
    timestep: float | None
    displacements: NDArray[np.float64]
    velocities: NDArray[np.float64]
    contact_times: NDArray[np.float64]
    contact_speeds: NDArray[np.float64]
    impulses: NDArray[np.float64]
    ending: Ending
    duration: float
    bond_min: float
    bond_max: float
    energy_start: float
    energy_end: float
    fragments: int
    seconds: float
    force_evaluations: int
    lasted: float = 0.0
    crossed: bool = False
    frames: Frames | None = None
    target_displacements: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    target_velocities: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    numerics: Numerics | None = None
    details: dict[str, Any] = field(default_factory=dict)
