"""Define what determines an input script besides the scene: the plan, and the user's options."""

from dataclasses import dataclass

from chaincor.lammps_inputs.bond_table import BondTable
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem


@dataclass(frozen=True)
class ExpectedEnd:
    """End of a collision in a pilot run. The script repeats this collision."""

    last_contact_time: float  #: Time from the first contact to the last.
    contacts: int  #: Number of contacts with the wall.
    ending: str  #: End of the collision: ``proved``, ``argued`` or ``open``.
    #: Time from the initial state to the end of the last contact; 0 if unknown.
    lasted: float = 0.0
    bond_min: float = 1.0  #: Shortest bond up to the last contact.


@dataclass(frozen=True)
class EndTimes:
    """Times that determine when a script ends, in the script's units."""

    quiet: float  #: Time without a contact after which the collision is over.
    cap: float  #: Simulated time at which the script stops an unfinished collision.
    look: float  #: Time between two checks for the end.


@dataclass(frozen=True)
class ScriptedSteps:
    """Composed steps of a script, each a sequence of Verlet steps, in the script's units."""

    weights: tuple[float, ...]  #: Weights w_k of the Verlet steps w_k H; they are symmetric.
    order: int  #: Order in H of the error of one run.
    citation: str  #: Source of the weights.
    #: Verlet step that the script takes when no contact has come for the time `patience`.
    coarse: float
    patience: float  #: Time after a contact at which the script changes to the step `coarse`.
    #: Steps are graded near the begin and the end of a contact of soft bodies. The first number is
    #: the duration of the grading, and the second its power. It is None without grading.
    graded: tuple[float, float] | None = None

    @property
    def heaviest(self) -> float:
        """Longest Verlet step of the composition, in units of H."""
        return max(map(abs, self.weights))


@dataclass(frozen=True)
class ScriptedBar:
    """Data from which a script computes the error bar of its result."""

    #: Steps of all runs, in units of the step of the result; the first is 1.
    multiples: tuple[float, ...]
    #: Error of the result due to the time step, divided by the largest difference from another run,
    #: including a reference run.
    share: float
    share_alone: float  #: The same ratio, without a reference run.
    #: Error due to the bond table, computed before the run.
    table: float
    rounding: float  #: Error due to rounding, computed before the run.
    ending: float  #: Error due to later contacts, computed before the run.
    #: Restitution of a run of the reference engine; None without such a run.
    reference_solution: float | None = None
    reference_error: float = 0.0  #: Error of `reference_solution`.


@dataclass(frozen=True)
class ScriptPlan:
    """Choices for the script of a scene, in units of the chain."""

    numerics: Numerics  #: Wall, scheme and step.
    table: BondTable | None  #: Table of the bonds; None for LAMMPS's own harmonic bond.
    #: End of the same collision in a pilot run, or None. The script does not end earlier.
    end: ExpectedEnd | None = None
    #: Data for the error bar, for which the script makes further runs; None for a script without
    #: error bar.
    bar: ScriptedBar | None = None
    #: Tolerance for which the numerics were chosen, printed in the heading.
    tolerance: float | None = None
    #: Largest velocity that the script accepts. The table is expected to be wide enough for it. By
    #: default it is the velocity of the scene.
    fastest: float | None = None
    #: Reason why the job may miss the tolerance; None if it is expected to reach the tolerance.
    doubt: str | None = None
    #: Hash of the scene, which a guarded job prints; None to print no hash.
    scene_sha256: str | None = None


@dataclass(frozen=True)
class JobWishes:
    """Options of a job that the user chooses."""

    #: Whether to write the shortest script, with LAMMPS's own commands and no error bar.
    plain: bool = False
    explain: bool = False  #: Whether to explain every command and file.
    dump: bool = False  #: Whether the job dumps its motion, in the frames of the scene.
    #: Time between frames; None for frames at contacts.
    frame_interval: float | None = None
    contacts: bool = False  #: Whether the job lists its contacts in a file.
    restartable: bool = False  #: Whether the job writes restart files and can continue from them.
    #: Whether the job refuses unsuitable inputs with a message, and compares the chain's momentum
    #: with the impulses of its contacts.
    guards: bool = False
    #: Bond lengths that the table must cover.
    table_range: tuple[float, float] | None = None
    template: OwnTemplate | None = None  #: Additions of the user to the script, or a whole script.
    units: UnitSystem = CHAIN_UNITS  #: Units in which LAMMPS computes.

    @property
    def whole(self) -> OwnTemplate | None:
        """Template of the user, if it is a whole script; else None."""
        return self.template if self.template is not None and self.template.whole else None


NO_WISHES = JobWishes()
