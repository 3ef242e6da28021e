"""The frozen result of one collision: what is printed, stored and plotted."""

import math
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.atomic_write import written_aside
from chaincor.analysis.dumps.chain_frames import ChainState
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.replay import Replay

if TYPE_CHECKING:
    from ase import Atoms
    from MDAnalysis import Universe

# Arrays go to NPZ files, not into the JSON object.
ARRAY_FIELDS = (
    "contact_times",
    "contact_speeds",
    "mode_energies",
    "velocities",
    "displacements",
)
# Only of bonds that need them.
BOND_FIELDS = ("energy", "parameters", "stiffness", "natural_length")
_NOT_PLAIN = (*ARRAY_FIELDS, "replay")
# A trajectory ends when the chain has left the wall for this share of the collision, and for as
# long as sound takes over two bonds.
_FLY_ON = (0.15, 2.0)


@dataclass(frozen=True)
class ErrorBar:
    """
    Error of the restitution, cause by cause; None where it was not measured.

    Attributes
    ----------
    step : float or None
        From the run at another step.
    table : float
        From the certified force error of the bond table.
    rounding : float
        From coordinates held as absolute numbers, or from the arithmetic.
    ending : float
        What contacts could change that may still come; 0 unless the end is open.
    """

    step: float | None
    table: float
    rounding: float
    ending: float = 0.0

    @property
    def total(self) -> float | None:
        """Sum of the parts; None if the step error is unknown."""
        if self.step is None:
            return None
        return self.step + self.table + self.rounding + self.ending


