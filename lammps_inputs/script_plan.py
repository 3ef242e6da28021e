"""What an input script is made of, besides the scene: chosen for it, and wished by a user."""

from dataclasses import dataclass

from chaincor.lammps_inputs.bond_table import BondTable
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem


@dataclass(frozen=True)
class ScoutedEnd:
    """How a collision ended that a script runs again."""

    last_contact_time: float  #: From the first contact.
    contacts: int  #: Hits on the wall.
    ending: str  #: ``proved``, ``argued`` or ``open``.


@dataclass(frozen=True)
class EndTimes:
    """When a script ends by itself, in its own units."""

    quiet: float  #: Time without a contact after which the collision is over.
    cap: float  #: Simulated time at which an unfinished collision is given up.
    look: float  #: Time between two looks for the end.


@dataclass(frozen=True)
class ScriptedSteps:
    """How a script composes its steps; times are in its own units."""

    weights: tuple[float, ...]  #: w_k of the Verlet steps w_k H, a palindrome.
    order: int  #: Order of the error of one run against H.
    citation: str  #: Where the weights are from.
    coarse: float  #: Verlet step in which a silence is waited for.
    patience: float  #: Time after a contact from which on a silence is waited for so.
    #: Time near the touching and parting of soft bodies in which steps are graded, and the power of
    #: that; None where they are not.
    graded: tuple[float, float] | None = None

    @property
    def heaviest(self) -> float:
        """The longest of its Verlet steps, in units of H."""
        return max(map(abs, self.weights))


@dataclass(frozen=True)
class ScriptedBar:
    """What a script needs to tell the error of its number."""

    multiples: tuple[float, ...]  #: Steps of the runs in units of the number's own; the first is 1.
    #: Error of the number due to its step, over the largest difference to the other runs.
    share: float
    share_alone: float  #: The same where nothing but these runs is known.
    #: Parts of the error that are known beforehand.
    table: float
    rounding: float  #: See ``table``.
    ending: float  #: See ``table``.
    #: Restitution of an in-house run, and its error; None where there was none.
    reference_solution: float | None = None
    reference_error: float = 0.0  #: See ``reference_solution``.


@dataclass(frozen=True)
class ScriptPlan:
    """What was chosen for a script of a scene, all in units of the chain."""

    numerics: Numerics  #: Wall, scheme and step.
    table: BondTable | None  #: The bonds; None for LAMMPS's own harmonic one.
    #: How the same collision ended elsewhere: the script does not end before; None where that is
    #: not known.
    end: ScoutedEnd | None = None
    #: How the script tells its error, which takes further runs; None for the number alone.
    bar: ScriptedBar | None = None
    tolerance: float | None = None  #: What the numerics were chosen for, to be said in the heading.
    #: Largest velocity that is not refused, up to which the table is expected to hold the bonds;
    #: None for that of the scene.
    fastest: float | None = None
    #: Hash of the scene that the job runs, which a guarded job prints; None to print none.
    scene_sha256: str | None = None


@dataclass(frozen=True)
class JobWishes:
    """What a user wants of a job."""

    plain: bool = False  #: The shortest script: LAMMPS's own commands alone, without an error bar.
    explain: bool = False  #: Every command and file says what it is for.
    dump: bool = False  #: The job dumps its motion, in the frames of the scene.
    contacts: bool = False  #: It lists its contacts in a file.
    restartable: bool = False  #: It writes restart files and goes on from them.
    #: It refuses by name what it is not made for, and holds the momentum of the chain against what
    #: its contacts gave.
    guards: bool = False
    #: Bond lengths that the table shall hold at least.
    table_range: tuple[float, float] | None = None
    template: OwnTemplate | None = None  #: What the user adds to the script, or a whole script.
    units: UnitSystem = CHAIN_UNITS  #: In which LAMMPS computes.

    @property
    def whole(self) -> OwnTemplate | None:
        """The template, where it is a whole script."""
        return self.template if self.template is not None and self.template.whole else None


NO_WISHES = JobWishes()
