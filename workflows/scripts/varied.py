"""What a study varies, in how many runs a rung: read, checked, and turned into changes of runs."""

import random
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.ladder import (
    Ladder,
    check_phases,
    read_fixed,
    read_ladder,
    read_ranks,
)
from chaincor.workflows.scripts.script_text import ScriptText, check_variable, included

SEED = "seed"
DEFAULT_PHASES, PRINTED_PHASES = 4, 8
STEP, LAST_DIGIT, RANKS = "timestep", "lastdigit", "ranks"
_SETTINGS = ("cutoff", "skin", "rows")
_SEEDS = range(1, 9_999_999)


@dataclass(frozen=True)
class Varied:
    """What differs between the runs of a study."""

    script: ScriptText  #: The script.
    #: ``step``: the script's own, held apart from its run lengths; ``variable`` of the script;
    #: ``setting`` of its commands; or ``lastdigit`` and ``ranks``, whose runs are compared.
    kind: str
    #: What it takes; None where runs are compared, and of a step that is not known yet.
    values: Ladder | None
    ranks: tuple[int, ...]  #: Numbers of processes.
    #: Values of other variables, as text; the ladder is repeated at each.
    fixed: list[dict[str, str]]
    #: One for each run of a rung; empty where these are nearby values instead.
    seeds: tuple[int, ...]
    own_seed: bool  #: Whether the script has a variable ``seed``, that takes them.
    columns: int  #: Runs a rung.
    #: Whether thermostats and their like draw other numbers in each run: those of other steps are
    #: other ones anyway, and would hardly differ between nearby steps.
    random_forces: bool
    scale_periods: bool  #: Whether what the script counts in steps is held in time.
    #: The script's own step, of its last run, where that is varied and known.
    own_step: float | None = None

    @property
    def ladder(self) -> Ladder:
        """The ladder, of what has one."""
        assert self.values is not None
        return self.values

    def value(self, rung: int, column: int) -> float:
        """Return the value that one run has."""
        return self.ladder.value(rung, column, self.columns)

    def change(
        self, fixed: dict[str, str], rung: int, column: int, *, again: bool = False
    ) -> Change:
        """Return one phase or seed of a rung; `again`, the first one's value and another seed."""
        value = self.value(rung, column)
        given = {self.ladder.name: self.ladder.text(value)}
        seed = self.seeds[1 if again else column] if self.seeds else None
        named = {} if seed is None or not self.own_seed else {SEED: str(seed)}
        if self.random_forces:
            seed = rung * self.columns + column
        return Change(
            finer=1.0 if self.own_step is None else self.own_step / value,
            variables={**(given if self.kind == "variable" else {}), **fixed, **named},
            settings=given if self.kind == "setting" else {},
            seed=None if named else seed,
            forces_alone=self.random_forces,
            scale_periods=self.scale_periods,
        )


def read_varied(
    script: ScriptText,
    vary: str | None,
    fix: Sequence[str],
    seeds: int | None,
    phases: int | None,
    *,
    printed: bool,
    scale_periods: bool,
) -> Varied:
    """
    Read the options that say what is varied.

    `printed` says whether the number is one that the script prints. Raises InputError where an
    option makes no sense, or the script does not use a variable.
    """
    vary, seeds = _seeds_varied(vary, seeds)
    if seeds is not None and phases is not None:
        raise InputError("each seed has a phase of its own; expected seeds or phases: drop one")
    columns = PRINTED_PHASES if printed and vary is not None else DEFAULT_PHASES
    columns = next((given for given in (seeds, phases) if given is not None), columns)
    check_phases(columns, "--phases" if seeds is None else "--seeds")
    kind = _kind(script, vary)
    compared = kind in (LAST_DIGIT, RANKS)
    ladder = None if vary is None or compared else read_ladder(vary)
    if kind == "step" and ladder is not None and ladder.fine > ladder.coarse:
        raise InputError(
            f"--vary goes from {ladder.coarse:g} to {ladder.fine:g}; expected the coarse end "
            f"first: --vary {STEP}={ladder.fine:g}:{ladder.coarse:g}:{ladder.rungs}"
        )
    varied = Varied(
        script=script,
        kind=kind,
        values=ladder,
        ranks=read_ranks(str(vary)) if kind == RANKS else (),
        fixed=read_fixed(tuple(fix)),
        # Far from each other: neighbours begin alike in simple generators.
        seeds=() if seeds is None else tuple(random.Random(seeds).sample(_SEEDS, seeds)),
        own_seed=_has_variable(script, SEED),
        columns=columns,
        random_forces=seeds is None and (kind == "step" or _sets_step(script, ladder)),
        scale_periods=scale_periods,
    )
    _check_names(varied)
    return varied


def _seeds_varied(vary: str | None, seeds: int | None) -> tuple[str | None, int | None]:
    """Read ``--vary seed=N``, which is the ladder of steps with N seeds a rung."""
    found = re.fullmatch(r"seed(?:=(\d{1,3}))?", vary or "", re.ASCII)
    if not found:
        return vary, seeds
    if seeds is not None:
        raise InputError("--vary seed and --seeds are the same; expected one: drop the other")
    return None, int(found[1] or 2 * DEFAULT_PHASES)


def _kind(script: ScriptText, vary: str | None) -> str:
    if vary is None:
        return "step"
    name = vary.partition("=")[0]
    if _has_variable(script, name):
        return "variable"
    # What is used without being set is for -var.
    used = any(each.mentions(name) for each in included(script))
    if name == STEP:
        return "variable" if used else "step"
    if name in (LAST_DIGIT, RANKS):
        return name
    return "setting" if name in _SETTINGS and not used else "variable"


def _has_variable(script: ScriptText, name: str) -> bool:
    given = re.compile(rf"\s*variable\s+{re.escape(name)}\s+(?!delete)")
    return any(given.match(line) for each in included(script) for _, line in each.lines)


def _sets_step(script: ScriptText, ladder: Ladder | None) -> bool:
    """Return whether a variable is what the time step is."""
    if ladder is None:
        return False
    lines = [line for each in included(script) for line in each.lines if line[1].split()[0] == STEP]
    return replace(script, lines=tuple(lines)).mentions(ladder.name)


def _check_names(varied: Varied) -> None:
    """Raise InputError where a variable is given twice, or the script has none of the name."""
    names = list(varied.fixed[0])
    if varied.kind == "variable":
        names.append(varied.ladder.name)
    if varied.seeds and varied.own_seed:
        names.append(SEED)
    if len(set(names)) < len(names):
        raise InputError(
            f"{', '.join(sorted({n for n in names if names.count(n) > 1}))} is given twice; "
            "expected a variable to be varied, fixed, or the seed"
        )
    for name in names:
        check_variable(varied.script, name)
