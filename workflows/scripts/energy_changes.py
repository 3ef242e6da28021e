"""Find likely causes of energy drifts that no time step cures, and test the first cause."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from chaincor.workflows.scripts.ladder_runs import NumberLadder, ScriptLadder
from chaincor.workflows.scripts.quantities import ALL, Quantity
from chaincor.workflows.scripts.script_run import Runner
from chaincor.workflows.scripts.script_text import Command, ScriptText
from chaincor.workflows.scripts.step_counts import find_step_counts, plain_style
from chaincor.workflows.scripts.tolerances import thermal_tolerance
from chaincor.workflows.scripts.varied import Varied

# LAMMPS conserves these quantities without a thermostat. econserve also counts the energy that some
# thermostats exchange.
_KEPT, _COUNTING = ("etotal", "econserve"), "econserve"
# A cause is confirmed if its removal leaves less than this fraction of the drift.
_CURED = 0.3
# These fixes exchange energy to hold a temperature or a pressure.
_THERMOSTATS = ("nvt", "npt", "nph", "langevin", "temp/", "press/", "rigid/nvt", "rigid/npt",
                "brownian", "gle", "gld", "viscous", "heat", "ehex", "thermal/")  # fmt: skip
# These fixes exchange energy with the particles.
_BATHS = (*_THERMOSTATS, "deform", "wall/", "move", "addforce", "efield", "indent", "setforce",
          "smd", "aveforce", "nve/limit", "evaporate", "deposit", "pour", "gcmc", "freeze", "drag",
          "gravity")  # fmt: skip
# A reflecting wall exchanges energy only if it moves.
_MIRROR = "wall/reflect"
# econserve counts the energy that these fixes exchange: in runs with LAMMPS of 2025-07-22,
# econserve stays constant to 1e-3 while etotal changes by a tenth. Energy from fix langevin is
# counted only with the keyword `tally yes`, and energy from other fixes never.
_COUNTED = ("nvt", "npt", "nph", "temp/", "rigid/nvt", "rigid/npt")
_TALLY = "tally yes"
_UNSHIFTED = ("lj/cut", "lj96/cut", "morse", "buck", "yukawa", "born", "mie/cut", "lj/expand")
# If a table has fewer rows than this, the difference between its forces and the slope of its
# energies may cause a visible drift.
_FEW_ROWS = 2000


class DriftCause(NamedTuple):
    """A likely cause of an energy drift."""

    text: str
    #: Command that removes the cause if it precedes each run; empty if no command does.
    remedy: str = ""
    #: Fix that exchanges energy, and its line in the script; empty for other causes.
    exchanges: str = ""
    counted: bool = False  #: Whether econserve counts the energy that the fix exchanges.
    countable: bool = False  #: Whether `tally yes` would make econserve count this energy.


@dataclass(frozen=True)
class EnergyChange:
    """An energy drift that does not vanish at small steps."""

    name: str  #: The quantity.
    drift: float  #: Change of the quantity over the run in the limit of small steps.
    error: float  #: Error of the drift.
    causes: tuple[DriftCause, ...]  #: Possible causes, with the likeliest first.
    tested: DriftCause | None = None  #: Cause that an additional run removed as a test.
    before: float = 0.0  #: Drift at the finest step with the tested cause.
    after: float = 0.0  #: Drift at the finest step without the tested cause.

    @property
    def confirmed(self) -> bool:
        """Whether the drift nearly vanishes without the tested cause."""
        return self.tested is not None and abs(self.after) < _CURED * abs(self.before)

    @property
    def short(self) -> str:
        """One sentence on the drift and its confirmed or likeliest cause."""
        others = (each for each in self.causes if each is not self.tested)
        cause = self.tested if self.confirmed else next(others, None)
        what = self.name.partition(":")[0]
        if fix := self._bath:
            return (
                f"{what} drifts by {self.drift:.2g} at every timestep. {fix} exchanges energy, so "
                f"{what} need not be conserved{self._instead}."
            )
        text = f"No timestep cures the drift of {what} by {self.drift:.2g}"
        if cause is None:
            return f"{text}."
        text += f"; its {'' if self.confirmed else 'likely '}cause is {cause.text}"
        return f"{text}, which '{cause.remedy}' removes." if self.confirmed else f"{text}."

    @property
    def _bath(self) -> str:
        """Thermostat or other fix that exchanges energy; empty if there is none."""
        return self.causes[0].exchanges if self.causes else ""

    @property
    def _instead(self) -> str:
        """Clause on the conserved quantity that counts the exchanged energy; empty if none does."""
        exchanges = [each for each in self.causes if each.exchanges]
        if all(each.counted for each in exchanges):
            return f"; use the keyword {_COUNTING}:drift instead"
        if all(each.counted or each.countable for each in exchanges):
            return f"; add '{_TALLY}' to fix langevin and use the keyword {_COUNTING}:drift"
        return ""

    def __str__(self) -> str:
        if self._bath:
            others = "; ".join(each.text for each in self.causes[1:])
            return self.short + (f" Other likely causes: {others}." if others else "")
        what = self.name.partition(":")[0]
        head = f"{what} drifts by {self.drift:.2g} at every timestep, so no timestep cures it. "
        causes = "; ".join(each.text for each in self.causes)
        if self.tested is None:
            return head + (f"Likely causes: {causes}." if causes else "The script shows no cause.")
        found = f"With '{self.tested.remedy}' the drift is {self.after:.2g} instead of "
        found += f"{self.before:.2g}: "
        if self.confirmed:
            return f"{head}{found}the cause is {self.tested.text}."
        others = "; ".join(each.text for each in self.causes if each is not self.tested)
        found += f"{self.tested.text} is not the cause."
        return f"{head}{found}" + (f" Other likely causes: {others}." if others else "")


def default_quantities(script: ScriptText) -> tuple[str, ...]:
    """
    Return the quantities of a study whose user requests none.

    A thermostat changes etotal. If econserve counts the exchanged energy, it replaces etotal.
    Otherwise the drift of etotal depends on the thermostat and is left out.
    """
    baths = [
        cause
        for command in script.commands
        if (cause := _bath(command, _KEPT[0])) and _style(command).startswith(_THERMOSTATS)
    ]
    if not baths:
        return ALL
    if all(cause.counted for cause in baths):
        return tuple(each.replace(_KEPT[0], _COUNTING) for each in ALL)
    return tuple(each for each in ALL if each != f"{_KEPT[0]}:drift")


def find_energy_changes(
    runner: Runner, varied: Varied, ladder: ScriptLadder
) -> tuple[EnergyChange, ...]:
    """Find energies that drift at every step, and test the first cause that can be removed."""
    if varied.kind != "step":
        return ()
    found = []
    for quantity in runner.asked.quantities:
        number = next(each for each in ladder.numbers if each.name == str(quantity))
        if quantity.what in _KEPT and quantity.kind == "drift" and _stays(ladder, number):
            found.append(_explain(runner, varied, ladder, quantity, number))
    return tuple(found)


def _stays(ladder: ScriptLadder, number: NumberLadder) -> bool:
    """Return whether a drift in the limit of small steps exceeds its error and its tolerance."""
    verdict = number.verdict
    if verdict.value is None or verdict.value_error is None:
        return False
    good = [pair for pair in zip(ladder.given, ladder.runs, strict=True) if pair[1].samples]
    _, finest = min(good, key=lambda pair: ladder.ladder.step(pair[0]))
    least = 0.0 if finest.samples is None else thermal_tolerance(finest.samples)
    return abs(verdict.value) > verdict.value_error + max(least, verdict.value_error)


def _explain(
    runner: Runner, varied: Varied, ladder: ScriptLadder, quantity: Quantity, number: NumberLadder
) -> EnergyChange:
    verdict = number.verdict
    assert verdict.value is not None
    assert verdict.value_error is not None
    causes = tuple(_find_causes(varied.script, quantity.what))
    change = EnergyChange(str(quantity), verdict.value, verdict.value_error, causes)
    first = next((each for each in causes if each.remedy), None)
    if first is None or (causes and causes[0].exchanges):
        return change
    rung = int(np.argmin(np.abs(np.array(_rungs(varied)) - ladder.values[-1])))
    run = runner.run(
        "a cause tested", replace(varied.change(ladder.fixed, rung, 0), extra=(first.remedy,))
    )
    if run.failure:
        return change
    before = float(number.results[-1][0])
    after = run.numbers[str(quantity)].value
    return replace(change, tested=first, before=before, after=after)


def _rungs(varied: Varied) -> list[float]:
    return [varied.value(rung, 0) for rung in range(varied.ladder.rungs)]


def _find_causes(script: ScriptText, what: str) -> Iterator[DriftCause]:
    """Find possible causes in the commands of the script, with the likeliest cause first."""
    searches: tuple[Callable[[Command], DriftCause | None], ...] = (
        lambda command: _bath(command, what),
        lambda command: _cutoff(command, script),
        _neighbours,
        _table,
        _long_range,
    )
    for search in searches:
        yield from filter(None, map(search, script.commands))
    for count in find_step_counts(script, None):
        if count.moves and count.command.words[0] == "fix":
            yield DriftCause(f"'{count.what}' ({count.command}), which {count.says}")


def _bath(command: Command, what: str) -> DriftCause | None:
    words = command.words
    style = _style(command)
    if not style.startswith(_BATHS) or (style == _MIRROR and "v_" not in " ".join(words)):
        return None
    countable = style.startswith("langevin")
    counted = style.startswith(_COUNTED) or (countable and _TALLY in " ".join(words))
    if counted and what == _COUNTING:
        return None
    fix = f"'fix {words[1]} {words[2]} {words[3]}' ({command})"
    return DriftCause(
        f"the exchange of energy by {fix}", exchanges=fix, counted=counted, countable=countable
    )


def _style(command: Command) -> str:
    """Return the style of a fix without an accelerator suffix; an empty text for others."""
    words = command.words
    return plain_style(words[3]) if words[0] == "fix" and len(words) > 3 else ""


def _cutoff(command: Command, script: ScriptText) -> DriftCause | None:
    words = command.words
    shifted = any(
        each.words[0] == "pair_modify" and "shift yes" in " ".join(each.words)
        for each in script.commands
    )
    if shifted or words[0] != "pair_style" or len(words) < 2:
        return None
    if not any(word.startswith(_UNSHIFTED) for word in words[1:]):
        return None
    text = f"the energy jump at the cutoff of '{' '.join(words)}' ({command})"
    return DriftCause(text, "pair_modify shift yes")


def _neighbours(command: Command) -> DriftCause | None:
    words = command.words
    if words[0] != "neigh_modify":
        return None
    given = dict(zip(words[1::2], words[2::2], strict=False))
    late = given.get("check") == "no" or given.get("once") == "yes"
    late = late or any(given.get(key, "0") not in ("0", "1") for key in ("delay", "every"))
    if not late:
        return None
    text = f"neighbour lists that are rebuilt too late ({command}, '{' '.join(words)}')"
    return DriftCause(text, "neigh_modify delay 0 every 1 check no once no")


def _table(command: Command) -> DriftCause | None:
    words = command.words
    if not words[0].endswith("_style") or "table" not in words[1:-1]:
        return None
    at = words.index("table")
    rows = words[at + 2] if len(words) > at + 2 else ""
    if rows.isdigit() and int(rows) >= _FEW_ROWS and words[at + 1] == "spline":
        return None
    return DriftCause(f"a table whose forces are not the slope of its energy ({command}; see "
                 "`chaincor table`)")  # fmt: skip


def _long_range(command: Command) -> DriftCause | None:
    words = command.words
    if words[0] == "kspace_style" and len(words) > 2:
        return DriftCause(f"the accuracy {words[2]} of '{words[1]}' ({command})")
    return None
