"""What a user wants of a job, besides the collision: its form, and what it does besides."""

from dataclasses import dataclass

from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem


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
