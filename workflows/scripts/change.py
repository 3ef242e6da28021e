"""What one run does otherwise than the script says."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Change:
    """What one run does otherwise than the script says."""

    finer: float = 1.0  #: Steps for each step of the script: 2 halves the step. 1 leaves it.
    #: What is sampled, as in formulas of LAMMPS: ``etotal``, ``c_1``, ``v_x``.
    quantities: tuple[str, ...] = ()
    #: Values of the script's own variables, as text.
    variables: Mapping[str, str] = field(default_factory=dict)
    #: Of ``cutoff``, ``skin`` and ``rows``: what they shall be, as text.
    settings: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None  #: Added to seeds.
    #: Whether only to those of what draws random numbers as the run goes on: a thermostat's, and
    #: not those that a start is drawn with.
    forces_alone: bool = False
    scale_periods: bool = False  #: Whether numbers of steps are held in time.
    #: Share of the box by which all particles are displaced before the first run.
    shaken: float = 0.0
    frames: bool = False  #: Whether positions are written with the samples.
    #: Whether a number is read from what the script prints, and all thermo output stays.
    printed: bool = False


AS_IT_STANDS = Change()