@dataclass(frozen=True)
class Collision:
    r"""
    Result of one collision.

    Lengths, masses and stiffnesses are in units of the natural bond length, the particle mass and
    the bond stiffness; times count from the first contact; velocities are positive away from the
    wall. The final state is the one right after the last contact.

    Attributes
    ----------
    restitution : float
        :math:`\eta = (\bar v/v_0)^2`, the ratio of translational energies.
    restitution_error : float or None
        Error bar of eta; None where it was not asked for.
    kinematic_restitution : float
        :math:`e = \sqrt\eta`, the ratio of speeds.
    contacts : int
        How often particle 1 hit the wall.
    last_contact_time : float
        Time of the last contact.
    engine, wall, scheme : str
        What was run. Schemes ``verlet``, ``order4``, ``order6`` and ``order8`` are compositions of
        Verlet steps. To meet a tolerance the in-house engine may report others: ``modal`` (exact,
        harmonic bonds), ``extrapolated14`` (order 14, Verlet steps extrapolated), ``adaptive8``
        (Dormand and Prince's order 8, stiff bonds) or ``hard-sphere`` (the limit of high speed).
    timestep : float or None
        Composed or extrapolated step H; None for exact propagators and adaptive steps.
    table, table_points : str or None, int or None
        Interpolation and rows of the bond table, where there was one.
    potential : str
        Name of the bond.
    particles : int
        Chain length n.
    velocity : float
        Impact speed v0.
    speed : float or None
        v0 in units of v*.
    v_star : float or None
        Speed scale of the nonlinearity; None for harmonic.
    bond_min, bond_max : float
        Shortest and longest bond from the first contact to the last.
    bond_range_source : str
        Where these come from.
    energy_drift : float
        (E_end - E_start)/E_start.
    momentum_residual : float
        ``|sum of wall impulses - change of momentum| / (n v0)``.
    ending : str
        Whether it is ``proved`` that no further contact comes, ``argued``, or ``open``; then the
        error bar holds what one could change.
    duration : float
        Simulated time.
    fragments : int
        Connected pieces at the last contact.
    crossed : bool
        Whether particles passed through each other (harmonic chains, in-house engine only).
    tolerance : float or None
        Error that was asked for; None with explicit numerics.
    tolerance_met : bool or None
        Whether `restitution_error` is within it.
    reason : str or None
        Why not, where it is not.
    error_parts : ErrorBar
        The error bar, cause by cause.
    seconds, seconds_total : float
        Wall-clock time of the integration that gave the number, and of everything.
    scene_sha256 : str
        Hash of all that decides the result.
    versions : dict
        Versions of chaincor and of the libraries behind the number.
    details : dict
        What only some runs have: certificate of the table, choice of numerics, scouting.
    energy, parameters : str or None, dict or None
        Of a bond by formula, else None; None is left out of the JSON, as below.
    stiffness, natural_length : float or None
        U'' and length of a bond at rest; None where they are 1.
    replay : Replay or None
        The run as it can be carried out again, to see the motion; None in results made by hand.
    contact_times, contact_speeds : ndarray of shape (contacts,)
        When and how fast particle 1 hit the wall.
    mode_energies : ndarray of shape (n,)
        Harmonic energies E_j of the free chain's modes; j = 0 is the translation.
    velocities, displacements : ndarray of shape (n,)
        Final state; displacement is u_i = x_i - (i - 1).
    """

    restitution: float
    restitution_error: float | None
    kinematic_restitution: float
    contacts: int
    last_contact_time: float
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
    v_star: float | None
    bond_min: float
    bond_max: float
    bond_range_source: str
    energy_drift: float
    momentum_residual: float
    ending: str
    duration: float
    fragments: int
    crossed: bool
    tolerance: float | None
    tolerance_met: bool | None
    reason: str | None
    error_parts: ErrorBar
    seconds: float
    seconds_total: float
    scene_sha256: str
    versions: dict[str, str]
    contact_times: NDArray[np.float64] = field(repr=False)
    contact_speeds: NDArray[np.float64] = field(repr=False)
    mode_energies: NDArray[np.float64] = field(repr=False)
    velocities: NDArray[np.float64] = field(repr=False)
    displacements: NDArray[np.float64] = field(repr=False)
    details: dict[str, Any] = field(default_factory=dict, repr=False)
    energy: str | None = None
    parameters: dict[str, float] | None = None
    stiffness: float | None = None
    natural_length: float | None = None
    replay: Replay | None = field(default=None, repr=False, compare=False)

    def to_dict(self) -> dict[str, Any]:
        """Return all but the arrays, ready for JSON; numbers that are not finite become None."""
        plain = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in _NOT_PLAIN}
        plain["error_parts"] = {
            f.name: getattr(self.error_parts, f.name) for f in fields(self.error_parts)
        }
        for name in BOND_FIELDS:
            if plain[name] is None:
                del plain[name]
        return {key: finite(value) for key, value in plain.items()}

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """Return the arrays by field name."""
        return {name: getattr(self, name) for name in ARRAY_FIELDS}

    def trajectory(self, frames: int = 200) -> list[ChainState]:
        """
        Carry the collision out again, as this result was, and keep the motion.

        Parameters
        ----------
        frames : int
            How many states to keep, about: LAMMPS has them at the ends of steps only.

        Returns
        -------
        list of ChainState
            From the first contact (time 0) until soon after the last, at even intervals or, by
            LAMMPS, nearly so; with the stock wall one step later. `step` counts them.

        Raises
        ------
        InputError
            If fewer than two frames are asked for, or the result was not made by `collide`.
        RunError
            If the result is the limit of hard spheres, which has no motion to show.
        """
        if frames < 2:
            raise InputError(f"{frames} frames are asked for; expected 2 or more")
        if self.replay is None:
            raise InputError(
                "the result does not say how it was run; expected one returned by collide()"
            )
        share, flight = _FLY_ON
        end = (1.0 + share) * self.last_contact_time + flight
        recorded = self.replay.record(end / (frames - 1))
        # The last may be late by rounding.
        return [
            ChainState(step, float(time), displacements, velocities)
            for step, (time, displacements, velocities) in enumerate(
                zip(recorded.times, recorded.displacements, recorded.velocities, strict=True)
            )
            if time <= end * (1.0 + 1e-9)
        ]

    def to_ase(self, frames: int = 200) -> "list[Atoms]":
        """
        Return the motion as ASE Atoms; the collision is carried out again for it.

        Numbers are the reduced ones of this package, not eV, angstrom and ASE's time.

        Parameters
        ----------
        frames : int
            As for :meth:`trajectory`.

        Returns
        -------
        list of ase.Atoms
            Float64 positions (x, 0, 0), velocities, masses 1, array ``bonds``, ``info["time"]``;
            each knows its potential energy and the forces of the bonds. No cell: the wall at x = 0
            is no part of the Atoms.

        Raises
        ------
        InputError, RunError
            As :meth:`trajectory`.
        """
        from chaincor.analysis.dumps.other_formats import ase_atoms

        states, masses = self.trajectory(frames), np.ones(self.particles)
        assert self.replay is not None
        return [ase_atoms(state, masses, self.replay.scene.bond) for state in states]

    def to_universe(self, frames: int = 200) -> "Universe":
        """
        Return the motion as an MDAnalysis Universe; the collision is carried out again for it.

        Numbers are the reduced ones of this package, not angstrom, picoseconds and daltons.

        Parameters
        ----------
        frames : int
            As for :meth:`trajectory`.

        Returns
        -------
        MDAnalysis.Universe
            With times, masses 1, ids from the wall outwards, bonds between neighbours, no box.
            MDAnalysis keeps positions and velocities as float32; float64 ones are in ``ts.data``
            as ``v_displacement`` (u = x - (id - 1)) and ``vx``.

        Raises
        ------
        InputError, RunError
            As :meth:`trajectory`.
        """
        from chaincor.analysis.dumps.universe import universe_of_states

        return universe_of_states(self.trajectory(frames), np.ones(self.particles))

    def save_arrays(self, path: Path) -> None:
        """Write the arrays to an NPZ file, aside first: an older one is not lost half-way."""
        with written_aside(Path(path)) as aside, aside.open("wb") as file:
            # Not `allow_pickle=False`: before NumPy 2.1 that is kept as one more array.
            contents: dict[str, Any] = self.arrays()
            np.savez_compressed(file, **contents)


def finite(value: Any) -> Any:
    """Return a plain value as JSON knows it: with None for numbers that are not finite."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: finite(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [finite(inner) for inner in value]
    return value
