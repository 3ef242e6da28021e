"""What the analysis of a collision returns."""

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

# Sums of energies of many particles; nothing for a bound of 1 itself, which is exact.
_ROUNDINGS = 1e-13


@dataclass(frozen=True)
class History:
    """
    The collision in time, thinned evenly where the dump has very many frames.

    Times are counted from the first contact.

    Attributes
    ----------
    times : ndarray of shape (frames,)
        Of the whole states.
    displacements, velocities : ndarray of shape (frames, n)
        Whole states.
    series_times : ndarray of shape (rows,)
        Of the quantities below.
    momentum : ndarray of shape (rows,)
        Sum of masses times velocities.
    translation, vibration : ndarray of shape (rows,)
        Energies; where the bond is not known, vibration is its kinetic part only.
    bond_min, bond_max : ndarray of shape (rows,)
        Shortest and longest bond in the frame.
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
        """The same in a mirror: a target's along x, which is told from the contact outward."""
        turned = ("displacements", "velocities", "momentum")
        return replace(self, **{name: -getattr(self, name) for name in turned})

    def along_the_line(self, target: "History | None") -> tuple[Array, Array]:
        """Return displacements and velocities of a target, itself along x, and of this chain."""
        if target is None:
            return self.displacements, self.velocities
        return (
            np.hstack((target.displacements[:, ::-1], self.displacements)),
            np.hstack((target.velocities[:, ::-1], self.velocities)),
        )


@dataclass(frozen=True, repr=False, kw_only=True)
class BodyAnalysis:
    """
    One body of a collision: the chain or, seen in a mirror in which it is a chain, a free target.

    Attributes
    ----------
    masses : ndarray of shape (n,)
        Particle masses, from the contact outward.
    velocity_after : float
        Of its centre of mass in the last frame, along x.
    mode_frequencies, mode_energies : ndarray of shape (n,)
        omega_j, and E_j in the last frame.
    mode_energies_start : ndarray of shape (n,)
        E_j in the first frame.
    energy_start, energy_end : EnergySplit or None
        First and last frame; None where the bond is not known.
    history : History
        Its motion in time; that of a target counts away from the contact.
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
    What the frames of a collision say: of the chain as a body, and of what it met.

    Units: bond length and stiffness 1, masses as given.

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
        Largest eta that the energy in the first frame allows: 1, or more of a chain that came
        vibrating; None for one whose bond is not known.
    kinematic_restitution : float
        e = V/v0, the ratio of speeds.
    restitution_error : float or None
        Error of the whole number, from a second run at another step: see
        :func:`~chaincor.analysis.step_error.estimate_error`. None where that cannot be told.
    data_error : float
        What the format of the dump and reading it may have changed: how far eta can be from that
        of the run as LAMMPS held it. The error of the run itself is not in it.
    contact_times, contact_speeds : ndarray of shape (f,)
        Times from the first contact, and incoming speeds.
    contact_statistics : ContactStatistics
        The same in a few numbers.
    contacts : int or None
        f; None where the frames are too far apart to count.
    detection : DetectedContacts
        How the contacts were found.
    anharmonic_remainder : float or None
        Bond energy in the last frame that the modes leave out.
    energy_drift : float or None
        (E_end - E_start)/E_start.
    momentum_residual : float
        Momentum in the last frame less what the contacts gave, in units of M v0.
    bond_min, bond_max : float
        Shortest and longest bond in any frame.
    frames : int
        Number of frames read.
    timestep : float or None
        Simulated time per step that was used; None where the dump carries the time.
    time_start, time_end : float
        First and last frame, from the first contact.
    ending : str or None
        ``proved`` where energy and momentum rule out a contact after the last frame, ``argued``
        where one is unlikely; None where neither can be said.
    finished : bool
        Whether, as far as can be told, no contact follows the last frame.
    notes : tuple of str
        What limits the numbers above, one sentence each.
    soft : bool
        Whether the bodies overlap when they meet: contacts are not told then.
    job : Job or None
        Files that it was read from, as :func:`~chaincor.analysis.job_folder.find_job` finds them;
        None where frames alone were analysed.
    target : BodyAnalysis or None
        The free target, if it is not a wall that the chain hits. `velocity`, `restitution` and
        contacts are then those of the relative motion, `energy_drift` that of both bodies, and
        `momentum_residual` the change of their momentum.
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
        """The chain and a free target, by what stands before their names: nothing, ``target_``."""
        return {"": self} if self.target is None else {"": self, "target_": self.target}

    @cached_property
    def contradictions(self) -> tuple[str, ...]:
        """
        What no chain and no wall can have done, such as eta above 1.

        While there is any, no number is to be trusted.
        """
        found, bound, detection = [], self.restitution_bound, self.detection
        error = self.data_error if self.restitution_error is None else self.restitution_error
        suspects = (
            "forces other than those of wall and bonds, other masses than those of the run "
            "(--masses), or a step too large"
        )
        if bound is not None and self.restitution > bound * (1.0 + _ROUNDINGS) + error:
            allowed = "1" if bound == 1.0 else f"{bound:.6g}, which takes all energy it came with,"
            found.append(
                f"restitution is above {allowed} by {self.restitution - bound:.1e}: the chain "
                f"cannot gain energy from a wall at rest, which points to {suspects}"
            )
        if detection.largest_fall > 0.0:
            found.append(
                f"the momentum falls by {detection.largest_fall:.1e} of that at impact, which no "
                f"wall explains: it only pushes away; that points to {suspects}"
            )
        if detection.unexplained:
            found.append(
                f"the momentum rises {detection.unexplained} times while particle 1 is out of "
                f"reach of a wall at x = 0: that points to {suspects}, or to a wall elsewhere or "
                "of its own range"
            )
        if detection.method == "reintegration" and detection.unresolved:
            found.append(
                f"contacts with a wall at x = 0 do not account for the momentum between "
                f"{detection.unresolved} pairs of frames: that points to {suspects}, to another "
                "potential, or to frames too far apart"
            )
        return tuple(found)

    @property
    def caveats(self) -> tuple[str, ...]:
        """What limits the numbers, one sentence each: the contradictions, then the notes."""
        return self.contradictions + self.notes

    @property
    def energy_at_impact(self) -> float:
        """Translational energy before, and of a chain that came vibrating all energy."""
        reduced = float(np.sum(self.masses))
        if self.target is not None:
            reduced /= 1.0 + reduced / float(np.sum(self.target.masses))
        return 0.5 * reduced * self.velocity**2 * (self.restitution_bound or 1.0)

    @property
    def against(self) -> str:
        """What the chain hits, in words after its own; nothing for a hard wall."""
        if self.target is not None:
            return f" and a free target of {self.target_particles}"
        return " and a soft wall" if self.soft else ""

    @property
    def heading(self) -> str:
        """What collided, how fast, and how many frames show it, in one line."""
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
