"""What a study varies: the ladder of values, in how many runs each, and what else differs."""

import math
import random
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

from chaincor.analysis.ladders.verdict import LEAST_COLUMNS, LEAST_RUNGS
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.script_text import ScriptText

SEED = "seed"
DEFAULT_PHASES, PRINTED_PHASES = 4, 8
STEP, LAST_DIGIT, RANKS = "timestep", "lastdigit", "ranks"
_SETTINGS = ("cutoff", "skin", "rows")
# Nearby values of one rung lie within this share of it on either side.
PHASE_WIDTH = 0.02
_GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
# What is tried of a script's own step where nobody says what: so many times it, to so many.
_OWN_COARSE, _OWN_RUNGS = 2.0, 4

_MOST_RUNGS, _MOST_PHASES, _MOST_FIXED, _MOST_RANKS = 40, 100, 100, 64
# A ladder of less says nothing of an order.
_LEAST_SPAN = 2.0
# Variables are counts, and rounded, where both ends are whole numbers of this size at least.
_LEAST_COUNT = 100
# Far from each other: neighbours begin alike in simple generators.
_SEEDS = range(1, 9_999_999)
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}", re.ASCII)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d{1,3})?", re.ASCII)


@dataclass(frozen=True)
class Ladder:
    """Values of one variable, from coarse to fine in equal ratios."""

    name: str  #: The LAMMPS variable.
    #: Its ends.
    coarse: float
    fine: float  #: See ``coarse``.
    rungs: int  #: How many values.
    counts: bool = False  #: Whether they are whole numbers.

    def value(self, rung: int, phase: int, phases: int) -> float:
        """
        Return the value of one run.

        Phase 0 is the rung itself. The others lie around it by multiples of the golden ratio, which
        fill the width evenly and never share a phase of the step.
        """
        share = rung / (self.rungs - 1)
        value = self.coarse ** (1.0 - share) * self.fine**share
        if phase > 0:
            place = ((rung * phases + phase) * _GOLDEN) % 1.0
            value *= 1.0 + PHASE_WIDTH * (2.0 * place - 1.0)
        elif rung in (0, self.rungs - 1):
            value = self.fine if rung else self.coarse
        return float(round(value)) if self.counts else float(f"{value:.6g}")

    def text(self, value: float) -> str:
        """Return a value as it is given to LAMMPS."""
        return str(int(value)) if self.counts else repr(value)

    def step(self, value: float) -> float:
        """Return what shrinks towards the fine end: the value, or its inverse where it grows."""
        return value if self.fine < self.coarse else 1.0 / value


def ladder_around(step: float, coarser: float = _OWN_COARSE) -> Ladder:
    """Return the ladder of steps around a script's own, each half of the one before."""
    coarse = coarser * step
    return Ladder(STEP, coarse, coarse * 0.5 ** (_OWN_RUNGS - 1), _OWN_RUNGS)


@dataclass(frozen=True)
class Varied:
    """What differs between the runs of a study."""

    script: ScriptText
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
    columns: int  #: Runs a rung.
    scale_periods: bool  #: Whether what the script counts in steps is held in time.
    #: The script's own step, of its last run, where that is varied and known.
    own_step: float | None = None

    @property
    def ladder(self) -> Ladder:
        """The ladder, of what has one."""
        assert self.values is not None
        return self.values

    @cached_property
    def own_seed(self) -> bool:
        """Whether the script has a variable ``seed``, that takes the seeds."""
        return _has_variable(self.script, SEED)

    @cached_property
    def random_forces(self) -> bool:
        """
        Whether thermostats and their like draw other numbers in each run.

        Those of other steps are other ones anyway, and would hardly differ between nearby steps.
        """
        named = self.values is not None and self.script.mentions(self.values.name, of=STEP)
        return not self.seeds and (self.kind == "step" or named)

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

    def check_names(self) -> None:
        """Raise InputError where a variable is given twice, or the script has none of the name."""
        names = list(self.fixed[0])
        if self.kind == "variable":
            names.append(self.ladder.name)
        if self.seeds and self.own_seed:
            names.append(SEED)
        if len(set(names)) < len(names):
            raise InputError(
                f"{', '.join(sorted({n for n in names if names.count(n) > 1}))} is given twice; "
                "expected a variable to be varied, fixed, or the seed"
            )
        for name in names:
            self.script.check_variable(name)


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
    if by_seeds := re.fullmatch(r"seed(?:=(\d{1,3}))?", vary or "", re.ASCII):
        # The ladder of steps with so many seeds a rung.
        if seeds is not None:
            raise InputError("--vary seed and --seeds are the same; expected one: drop the other")
        vary, seeds = None, int(by_seeds[1] or 2 * DEFAULT_PHASES)
    if seeds is not None and phases is not None:
        raise InputError("each seed has a phase of its own; expected seeds or phases: drop one")
    columns = PRINTED_PHASES if printed and vary is not None else DEFAULT_PHASES
    columns = next((given for given in (seeds, phases) if given is not None), columns)
    if not LEAST_COLUMNS <= columns <= _MOST_PHASES:
        raise InputError(
            f"{'--phases' if seeds is None else '--seeds'} is {columns}; expected {LEAST_COLUMNS} "
            f"to {_MOST_PHASES} runs a rung: with fewer, no scatter can be told"
        )
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
        seeds=() if seeds is None else tuple(random.Random(seeds).sample(_SEEDS, seeds)),
        columns=columns,
        scale_periods=scale_periods,
    )
    varied.check_names()
    return varied


