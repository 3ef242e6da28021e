"""Frames of a dump as states of two bodies: a chain, and the free target that it hits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.dumps.chain_frames import DISPLACEMENT_COLUMN, TIME_COLUMN, ChainLayout
from chaincor.analysis.dumps.data_file import DeclaredMasses
from chaincor.analysis.dumps.frame import DumpFrame
from chaincor.analysis.dumps.masses import find_masses
from chaincor.lammps_inputs.errors import InputError

# 1 in the chain and 2 in the target.
BODY_COLUMN = "mol"

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BodiesState:
    """Displacements and velocities of both bodies, each as a chain from the contact outward."""

    time: float | None
    displacements: tuple[Array, Array]
    velocities: tuple[Array, Array]


@dataclass(frozen=True)
class BodiesLayout:
    """Which rows of a frame, sorted by id, are which body, from the contact outward."""

    rows: tuple[NDArray[np.int64], NDArray[np.int64]]
    masses: tuple[Array, Array]
    position: str
    digits: int

    @classmethod
    def from_frame(cls, frame: DumpFrame, targets: int, declared: DeclaredMasses) -> "BodiesLayout":
        """
        Tell the bodies apart: by the column ``mol``, else the target has the lowest x.

        Raises InputError where that cannot be told.
        """
        position = next((name for name in ("xu", "x") if name in frame.columns), None)
        if position is None or "vx" not in frame.columns:
            raise InputError(
                f"the dump has columns {' '.join(frame.columns)}; expected at least 'id x vx' of "
                "two bodies, or 'xu' in place of x"
            )
        x = frame.column(position)
        if not targets < x.size:
            raise InputError(
                f"the free target has {targets} particles and the dump {x.size}; expected fewer: "
                "the others are the chain"
            )
        order = np.argsort(x, kind="stable")
        is_target = np.isin(np.arange(x.size), order[:targets])
        if BODY_COLUMN in frame.columns and targets:
            is_target = frame.column(BODY_COLUMN) == 2.0
        elif targets and x[order[targets - 1]] == x[order[targets]]:
            raise InputError(
                f"particles of both bodies are at x = {x[order[targets]]:g} in the first frame; "
                f"expected them apart, or a column '{BODY_COLUMN}' that is 2 in the target"
            )
        chain, target = np.flatnonzero(~is_target), np.flatnonzero(is_target)
        rows = chain[np.argsort(x[chain])], target[np.argsort(-x[target])]
        plain = ChainLayout(x.size, position, None, time_known=True)
        found = find_masses(frame, plain, declared=declared)
        masses = np.ones(x.size) if found is None else found
        return cls(rows, (masses[rows[0]], masses[rows[1]]), position, frame.significant_digits())

    @property
    def size(self) -> int:
        """Number of all particles."""
        return self.rows[0].size + self.rows[1].size

    def read(self, frame: DumpFrame, timestep: float | None = None) -> BodiesState:
        """Return the state in a frame; `timestep` is for dumps that do not carry the time."""
        v = frame.column("vx")
        if v.size != self.size:
            raise InputError(
                f"the frame of step {frame.step} holds {v.size} particles, the first frame "
                f"{self.size}; expected the same number in all: LAMMPS has lost some"
            )
        if TIME_COLUMN in frame.columns:
            time: float | None = float(frame.column(TIME_COLUMN)[0])
        else:
            time = frame.time if timestep is None else frame.step * timestep
        if DISPLACEMENT_COLUMN in frame.columns:
            u = frame.column(DISPLACEMENT_COLUMN)
            found = u[self.rows[0]], u[self.rows[1]]
        else:
            x = frame.column(self.position)
            chain, target = x[self.rows[0]], x[self.rows[1]]
            found = chain - np.arange(chain.size), target + np.arange(target.size)
        if not np.all(np.isfinite(np.concatenate((*found, v)))):
            raise InputError(
                f"the frame of step {frame.step} holds a value that is not a number; the run had "
                "blown up there: use a smaller timestep"
            )
        return BodiesState(time, found, (v[self.rows[0]], v[self.rows[1]]))

    def mean(self, state: BodiesState, body: int) -> float:
        """Return the velocity of the centre of mass of body 0, the chain, or 1, the target."""
        if not self.rows[body].size:
            return 0.0
        masses = self.masses[body]
        return float(masses @ state.velocities[body]) / float(np.sum(masses))

    def relative_velocity(self, state: BodiesState) -> float:
        """Return how fast the bodies part."""
        return self.mean(state, 0) - self.mean(state, 1)

    def momentum(self, state: BodiesState) -> float:
        """Return that of the chain."""
        return float(self.masses[0] @ state.velocities[0])

    def whole_change(self, first: BodiesState, last: BodiesState) -> float:
        """Return by how much the momentum of both bodies has changed; a wall takes any."""
        if not self.rows[1].size:
            return 0.0
        both = [self.momentum(s) + float(self.masses[1] @ s.velocities[1]) for s in (first, last)]
        return abs(both[1] - both[0])

    def resolution(self, frame: DumpFrame) -> float:
        """Return how far the relative velocity may be off by the digits of a frame."""
        half = frame.resolution("vx", self.digits)
        shares = (
            m / np.sum(m) @ half[r] for m, r in zip(self.masses, self.rows, strict=True) if m.size
        )
        largest = float(np.max(np.abs(frame.column("vx"))))
        return float(sum(shares)) + self.size * float(np.finfo(float).eps) * largest

    def slowest(self, stiffness: float) -> float:
        """Return how long sound takes through the longer body."""
        return max(m.size * float(np.mean(m) / stiffness) ** 0.5 for m in self.masses if m.size)
