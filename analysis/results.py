"""Results of the analysis of a dump."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from chaincor.analysis.contacts import ContactStatistics
from chaincor.analysis.dumps.contact_detection import DetectedContacts
from chaincor.analysis.restitution import EnergySplit
from chaincor.analysis.showing.numbers import eta_of_dump, impact_speed
from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential

if TYPE_CHECKING:
    from chaincor.analysis.job_folder import Job

# Relative rounding error of the summed energies of many particles.
_ROUNDINGS = 1e-13


@dataclass(frozen=True)
class History:
    """
    Motion and energies of a body in time. If a dump has very many frames, every k-th is kept.

    Times are relative to the first contact.

    Attributes
    ----------
    times : ndarray of shape (frames,)
        Times of the displacements and velocities.
    displacements, velocities : ndarray of shape (frames, n)
        States of all particles.
    series_times : ndarray of shape (rows,)
        Times of momentum, energies and bond lengths.
    momentum : ndarray of shape (rows,)
        Sum of masses times velocities.
    translation, vibration : ndarray of shape (rows,)
        Energies. If the bond is unknown, `vibration` is only the kinetic energy of vibration.
    bond_min, bond_max : ndarray of shape (rows,)
        Shortest and longest bond at each time.
    """

    times: Array
    displacements: Array
    velocities: Array
    series_times: Array
    momentum: Array
    translation: Array
    vibration: Array
    bond_min: Array
    bond_max: Array

    @property
    def mirrored(self) -> "History":
        """Mirrored history, for a target whose displacements are positive away from the contact."""
        turned = ("displacements", "velocities", "momentum")
        return replace(self, **{name: -getattr(self, name) for name in turned})

    def along_the_line(self, target: "History | None") -> tuple[Array, Array]:
        """
        Return displacements and velocities of a target and this chain, of shape (frames, all).

        The history of the target must already be mirrored.
        """
        if target is None:
            return self.displacements, self.velocities
        return (
            np.hstack((target.displacements[:, ::-1], self.displacements)),
            np.hstack((target.velocities[:, ::-1], self.velocities)),
        )


@dataclass(frozen=True, repr=False, kw_only=True)
class BodyAnalysis:
    """
    Analysis of one body of a collision: the chain, or a free target, which is mirrored.

    Attributes
    ----------
    masses : ndarray of shape (n,)
        Particle masses, from the contact outward.
    velocity_after : float
        Velocity of the centre of mass in the last frame, along x.
    mode_frequencies, mode_energies : ndarray of shape (n,)
        Frequencies omega_j of the modes, and their energies E_j in the last frame.
    mode_energies_start : ndarray of shape (n,)
        Energies E_j in the first frame.
    energy_start, energy_end : EnergySplit or None
        Energies in the first and last frame; None if the bond is unknown.
    history : History
        Motion in time. Displacements and velocities of a target are positive away from the contact.
    """

    masses: Array
    velocity_after: float
    mode_frequencies: Array
    mode_energies: Array
    mode_energies_start: Array
    energy_start: EnergySplit | None
    energy_end: EnergySplit | None
    history: History


@dataclass(frozen=True, repr=False, kw_only=True)
class CollisionAnalysis(BodyAnalysis):
    """
    Analysis of the frames of a collision: of the chain, the contacts, and a free target.

    Bond length and stiffness are 1, and masses are as given.

    Attributes
    ----------
    particles : int
        Number of particles n.
    bond : Potential or None
        The bonds' potential, if known.
    velocity : float
        Impact speed v0.
    restitution : float
        eta = (V/v0)^2, the ratio of energies; V is the velocity of the centre of mass.
    restitution_bound : float or None
        Largest eta that the energy in the first frame allows. The bound is 1 for a cold chain and
        larger for a chain that arrives vibrating. For a vibrating chain it is None if the bond is
        unknown.
    kinematic_restitution : float
        e = V/v0, the ratio of speeds.
    restitution_error : float or None
        Total error of eta, from the log or from a second run at another time step: see
        :func:`~chaincor.analysis.step_error.estimate_error`. It is None without an estimate.
    data_error : float
        Bound on the error of eta due to the number format of the dump and to its conversion. The
        error of the simulation is not included.
    contact_times, contact_speeds : ndarray of shape (f,)
        Times of the f contacts since the first contact, and incoming speeds.
    contact_statistics : ContactStatistics
        Statistics of the contacts.
    contacts : int or None
        Number f of contacts; None if the frames are too far apart to count contacts.
    detection : DetectedContacts
        How the contacts were found.
    anharmonic_remainder : float or None
        Anharmonic bond energy in the last frame, which the modes do not contain.
    energy_drift : float or None
        (E_end - E_start)/E_start.
    momentum_residual : float
        Momentum in the last frame that the impulses of the contacts do not explain, in units of M
        v0.
    bond_min, bond_max : float
        Shortest and longest bond in any frame.
    frames : int
        Number of frames read.
    timestep : float or None
        Simulated time per step; None if the dump contains the time.
    time_start, time_end : float
        Times of the first and last frame, relative to the first contact.
    ending : str or None
        ``proved`` if energy and momentum rule out a contact after the last frame, ``argued`` if a
        contact is unlikely; None without such an argument.
    finished : bool
        Whether no contact is expected after the last frame.
    notes : tuple of str
        Limitations of these results, one sentence each.
    soft : bool
        Whether the bodies overlap while they touch. Contacts are then not reported.
    job : Job or None
        Files of the job, as found by :func:`~chaincor.analysis.job_folder.find_job`; None if only
        frames were analysed.
    target : BodyAnalysis or None
        Free target; None for a wall. With a target, `velocity`, `restitution` and contacts refer to
        the relative motion, `energy_drift` to the energy of both bodies, and `momentum_residual`
        to the change of their total momentum.
    """

    particles: int
    bond: Potential | None
    velocity: float
    restitution: float
    restitution_bound: float | None
    kinematic_restitution: float
    restitution_error: float | None
    data_error: float
    contact_times: Array
    contact_speeds: Array
    contact_statistics: ContactStatistics
    contacts: int | None
    detection: DetectedContacts
    anharmonic_remainder: float | None
    energy_drift: float | None
    momentum_residual: float
    bond_min: float
    bond_max: float
    frames: int
    timestep: float | None
    time_start: float
    time_end: float
    ending: str | None
    finished: bool
    notes: tuple[str, ...]
    soft: bool = False
    job: "Job | None" = None
    target: BodyAnalysis | None = None

    @property
    def target_particles(self) -> int:
        """Number of particles of a free target; 0 for a wall."""
        return 0 if self.target is None else self.target.masses.size

    @property
    def bodies(self) -> dict[str, BodyAnalysis]:
        """Chain and free target, with the prefixes of their names: empty and ``target_``."""
        return {"": self} if self.target is None else {"": self, "target_": self.target}

    @cached_property
    def contradictions(self) -> tuple[str, ...]:
        """
        Violations of physics in the dump, such as eta above 1, one sentence each.

        If there is a contradiction, no result of the analysis can be trusted.
        """
        found, bound, detection = [], self.restitution_bound, self.detection
        error = self.data_error if self.restitution_error is None else self.restitution_error
        suspects = (
            "forces besides wall and bonds, masses that differ from the run (--masses), or a time "
            "step that is too large"
        )
        if bound is not None and self.restitution > bound * (1.0 + _ROUNDINGS) + error:
            allowed = (
                "1"
                if bound == 1.0
                else f"{bound:.6g}, which would use all energy of the arriving chain,"
            )
            found.append(
                f"restitution is above {allowed} by {self.restitution - bound:.1e}: the chain "
                f"cannot gain energy from a wall at rest, which points to {suspects}"
            )
        if detection.largest_fall > 0.0:
            found.append(
                f"the momentum falls by {detection.largest_fall:.1e} of its size at impact, but a "
                f"wall can only push the chain away; this points to {suspects}"
            )
        if detection.unexplained:
            found.append(
                f"the momentum rises {detection.unexplained} times while particle 1 is out of "
                f"reach of a wall at x = 0; this points to {suspects}, to a wall elsewhere, or to "
                "a wall with a longer range"
            )
        if detection.method == "reintegration" and detection.unresolved:
            found.append(
                f"contacts with a wall at x = 0 do not account for the momentum between "
                f"{detection.unresolved} pairs of frames; this points to {suspects}, to another "
                "potential, or to frames that are too far apart"
            )
        return tuple(found)

    @property
    def caveats(self) -> tuple[str, ...]:
        """Limitations of the results, one sentence each: contradictions, then notes."""
        return self.contradictions + self.notes

    @property
    def energy_at_impact(self) -> float:
        """Translational energy before the collision; all energy if the chain arrived vibrating."""
        reduced = float(np.sum(self.masses))
        if self.target is not None:
            reduced /= 1.0 + reduced / float(np.sum(self.target.masses))
        return 0.5 * reduced * self.velocity**2 * (self.restitution_bound or 1.0)

    @property
    def against(self) -> str:
        """Phrase that describes the target in a heading; empty for a hard wall."""
        if self.target is not None:
            return f" and a free target of {self.target_particles}"
        return " and a soft wall" if self.soft else ""

    @property
    def heading(self) -> str:
        """Chain, target, bonds, speed and number of frames, in one line."""
        speed = impact_speed(self.velocity, None if self.bond is None else self.bond.natural_speed)
        name = "unknown" if self.bond is None else self.bond.name
        who = f"{self.particles} particles{self.against}"
        return f"{who}, {name} bonds, {speed}, {self.frames} frames"

    def __repr__(self) -> str:
        eta = eta_of_dump(self.restitution, self.restitution_error, self.data_error)
        contacts = f"at least {self.contact_statistics.count}"
        if self.contacts is not None or self.soft:
            contacts = str(self.contacts or "not reported")
        notes = f"notes, in .caveats: {len(self.caveats)}"
        if self.contradictions:
            notes += f"; CONTRADICTED: {self.contradictions[0]}"
        return (
            f"{self.heading}\n"
            f"eta = {eta}\n"
            f"e = {self.kinematic_restitution:.6g}, contacts {contacts}; {notes}"
        )