def _kind(script: ScriptText, vary: str | None) -> str:
    if vary is None:
        return "step"
    name = vary.partition("=")[0]
    # What is used without being set is for -var.
    if _has_variable(script, name) or (name in (STEP, *_SETTINGS) and script.mentions(name)):
        return "variable"
    special = {STEP: "step", LAST_DIGIT: LAST_DIGIT, RANKS: RANKS}
    return "setting" if name in _SETTINGS else special.get(name, "variable")


def _has_variable(script: ScriptText, name: str) -> bool:
    return any(command.words[2] != "delete" for command in script.of_variable(name))


def read_ladder(text: str) -> Ladder:
    """
    Read ``NAME=FROM:TO:COUNT``, FROM the coarse end and TO the fine one.

    Raises InputError where it is anything else.
    """
    expected = "expected NAME=FROM:TO:COUNT, coarse end first, such as timestep=0.01:0.0005:8"
    name, equals, rest = text.partition("=")
    parts = rest.split(":")
    if not equals or len(parts) != 3:
        raise InputError(f"--vary is {text!r}; {expected}")
    _check_name(name, "--vary")
    coarse, fine = (_read_number(part, "--vary") for part in parts[:2])
    if not re.fullmatch(r"\d{1,3}", parts[2], re.ASCII):
        raise InputError(f"--vary counts {parts[2]!r} values; {expected}")
    rungs = int(parts[2])
    if not LEAST_RUNGS <= rungs <= _MOST_RUNGS:
        raise InputError(
            f"--vary counts {rungs} values; expected {LEAST_RUNGS} to {_MOST_RUNGS}: with fewer, "
            "no order can be told"
        )
    if coarse <= 0.0 or fine <= 0.0 or max(coarse, fine) / min(coarse, fine) < _LEAST_SPAN:
        raise InputError(
            f"--vary goes from {parts[0]} to {parts[1]}; expected positive values, a factor of "
            f"{_LEAST_SPAN:g} apart at least"
        )
    whole = all(part.isdecimal() and int(part) >= _LEAST_COUNT for part in parts[:2])
    return Ladder(name, coarse, fine, rungs, whole)


def read_fixed(texts: tuple[str, ...]) -> list[dict[str, str]]:
    """
    Read ``NAME=VALUE,VALUE`` options: returns every combination, as text for LAMMPS.

    Raises InputError where they are anything else, or name a variable twice.
    """
    names: dict[str, list[str]] = {}
    for text in texts:
        name, equals, rest = text.partition("=")
        if not equals or not rest:
            raise InputError(
                f"--fix is {text!r}; expected NAME=VALUE,VALUE, such as rows=1000,10000"
            )
        _check_name(name, "--fix")
        if name in names:
            raise InputError(f"--fix names {name!r} twice; expected each once: join the values")
        names[name] = rest.split(",")
        for value in names[name]:
            _read_number(value, "--fix")
    found = [dict(zip(names, each, strict=True)) for each in product(*names.values())]
    if len(found) > _MOST_FIXED:
        raise InputError(
            f"--fix makes {len(found)} ladders; expected {_MOST_FIXED} at most: give fewer values"
        )
    return found


def read_ranks(vary: str) -> tuple[int, ...]:
    """Read ``ranks=1,2,4``; raises InputError for anything else."""
    text = vary.partition("=")[2]
    if not re.fullmatch(r"\d{1,2}(,\d{1,2})+", text, re.ASCII):
        raise InputError(f"--vary is {vary!r}; expected two numbers of processes: ranks=1,2,4")
    ranks = tuple(int(word) for word in text.split(","))
    if not all(1 <= each <= _MOST_RANKS for each in ranks) or len(set(ranks)) < len(ranks):
        raise InputError(f"--vary is {vary!r}; expected numbers from 1 to {_MOST_RANKS}, each once")
    return ranks


def _check_name(name: str, option: str) -> None:
    if not _NAME.fullmatch(name):
        raise InputError(
            f"{option} names the variable {name!r}; expected letters, digits and underscores, such "
            "as timestep"
        )


def _read_number(text: str, option: str) -> float:
    if not _NUMBER.fullmatch(text) or not math.isfinite(float(text)):
        raise InputError(f"{option} holds {text!r}; expected a number, such as 0.01 or 1e-3")
    return float(text)
