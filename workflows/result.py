"""The frozen result of one collision: what is printed, stored and plotted."""

from dataclasses import dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.atomic_write import write_arrays, written_aside
from chaincor.workflows.error_bar import ErrorBar
from chaincor.workflows.json_output import finite
from chaincor.workflows.motion import Motion
from chaincor.workflows.showing.plots import Plots
from chaincor.workflows.showing.table import html_table
from chaincor.workflows.showing.text import describe_shortly

if TYPE_CHECKING:
    from chaincor.workflows.engines.replay import Replay

# Arrays go to NPZ files, not into the JSON object.
ARRAY_FIELDS = (
    "contact_times",
    "contact_speeds",
    "mode_energies",
    "velocities",
    "displacements",
)
TARGET_ARRAYS = ("target_mode_energies", "target_velocities", "target_displacements")


@dataclass(frozen=True, repr=False)
class Collision(Motion):
    r"""
    Result of one collision.

    Lengths, masses and stiffnesses are in units of the natural bond length, the particle mass and
    the bond stiffness; times count from the first contact; velocities are positive away from the
    wall, those of a target that is knocked away negative. The final state, and energies of bodies,
    are those right after the last contact. What is said of both bodies, from `masses` on, is None
    for a cold chain of unit masses and a hard wall. A notebook shows a table, and pictures are
    drawn by ``result.plot``.

    Attributes
    ----------
    restitution : float
        :math:`\eta = (\bar v/v_0)^2`, the ratio of translational energies; with a free target
        :math:`\bar v` is the relative velocity of the centres of mass.
    restitution_error : float or None
        Error bar of eta; None where it was not asked for.
    kinematic_restitution : float
        :math:`e = \sqrt\eta`, the ratio of speeds.
    contacts : int
        How often particle 1 hit the wall, or the target.
    last_contact_time : float
        Time of the last contact.
    engine, wall, scheme : str
        What was run. Schemes ``verlet``, ``order4``, ``order6`` and ``order8`` are compositions of
        Verlet steps. To meet a tolerance the in-house engine may report others: ``modal`` (exact,
        harmonic bonds), ``srkn14`` (order 6, fourteen kicks of Blanes and Moan),
        ``extrapolated14`` (order 14, Verlet steps extrapolated), ``adaptive8`` (Dormand and
        Prince's order 8, stiff bonds) or ``hard-sphere`` (the limit of high speed).
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
    bond_error : float or None
        How much shorter and longer bonds may have been between the ends of steps, at which they
        are looked at; None where steps have no fixed length.
    energy_drift : float
        (E_end - E_start)/E_start.
    momentum_residual : float
        ``|sum of impulses - change of momentum| / (M v0)``, M the mass of the chain; with a free
        target the larger of both bodies'.
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
        Of a bond by formula, else None; None is left out of the JSON, here and below.
    stiffness, natural_length : float or None
        U'' and length of a bond at rest; None where they are 1.
    replay : Replay or None
        The run as it can be carried out again, to see the motion; None in results made by hand.
    contact_times, contact_speeds : ndarray of shape (contacts,)
        When and how fast particle 1 hit the wall; the speed relative to that of a free target's
        first particle.
    mode_energies : ndarray of shape (n,)
        Harmonic energies E_j of the free chain's modes; j = 0 is the translation.
    velocities, displacements : ndarray of shape (n,)
        Final state; displacement is u_i = x_i - (i - 1).
    masses : tuple of float or None
        Of the chain's particles from the contact outward, as they were given, repeated along the
        chain; None where all are 1.
    target_particles : int or None
        Of a free target; None for the wall.
    target_masses : tuple of float or None
        Its masses, from the contact outward, likewise.
    contact : str or None
        ``power`` where the bodies are soft.
    contact_stiffness, contact_exponent : float or None
        K and q of their repulsion :math:`K d^q`.
    initial : str or None
        File of the state that the chain came with.
    compression : float or None
        By which part its bonds were shorter at first.
    temperature : float or None
        k_B T of both bodies at first.
    seed : int or None
        Of what was drawn.
    velocity_after, target_velocity_after : float or None
        Of the centres of mass.
    translational_energy, target_translational_energy : float or None
        :math:`M V^2/2` of each body.
    vibrational_energy, target_vibrational_energy : float or None
        All other energy of each body.
    target_mode_energies : ndarray of shape (M,) or None
        As `mode_energies`, of the target.
    target_velocities, target_displacements : ndarray of shape (M,) or None
        Its final state from the contact outward; particle k is at :math:`1 - k + u_k`.

    Examples
    --------
    >>> from chaincor import Scene, collide
    >>> result = collide(Scene(potential="harmonic", particles=3, engine="reference"))
    >>> result.contact_times.round(2), result.scheme, result.to_dict()["tolerance_met"]
    (array([0.  , 2.16, 4.75]), 'modal', True)
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
    bond_error: float | None
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
    contact_times: NDArray[np.float64]
    contact_speeds: NDArray[np.float64]
    mode_energies: NDArray[np.float64]
    velocities: NDArray[np.float64]
    displacements: NDArray[np.float64]
    details: dict[str, Any] = field(default_factory=dict)
    masses: tuple[float, ...] | None = None
    target_particles: int | None = None
    target_masses: tuple[float, ...] | None = None
    contact: str | None = None
    contact_stiffness: float | None = None
    contact_exponent: float | None = None
    initial: str | None = None
    compression: float | None = None
    temperature: float | None = None
    seed: int | None = None
    velocity_after: float | None = None
    target_velocity_after: float | None = None
    translational_energy: float | None = None
    vibrational_energy: float | None = None
    target_translational_energy: float | None = None
    target_vibrational_energy: float | None = None
    target_mode_energies: NDArray[np.float64] | None = None
    target_velocities: NDArray[np.float64] | None = None
    target_displacements: NDArray[np.float64] | None = None
    energy: str | None = None
    parameters: dict[str, float] | None = None
    stiffness: float | None = None
    natural_length: float | None = None
    replay: "Replay | None" = field(default=None, compare=False)

    def __repr__(self) -> str:
        return describe_shortly(self)

    def _repr_html_(self) -> str:
        return html_table(self)

    @property
    def plot(self) -> Plots:
        """Pictures: ``world_lines()``, ``spectrum()``, ``energy()``, ``contacts()`` and so on."""
        return Plots(self)

    def to_dict(self) -> dict[str, Any]:
        """Return all but the arrays, ready for JSON; numbers that are not finite become None."""
        return finite(self.plain())

    def plain(self) -> dict[str, Any]:
        """Return the same with all numbers as they are."""
        usual, rare = _names_told()
        values = vars(self)
        plain = {name: values[name] for name in usual}
        plain |= {name: values[name] for name in rare if values[name] is not None}
        plain["error_parts"] = dict(vars(self.error_parts))
        return plain

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """Return the arrays by field name, those of a free target among them."""
        names = ARRAY_FIELDS if self.target_particles is None else (*ARRAY_FIELDS, *TARGET_ARRAYS)
        return {name: getattr(self, name) for name in names}

    def save_arrays(self, path: Path) -> None:
        """Write the arrays to an NPZ file, aside first: an older one is not lost half-way."""
        with written_aside(Path(path), "arrays") as aside:
            write_arrays(aside, self.arrays())


@cache
def _names_told() -> tuple[list[str], list[str]]:
    """Return the fields that every result tells, and those told where there is something."""
    left_out = (*ARRAY_FIELDS, *TARGET_ARRAYS, "replay")
    defaults = {f.name: f.default for f in fields(Collision) if f.name not in left_out}
    rare = [name for name, default in defaults.items() if default is None]
    return [name for name in defaults if name not in rare], rare
