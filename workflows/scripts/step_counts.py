"""What in a script counts steps instead of time, and so does something else at another step."""

import re
from dataclasses import dataclass

from chaincor.workflows.scripts.script_text import ScriptText

# Where each style of `fix` holds numbers of steps: words of the line, from 0. A second one must
# stay a multiple of the first.
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
# No period, and yet a limit or a rate for each step.
_PER_STEP = {
    "nve/limit": "limits how far particles move in one step",
    "dt/reset": "chooses the step itself",
    "pour": "inserts particles after a number of steps that it works out from the step",
}
# These do not change the motion: a mean of other samples, or a box that moves in finer jerks.
_ONLY_LOOK = ("ave/", "vector", "store/state", "balance")
_COUNTING = re.compile(r"(?<![\w.])(step|elapsed|elaplong)(?![\w(])")
_DAMPED = {"nvt": "temp", "npt": "temp", "nph": None, "nvt/sllod": "temp"}
# A damping time of fewer steps is no damping.
_LEAST_DAMPING = 10.0


@dataclass(frozen=True)
class StepCount:
    """A line that counts steps."""

    #: Where it stands.
    file: str
    number: int  #: See ``file``.
    what: str  #: Its command and style.
    says: str  #: What that does to a ladder of steps.
    moves: bool  #: Whether the motion depends on it; otherwise what is written does.
    periods: bool  #: Whether ``--scale-periods`` holds it in time.

    def __str__(self) -> str:
        return f"line {self.number} of {self.file}, '{self.what}', {self.says}"


def count_positions(words: list[str]) -> tuple[int, ...]:
    """Return which words of a command are numbers of steps; none where it counts none."""
    if len(words) < 4 or words[0] != "fix":
        return ()
    found = _FIXES.get(plain_style(words[3]), ())
    return found if found and len(words) > max(found) else ()


def find_step_counts(scripts: list[ScriptText], coarsest: float | None) -> list[StepCount]:
    """
    Return every line of scripts that counts steps.

    Parameters
    ----------
    scripts : list of ScriptText
        The script and what it includes.
    coarsest : float or None
        Largest step of the ladder, to compare damping times with.
    """
    found = []
    for script in scripts:
        for number, line in script.lines:
            words = line.split()
            told = _of_fix(words, coarsest) if words[0] == "fix" and len(words) > 3 else None
            told = told or _of_others(words, line)
            if told is not None:
                found.append(StepCount(script.path.name, number, *told))
    return found


_Told = tuple[str, str, bool, bool]


def _of_fix(words: list[str], coarsest: float | None) -> _Told | None:
    style = plain_style(words[3])
    what = f"fix {words[3]}"
    if style in _PER_STEP:
        return what, _PER_STEP[style], True, False
    if count_positions(words):
        only_looks = style.startswith(_ONLY_LOOK)
        period = " ".join(words[k] for k in count_positions(words))
        says = f"acts every {period} steps" if not only_looks else f"samples every {period} steps"
        if style == "halt":
            says = f"looks every {period} steps whether to end the run"
        return what, says, not only_looks, True
    damping = _damping(words)
    if coarsest is not None and damping is not None and damping < _LEAST_DAMPING * coarsest:
        return (
            what,
            f"damps within {damping:g}, fewer than {_LEAST_DAMPING:g} steps of {coarsest:g}",
            True,
            False,
        )
    return None


def _of_others(words: list[str], line: str) -> _Told | None:
    if words[0] == "neigh_modify":
        settings = dict(zip(words[1::2], words[2::2], strict=False))
        if settings.get("check") == "no" and settings.get("once") != "yes":
            return (
                "neigh_modify check no",
                "rebuilds neighbours after steps, not distances",
                True,
                True,
            )
    formula = words[0] == "variable" and words[2:3] in (["equal"], ["atom"], ["vector"])
    if formula and _COUNTING.search(" ".join(words[3:])):
        return f"variable {words[1]}", "uses the number of the step", True, False
    return None


def _damping(words: list[str]) -> float | None:
    """Return a thermostat's damping time where it is a plain number."""
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
    """Return a style without the suffix of its accelerated variant."""
    return re.sub(r"/(omp|kk|gpu|intel|opt)$", "", style)
