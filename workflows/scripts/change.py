"""What one run does otherwise than the script says."""

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Change:
    """
    What one run does otherwise than the script says.

    Attributes
    ----------
    finer : float
        Steps for each step of the script: 2 halves the step. 1 leaves it.
    quantities : tuple of str
        What is sampled, as in formulas of LAMMPS: ``etotal``, ``c_1``, ``v_x``.
    variables : dict
        Values of the script's own variables, as text.
    settings : dict
        Of ``cutoff``, ``skin`` and ``rows``: what they shall be, as text.
    seed : int or None
        Added to seeds.
    forces_alone : bool
        Whether only to those of what draws random numbers as the run goes on: a thermostat's, and
        not those that a start is drawn with.
    scale_periods : bool
        Whether numbers of steps are held in time.
    shaken : float
        Share of the box by which all particles are displaced before the first run.
    frames : bool
        Whether positions are written with the samples.
    printed : bool
        Whether a number is read from what the script prints, and all thermo output stays.
    """

    finer: float = 1.0
    quantities: tuple[str, ...] = ()
    variables: Mapping[str, str] = field(default_factory=dict)
    settings: Mapping[str, str] = field(default_factory=dict)
    seed: int | None = None
    forces_alone: bool = False
    scale_periods: bool = False
    shaken: float = 0.0
    frames: bool = False
    printed: bool = False


AS_IT_STANDS = Change()
