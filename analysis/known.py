"""What is known of a collision besides its frames, by whoever analyses them."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.dumps.data_file import DeclaredMasses
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError

EndArgument = Callable[[float, Array, Array, float, Potential], str | None]


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of a collision, in the chain's units; None where it is not."""

    #: The bonds' potential: gives energies, and contacts whatever the spacing of the frames.
    bond: Potential | None = None
    impact_velocity: float | None = None  #: v0; that of the first frame by default.
    timestep: float | None = None  #: Simulated time per step, for dumps that do not carry the time.
    #: Particle masses from the wall outwards, repeated along the chain; see
    #: :func:`~chaincor.analysis.dumps.masses.masses_of_bodies`. Those of the dump, else 1, by
    #: default.
    masses: ArrayLike | None = None
    #: Masses by type, from the files of the job.
    declared: DeclaredMasses = field(default_factory=DeclaredMasses)
    targets: int = 0  #: Particles of a free target; 0 for a wall.
    soft: bool = False  #: Whether the bodies overlap when they meet.
    #: ``f(u_1, strains, velocities, time_since_contact, bond)`` returning why no contact can
    #: follow, or None; asked where all masses are alike. Without it only the time since the last
    #: contact speaks.
    end_argument: EndArgument | None = None

    def __post_init__(self) -> None:
        """Refuse a velocity or a timestep that is not positive."""
        for name, given in (("velocity", self.impact_velocity), ("timestep", self.timestep)):
            if given is not None and not 0.0 < given < np.inf:
                raise InputError(f"the {name} is {given}; expected a positive finite number")


NOTHING_KNOWN = Known()
