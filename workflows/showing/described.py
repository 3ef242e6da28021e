"""What text, tables and pictures read of a result."""

import numpy as np
from numpy.typing import NDArray

from chaincor.workflows.bodies import Bodies
from chaincor.workflows.motion import Motion


class Described(Bodies, Motion):
    """The fields of :class:`~chaincor.workflows.result.Collision` that are shown."""

    restitution: float
    restitution_error: float | None
    kinematic_restitution: float
    contacts: int
    engine: str
    wall: str
    scheme: str
    timestep: float | None
    table: str | None
    table_points: int | None
    potential: str
    particles: int
    velocity: float
    speed: float | None
    bond_min: float
    bond_max: float
    bond_error: float | None
    energy_drift: float
    momentum_residual: float
    ending: str
    fragments: int
    crossed: bool
    tolerance: float | None
    tolerance_met: bool | None
    reason: str | None
    seconds: float
    seconds_total: float
    stiffness: float | None
    contact_times: NDArray[np.float64]
    contact_speeds: NDArray[np.float64]
    mode_energies: NDArray[np.float64]
    velocities: NDArray[np.float64]
