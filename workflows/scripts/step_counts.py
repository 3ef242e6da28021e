"""Find script commands whose effect depends on the number of steps instead of the time."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from chaincor.workflows.scripts.script_text import Command, ScriptText

# For each style of `fix`, this table gives the positions of the words that are numbers of steps.
# Positions are counted from 0. A second number must stay a multiple of the first number.
_FIXES: dict[str, tuple[int, ...]] = {
    **dict.fromkeys(
        (
            *("temp/rescale", "deform", "adapt", "adapt/fep", "halt", "momentum", "momentum/chunk"),
            *("evaporate", "bond/create", "bond/break", "bond/swap", "gcmc", "widom", "atom/swap"),
            *("mol/swap", "heat", "thermal/conductivity", "viscosity", "srd", "vector"),
            *("store/state", "balance", "qeq/point", "qeq/shielded", "qeq/slater", "qeq/dynamic"),
            *("qeq/fire", "qeq/reaxff", "qeq/comb"),
        ),
        (4,),
    ),
    **dict.fromkeys(
        (
            *("ave/time", "ave/atom", "ave/chunk", "ave/grid", "ave/histo", "ave/histo/weight"),
            *("ave/correlate", "ave/correlate/long"),
        ),
        (4, 6),
    ),
    "deposit": (6,),
}
# The effect of these styles depends on the time step, but they have no period.
_PER_STEP = {
    "nve/limit": "limits how far particles move in one step",
    "pour": "inserts particles after a number of steps that it works out from the step",
}
# A change in the period of these styles hardly affects the motion.
_ONLY_LOOK = ("ave/", "vector", "store/state", "balance")
_COUNTING = re.compile(r"(?<![\w.])(step|elapsed|elaplong)(?![\w(])")
_DAMPED = {"nvt": "temp", "npt": "temp", "nph": None, "nvt/sllod": "temp"}
# A damping time should be at least this many steps.
_LEAST_DAMPING = 10.0


@dataclass(frozen=True)
class StepCount:
    """Script command whose effect depends on the number of steps."""

    command: Command
    what: str  #: Name and style of the command.
    says: str  #: Effect of the command, as a clause for a sentence.
    moves: bool = (
        True  #: Whether the command affects the motion; otherwise it affects only the output.
    )
    periods: bool = False  #: Whether ``--scale-periods`` keeps the simulated time of its period.

    def __str__(self) -> str:
        return f"{self.command}, '{self.what}', {self.says}"


def count_positions(words: list[str]) -> tuple[int, ...]:
    """Return the positions of those words in a command that are numbers of steps."""
    if words[0] == "neigh_modify":
        return tuple(k + 1 for k in range(1, len(words) - 1, 2) if words[k] in ("every", "delay"))
    if len(words) < 4 or words[0] != "fix":
        return ()
    found = _FIXES.get(plain_style(words[3]), ())
    return found if found and len(words) > max(found) else ()


def find_step_counts(script: ScriptText, coarsest: float | None) -> tuple[StepCount, ...]:
    """
    Return all script commands whose effect depends on the number of steps.

    `coarsest` is the largest timestep of a study. If it is given, the result includes thermostats
    with a damping time that is too short for this timestep.
    """
    found = (_of_fix(each, coarsest) or _of_others(each) for each in script.commands)
    return tuple(filter(None, found))


def periods_in_steps(counts: Iterable[StepCount]) -> Iterator[StepCount]:
    """Return the commands with a period in steps that affects the motion."""
    return (count for count in counts if count.moves and count.periods)


def _of_fix(command: Command, coarsest: float | None) -> StepCount | None:
    words = command.words
    if words[0] != "fix" or len(words) < 4:
        return None
    style, what = plain_style(words[3]), f"fix {words[3]}"
    if style in _PER_STEP:
        return StepCount(command, what, _PER_STEP[style])
    if positions := count_positions(words):
        only_looks = style.startswith(_ONLY_LOOK)
        first, last = _every(words[positions[0]]), _every(words[positions[-1]])
        says = f"{'samples' if only_looks else 'acts'} {first}"
        if first != last:
            says += f" and writes {last}"
        if style == "halt":
            says = f"checks {first} whether to end the run"
        return StepCount(command, what, says, not only_looks, periods=True)
    damping = _damping(words)
    if coarsest is not None and damping is not None and damping < _LEAST_DAMPING * coarsest:
        says = f"damps within {damping:g}, fewer than {_LEAST_DAMPING:g} steps of {coarsest:g}"
        return StepCount(command, what, says)
    return None


def _every(period: str) -> str:
    """Return a period in steps as text."""
    return "every step" if period == "1" else f"every {period} steps"


def _of_others(command: Command) -> StepCount | None:
    words = command.words
    if words[0] == "neigh_modify":
        settings = dict(zip(words[1::2], words[2::2], strict=False))
        if settings.get("check") == "no" and settings.get("once") != "yes":
            says = "rebuilds neighbours after steps, not distances"
            return StepCount(command, "neigh_modify check no", says, periods=True)
    formula = words[0] == "variable" and words[2:3] in (["equal"], ["atom"], ["vector"])
    if formula and _COUNTING.search(" ".join(words[3:])):
        return StepCount(
            command,
            f"variable {words[1]}",
            "uses the number of the step instead of the time",
        )
    return None


def _damping(words: list[str]) -> float | None:
    """Return a thermostat's damping time; None if it is no plain number."""
    style = plain_style(words[3])
    try:
        if style in ("langevin", "temp/berendsen", "temp/csvr", "temp/csld"):
            return float(words[6])
        if style in _DAMPED and _DAMPED[style] in words:
            return float(words[words.index(str(_DAMPED[style])) + 3])
    except (IndexError, ValueError):
        pass
    return None


def plain_style(style: str) -> str:
    """Return the name of a style without the suffix of an accelerated variant."""
    return re.sub(r"/(omp|kk|gpu|intel|opt)$", "", style)
