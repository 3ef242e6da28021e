"""What a run costs, from measurements: for forecasts, and steps that fit into a time limit."""

import json
import math
import sys
from dataclasses import asdict, dataclass, replace
from functools import cache
from importlib import resources
from pathlib import Path

from platformdirs import user_config_path

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.engines.time_limit import time_limit

_FILE = "cost_model.json"
# The run of LAMMPS that gives the number, and the proof of it at twice the step; and how much of
# the time that is left they may be expected to take: forecasts are good to a factor of two.
LAMMPS_RUNS = 1.5
_TIME_SHARE = 0.5
# Before each Verlet step Python looks where bodies of unequal masses are, as no bound tells when
# they meet: so many stages' time, 15 to 20 us where one is 1.9.
_LOOK = 8.0


@dataclass(frozen=True)
class CostModel:
    """Seconds taken by the parts of a LAMMPS run."""

    measured_on: str  #: Date and machine of the measurement.
    step: float  #: One Verlet step inside a run, apart from its bonds.
    #: One bond in one step, by kind of bond.
    harmonic_bond: float
    linear_bond: float  #: See ``harmonic_bond``.
    spline_bond: float  #: See ``harmonic_bond``.
    #: Added by one stage of a composition, or one part of an extrapolated step: a ``run`` command,
    #: and what makes its Verlet steps longer or shorter.
    stage: float
    #: Added by one contact with Verlet: blind windows, the shortened step, the reversal.
    contact: float

    def integration(self, scene: Scene, numerics: Numerics, duration: float) -> float:
        """
        Return the expected seconds of integrating some simulated time.

        LAMMPS flies little farther than to the last contact.
        """
        harmonic = scene.bond.is_harmonic
        per_bond = self.harmonic_bond if harmonic else getattr(self, f"{numerics.table}_bond")
        scheme = STEP_SCHEMES[numerics.scheme]
        # A free target has bonds of its own, and meets no more often than its shorter body allows.
        targets = scene.target_particles or 0
        bonds = scene.particles - 1 + max(targets - 1, 0)
        contacts = 0.9 * (min(scene.particles, targets) if targets else scene.particles)
        per_step = scheme.evaluations * (self.step + per_bond * bonds)
        steps = duration / numerics.timestep
        if numerics.scheme == "verlet":
            if not scene.line.plain:
                per_step += _LOOK * self.stage
            return steps * per_step + contacts * self.contact
        # A contact costs about one more step.
        return (steps + contacts) * (per_step + scheme.runs * self.stage)

    def save(self, path: Path) -> None:
        """Write the model; the file's folder is made."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(asdict(self), indent=2) + "\n")


def user_cost_model_path() -> Path:
    """Return where ``chaincor tradeoff --calibrate`` keeps this machine's model."""
    return user_config_path("chaincor") / _FILE


@cache
def cost_model() -> CostModel:
    """
    Return this machine's model, or the one that comes with the program.

    Where the file of this machine cannot be used, one line on stderr says so.
    """
    path = user_cost_model_path()
    try:
        return CostModel(**json.loads(path.read_text()))
    except FileNotFoundError:
        pass
    except (OSError, ValueError, TypeError) as error:
        print(
            f"chaincor: the cost model {path} cannot be used ({error}); expected what `chaincor "
            "tradeoff --calibrate` writes: forecasts use the one that comes with the program",
            file=sys.stderr,
        )
    return shipped_cost_model()


def shipped_cost_model() -> CostModel:
    """Return the model that comes with the program."""
    return CostModel(
        **json.loads(resources.files("chaincor.workflows.accuracy").joinpath(_FILE).read_text())
    )


def within_time(scene: Scene, numerics: Numerics, duration: float, longest: float) -> Numerics:
    """
    Return numerics with a longer step where runs over a duration would take too long.

    That is where the collision has a limit; `longest` is a step that is stable.
    """
    limit = time_limit()
    if limit.end == math.inf:
        return numerics
    expected = LAMMPS_RUNS * cost_model().integration(scene, numerics, duration)
    available = max(_TIME_SHARE * limit.left, 1e-3)
    if expected <= available:
        return numerics
    limit.was_short = True
    longer = min(numerics.timestep * expected / available, longest)
    return replace(numerics, timestep=max(longer, numerics.timestep))
