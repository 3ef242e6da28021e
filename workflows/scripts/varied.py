"""
Define how the runs of a `timestep` study differ.

The options are read into a ladder, runs per rung or a comparison, which give the change of each
run.
"""

import random
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from chaincor.analysis.ladders.verdict import LEAST_COLUMNS
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.ladder import STEP, Ladder
from chaincor.workflows.scripts.script_text import ScriptText
from chaincor.workflows.scripts.vary_options import (
    in_whole_numbers,
    read_fixed,
    read_ladder,
    read_ranks,
    read_switch,
)

SEED = "seed"
DEFAULT_PHASES, PRINTED_PHASES = 4, 8
LAST_DIGIT, RANKS, RESTART, SWITCH = "lastdigit", "ranks", "restart", "switch"
# For these kinds of variation, there is no ladder, and each run is compared with the first run.
COMPARED = (LAST_DIGIT, RANKS, RESTART, SWITCH)
_ROWS = "rows"
_SETTINGS = ("cutoff", "skin", _ROWS)
_MOST_PHASES = 100
# Seeds are chosen far apart, because simple generators begin with similar numbers for close seeds.
_SEEDS = range(1, 9_999_999)


@dataclass(frozen=True)
class Varied:
    """Description of how the runs of a study differ."""

    script: ScriptText
    #: ``step``, ``variable`` of the script, ``setting`` of its commands, or one of COMPARED.
    kind: str
    #: Ladder; None if runs are compared, or if the script's own step is still unknown.
    values: Ladder | None
    #: Name and values of the setting in compared runs: process counts, or values of a variable.
    switch: tuple[str, tuple[str, ...]]
    #: Combinations of values of other variables, as text. The ladder is repeated at each
    #: combination.
    fixed: list[dict[str, str]]
    #: Seeds of the runs on a rung; empty if the runs differ by nearby values.
    seeds: tuple[int, ...]
    columns: int  #: Number of runs per rung.
    scale_periods: (
        bool  #: Whether periods that the script counts in steps keep their simulated time.
    )
    #: The script's own steps, if the step is varied and they are known.
    own_steps: tuple[float, ...] = ()

    @property
    def own_step(self) -> float | None:
        """The script's own step in its last run; None if it is unknown."""
        return self.own_steps[-1] if self.own_steps else None

    @property
    def ladder(self) -> Ladder:
        """Ladder, in a study that is known to have one."""
        assert self.values is not None
        return self.values

    @cached_property
    def own_seed(self) -> bool:
        """Whether the script has a variable ``seed``, which then takes the seeds."""
        return _has_variable(self.script, SEED)

    @cached_property
    def random_forces(self) -> bool:
        """
        Whether each run has its own random forces without an option for seeds.

        Otherwise the random forces at nearby steps would hardly differ.
        """
        named = self.values is not None and self.script.mentions(self.values.name, of=STEP)
        return not self.seeds and (self.kind == "step" or named)

    def value(self, rung: int, column: int) -> float:
        """Return the value of the varied setting in one run."""
        return self.ladder.value(rung, column, self.columns)

    def change(
        self, fixed: dict[str, str], rung: int, column: int, *, again: bool = False
    ) -> Change:
        """Return the changes for one run; `again` repeats the first value with another seed."""
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
        """Raise InputError if a variable is given twice or does not occur in the script."""
        names = list(self.fixed[0])
        if self.kind == "variable":
            names.append(self.ladder.name)
        if self.kind == SWITCH:
            names.append(self.switch[0])
        if self.seeds and self.own_seed:
            names.append(SEED)
        if len(set(names)) < len(names):
            raise InputError(
                f"{', '.join(sorted({n for n in names if names.count(n) > 1}))} is given more than "
                "once. Use each name in one way only: varied, fixed, or as the seed"
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
    Read the options that determine what is varied.

    `printed` tells whether the quantity is read from the script's output. Raise InputError if an
    option is invalid, or if the script does not use a given variable.
    """
    if by_seeds := re.fullmatch(r"seed(?:=(\d{1,3}))?", vary or "", re.ASCII):
        # ``seed=N`` means the default ladder of steps with N seeds per rung.
        if seeds is not None:
            raise InputError("--vary seed and --seeds mean the same. Leave out one of them")
        vary, seeds = None, int(by_seeds[1] or 2 * DEFAULT_PHASES)
    if seeds is not None and phases is not None:
        raise InputError(
            "--seeds and --phases exclude each other, because each seed has its "
            "own phase. Leave out one of them"
        )
    columns = PRINTED_PHASES if printed and vary is not None else DEFAULT_PHASES
    columns = next((given for given in (seeds, phases) if given is not None), columns)
    if not LEAST_COLUMNS <= columns <= _MOST_PHASES:
        raise InputError(
            f"{('--phases' if seeds is None else '--seeds')} is {columns}. Give "
            f"{LEAST_COLUMNS} to {_MOST_PHASES} runs at each value: fewer runs do not show the "
            "scatter"
        )
    kind = _kind(script, vary)
    ladder = None if vary is None or kind in COMPARED else read_ladder(vary)
    if kind == "setting" and ladder is not None and ladder.name == _ROWS:
        ladder = in_whole_numbers(ladder)
    if kind == "step" and ladder is not None and ladder.fine > ladder.coarse:
        raise InputError(
            f"--vary goes from {ladder.coarse:g} to {ladder.fine:g}. Give the coarse end "
            f"first: --vary {STEP}={ladder.fine:g}:{ladder.coarse:g}:{ladder.rungs}"
        )
    varied = Varied(
        script=script,
        kind=kind,
        values=ladder,
        switch=_switch(str(vary)) if kind in (RANKS, SWITCH) else (kind, ()),
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
    # The option -var can set a variable that the script uses but never sets.
    if _has_variable(script, name) or (name in (STEP, *_SETTINGS) and script.mentions(name)):
        return "variable" if read_switch(vary) is None else SWITCH
    if name in _SETTINGS:
        return "setting"
    special = {STEP: "step", LAST_DIGIT: LAST_DIGIT, RANKS: RANKS, RESTART: RESTART}
    kind = special.get(name, "variable" if read_switch(vary) is None else SWITCH)
    if kind in (LAST_DIGIT, RESTART) and vary != name:
        raise InputError(f"--vary is {vary!r}. Give {name} alone: --vary {name}")
    return kind


def _switch(vary: str) -> tuple[str, tuple[str, ...]]:
    """Return the name and the values of the setting in which compared runs differ."""
    name = vary.partition("=")[0]
    values = read_switch(vary)
    if name == RANKS or values is None:
        return name, tuple(map(str, read_ranks(vary)))
    return name, values


def _has_variable(script: ScriptText, name: str) -> bool:
    return any(command.words[2] != "delete" for command in script.of_variable(name))
