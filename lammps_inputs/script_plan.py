"""What an input script is made of, besides the scene: chosen before LAMMPS runs it."""

from dataclasses import asdict, dataclass
from typing import Any

from chaincor.lammps_inputs.bond_table import BondTable
from chaincor.lammps_inputs.contact_script import number
from chaincor.lammps_inputs.numerics import Numerics


@dataclass(frozen=True)
class ScoutedEnd:
    """
    How a collision ended that a script runs again.

    Attributes
    ----------
    last_contact_time : float
        From the first contact.
    contacts : int
        Hits on the wall.
    ending : str
        ``proved``, ``argued`` or ``open``.
    """

    last_contact_time: float
    contacts: int
    ending: str


@dataclass(frozen=True)
class EndTimes:
    """
    When a script ends by itself.

    Attributes
    ----------
    quiet : float
        Time without a contact after which the collision is over.
    cap : float
        Simulated time at which an unfinished collision is given up.
    look : float
        Time between two looks for the end.
    """

    quiet: float
    cap: float
    look: float


@dataclass(frozen=True)
class ScriptedSteps:
    """
    How a script composes its steps.

    Attributes
    ----------
    weights : tuple of float
        w_k of the Verlet steps w_k H, a palindrome.
    order : int
        Order of the error of one run against H.
    citation : str
        Where the weights are from.
    coarse : float
        Verlet step in which a silence is waited for.
    patience : float
        Time after a contact from which on a silence is waited for so.
    graded : tuple of float or None
        Time near the touching and parting of soft bodies in which steps are graded, and the power
        of that; None where they are not.
    """

    weights: tuple[float, ...]
    order: int
    citation: str
    coarse: float
    patience: float
    graded: tuple[float, float] | None = None

    @property
    def heaviest(self) -> float:
        """The longest of its Verlet steps, in units of H."""
        return max(map(abs, self.weights))


@dataclass(frozen=True)
class ScriptedBar:
    """
    What a script needs to tell the error of its number.

    Attributes
    ----------
    multiples : tuple of float
        Steps of the runs in units of the number's own; the first is 1.
    share : float
        Error of the number due to its step, over the largest difference to the other runs.
    share_alone : float
        The same where nothing but these runs is known.
    table, rounding, ending : float
        Parts of the error that are known beforehand.
    reference_solution, reference_error : float or None
        Restitution of an in-house run, and its error; None where there was none.
    """

    multiples: tuple[float, ...]
    share: float
    share_alone: float
    table: float
    rounding: float
    ending: float
    reference_solution: float | None = None
    reference_error: float = 0.0

    def numbers(self) -> dict[str, Any]:
        """Return the fields as text for a script."""
        fields = {k: v for k, v in asdict(self).items() if k != "multiples"}
        return {k: None if v is None else number(v) for k, v in fields.items()}


@dataclass(frozen=True)
class ScriptPlan:
    """
    What was chosen for a script of a scene, all in units of the chain.

    Attributes
    ----------
    numerics : Numerics
        Wall, scheme and step.
    table : BondTable or None
        The bonds; None for LAMMPS's own harmonic one.
    end : ScoutedEnd or None
        How the same collision ended elsewhere: the script does not end before; None where that is
        not known.
    bar : ScriptedBar or None
        How the script tells its error, which takes further runs; None for the number alone.
    tolerance : float or None
        What the numerics were chosen for, to be said in the heading.
    fastest : float or None
        Largest velocity that is not refused, up to which the table is expected to hold the bonds;
        None for that of the scene.
    """

    numerics: Numerics
    table: BondTable | None
    end: ScoutedEnd | None = None
    bar: ScriptedBar | None = None
    tolerance: float | None = None
    fastest: float | None = None
