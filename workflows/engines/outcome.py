"""Define the raw outcome of one collision, which an engine returns before any analysis."""

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chaincor.analysis.dumps.chain_state import ChainState
from chaincor.analysis.modes import mode_energies
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.ending import Ending

# A run is unstable if its energy grows by more than this factor. If the steps resolve the
# vibrations of the bonds, the error of the energy is far smaller.
MOST_ENERGY_GROWTH = 2.0


@dataclass(frozen=True)
class Frames:
    """Snapshots of the motion."""

    times: NDArray[np.float64]  #: Time since the first contact; of shape (frames,).
    displacements: NDArray[np.float64]  #: u_i = x_i - (i - 1); of shape (frames, n).
    #: Velocities, positive away from the wall; of shape (frames, n).
    velocities: NDArray[np.float64]
    #: Displacements of a free target from the contact outward, positive along x; of shape (frames,
    #: M).
    target_displacements: NDArray[np.float64] | None = None
    #: Velocities of a free target; of shape (frames, M).
    target_velocities: NDArray[np.float64] | None = None

    @classmethod
    def of(
        cls, line: Line, times: ArrayLike, displacements: ArrayLike, velocities: ArrayLike
    ) -> "Frames":
        """
        Return the frames of both bodies from arrays that list all particles along x.

        The arrays may omit a hard wall.
        """
        chain, targets = len(line.chain_masses), line.targets
        moved, moving = np.array(displacements), np.array(velocities)
        target = (each[:, :targets][:, ::-1] if targets else None for each in (moved, moving))
        return cls(np.array(times), moved[:, -chain:], moving[:, -chain:], *target)

    def state(self, frame: int) -> ChainState:
        """Return the state of both bodies in one frame; the first frame has the index 0."""
        chain = float(self.times[frame]), self.displacements[frame], self.velocities[frame]
        if self.target_displacements is None or self.target_velocities is None:
            return ChainState(frame, *chain)
        target = self.target_displacements[frame], self.target_velocities[frame]
        return ChainState(frame, *chain, *target)

    @property
    def targets(self) -> int:
        """Number of particles of a free target."""
        return 0 if self.target_displacements is None else self.target_displacements.shape[1]

    def along_x(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return displacements and velocities in the order of x, with a target before the chain."""
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
    positive away from the wall. The final state is the state right after the last contact; it does
    not depend on the time at which an engine stops.
    """

    problem: Problem = field(repr=False)  #: Bodies of the run.
    #: Engine of the run.
    engine: str
    wall: str  #: Wall model of the run.
    scheme: str  #: Scheme of the run; ``modal`` or ``hard-sphere`` for the two exact propagators.
    timestep: float | None  #: Time step H of the scheme; None for exact propagators.
    #: Displacements right after the last contact; of shape (n,).
    displacements: NDArray[np.float64]
    velocities: NDArray[np.float64]  #: Velocities right after the last contact; of shape (n,).
    #: Times of the contacts, including the first; of shape (contacts,).
    contact_times: NDArray[np.float64]
    #: Incoming speeds (> 0) of particle 1; of shape (contacts,).
    contact_speeds: NDArray[np.float64]
    #: Impulse of the wall at each contact, computed from the incoming state alone; of shape
    #: (contacts,). The sum of the impulses checks the change of the total momentum.
    impulses: NDArray[np.float64]
    #: End of the collision. Its kind tells whether the absence of further contacts is proved,
    #: argued or open (see ``ending.py``).
    ending: Ending
    duration: float  #: Simulated time from the first contact to the end of the run.
    #: Length of the shortest bond up to the last contact, sampled at the ends of steps.
    bond_min: float
    #: Length of the longest bond up to the last contact, sampled at the ends of steps.
    bond_max: float
    #: Total energy at the first contact.
    energy_start: float
    energy_end: float  #: Total energy after the last contact.
    fragments: int  #: Number of connected fragments at the last contact.
    seconds: float  #: Wall-clock time of the integration alone.
    force_evaluations: int  #: Number of evaluations of the forces of all bonds.
    #: Energy lost to damping until the end of the last contact; None without damping.
    dissipated: float | None = None
    #: Quantities that the loops track during soft contacts, by name (see ``reference.tracked``);
    #: empty for hard bodies and LAMMPS.
    tracked: dict[str, float] = field(default_factory=dict)
    #: Time from the initial state to the end of the last contact; 0 if unknown.
    lasted: float = 0.0
    #: Whether particles passed through each other (harmonic chains, reference engine only).
    crossed: bool = False
    frames: Frames | None = None  #: Snapshots; None if none were requested.
    #: Displacements of a free target from the contact outward, positive along x; of shape (M,),
    #: empty for the wall.
    target_displacements: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    #: Velocities of a free target; of shape (M,).
    target_velocities: NDArray[np.float64] = field(default_factory=lambda: np.empty(0))
    numerics: Numerics | None = None  #: All settings of a LAMMPS run.
    #: Results that only one engine has, for example the certificate of a bond table.
    details: dict[str, Any] = field(default_factory=dict)

    @cached_property
    def separation_velocity(self) -> float:
        """Velocity at which the centres of mass of both bodies separate."""
        line = self.problem.line
        target = self.target_velocities[::-1] if line.targets else np.zeros(1)
        return line.separation(np.concatenate((target, self.velocities)))

    @cached_property
    def mode_energies(self) -> NDArray[np.float64]:
        """Harmonic energies of the modes of the chain, of shape (n,); beads have no such modes."""
        bond = self.problem.bond
        if bond.only_pushes:
            return np.empty(0)
        masses = self.problem.line.chain_masses
        return mode_energies(self.displacements, self.velocities, bond.stiffness, masses)

    @cached_property
    def eta(self) -> float:
        """Restitution of the translational energy; with a free target, of the relative motion."""
        e = self.separation_velocity / self.problem.impact_velocity
        return e * e

    @property
    def longest_silence(self) -> float:
        """Longest time between two contacts; 0 if there is only one contact."""
        return float(np.max(np.diff(self.contact_times), initial=0.0))
