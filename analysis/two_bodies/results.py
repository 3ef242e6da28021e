"""What the frames of two bodies say."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.restitution import EnergySplit
from chaincor.lammps_inputs.bonds.potential import Potential

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TwoBodyAnalysis:
    r"""
    What the frames of two bodies say; velocities are along x, positive away from the target.

    Attributes
    ----------
    masses, target_masses : ndarray of shape (n,) and (M,)
        From the contact outward; M is 0 for a wall.
    bond : Potential or None
        The bonds' potential, if known.
    velocity : float
        Relative speed of the centres of mass before.
    restitution, kinematic_restitution : float
        :math:`\eta` and e, the ratios of relative translational energies and of relative speeds.
    restitution_error : float or None
        Error of eta that the run itself has printed in its log, with `data_error`; None where no
        log tells it.
    data_error : float
        What the digits of the dump may have changed of eta.
    velocity_after, target_velocity_after : float
        Of the centres of mass, in the last frame.
    momentum_residual : float
        Change of the momentum of both bodies together in units of M v0; of a wall 0.
    energy_drift : float or None
        Of all energy but that of the contact; None where the bond is not known.
    energy, target_energy : EnergySplit or None
        In the last frame.
    mode_energies, target_mode_energies : ndarray of shape (n,) and (M,)
        In the last frame.
    mode_energies_start, target_mode_energies_start : ndarray of shape (n,) and (M,)
        In the first frame.
    frames : int
        Number of frames read.
    quiet : float or None
        Time from the last change of momentum that frames show to the last frame; None where the
        dump does not carry the time.
    finished : bool
        Whether that is longer than sound takes through the longer body and back.
    caveats : tuple of str
        What limits the numbers, one sentence each.
    """

    masses: Array
    target_masses: Array
    bond: Potential | None
    velocity: float
    restitution: float
    kinematic_restitution: float
    restitution_error: float | None
    data_error: float
    velocity_after: float
    target_velocity_after: float
    momentum_residual: float
    energy_drift: float | None
    energy: EnergySplit | None
    target_energy: EnergySplit | None
    mode_energies: Array
    target_mode_energies: Array
    mode_energies_start: Array
    target_mode_energies_start: Array
    frames: int
    quiet: float | None
    finished: bool
    caveats: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return the results as plain numbers and lists; what is not known is None."""
        plain = {
            "restitution": self.restitution,
            "restitution_error": self.restitution_error,
            "data_error": self.data_error,
            "kinematic_restitution": self.kinematic_restitution,
            "contacts": None,
            "particles": self.masses.size,
            "masses": self.masses.tolist(),
            "target_particles": self.target_masses.size,
            "target_masses": self.target_masses.tolist(),
            "potential": None if self.bond is None else self.bond.name,
            "velocity": self.velocity,
            "velocity_after": self.velocity_after,
            "target_velocity_after": self.target_velocity_after
            if self.target_masses.size
            else None,
            "energy_drift": self.energy_drift,
            "momentum_residual": self.momentum_residual,
            "mode_energies": self.mode_energies.tolist(),
            "target_mode_energies": self.target_mode_energies.tolist(),
            "mode_energies_start": self.mode_energies_start.tolist(),
            "target_mode_energies_start": self.target_mode_energies_start.tolist(),
            "frames": self.frames,
            "finished": self.finished,
            "caveats": list(self.caveats),
        }
        for name, energy in (("", self.energy), ("target_", self.target_energy)):
            plain[f"{name}translational_energy"] = (
                None if energy is None else float(energy.translation)
            )
            plain[f"{name}vibrational_energy"] = None if energy is None else float(energy.vibration)
        return plain
