"""Write the bottom line of a study: the value to use, the number of runs, and how sure both are."""

import math
from typing import TYPE_CHECKING

from chaincor.workflows.scripts.answers import (
    Choice,
    LadderAnswer,
    answer_ladder,
)
from chaincor.workflows.scripts.ladder_runs import ScriptLadder
from chaincor.workflows.scripts.number_names import MOST_LISTED, all_of, listed, name_in, name_of
from chaincor.workflows.scripts.remedies import no_change, unanswered, unscaled_period
from chaincor.workflows.scripts.step_settings import where_to_set

if TYPE_CHECKING:
    from chaincor.workflows.scripts.study import ScriptStudy


def bottom_line(study: "ScriptStudy") -> str:
    """Return the advice for all quantities of a study as text."""
    said = [_of_comparison(study)] if study.comparisons else []
    for each in study.ladders:
        fixed = ", ".join(f"{name} = {value}" for name, value in each.fixed.items())
        text = _answered(study, each)
        said.append(f"At {fixed}: {text}" if fixed else text)
    said += [change.short for change in study.changes]
    if study.ladders:
        said.append(_of_crashes(study))
    # Each command stands at the end of its line, where users can copy it.
    for each in study.ladders:
        fixed = ", ".join(f"{name} = {value}" for name, value in each.fixed.items())
        left = unanswered(study, each, answer_of(study, each))
        said += [f"At {fixed}: {text}" if fixed else text for text in left]
    return " ".join(filter(None, said))


def answer_of(study: "ScriptStudy", each: ScriptLadder) -> LadderAnswer:
    """Judge one ladder of a study."""
    return answer_ladder(each, study.own_step, [crash.value for crash in study.crashes])


def _answered(study: "ScriptStudy", each: ScriptLadder) -> str:
    """Write sentences on the value to use, the number of runs, and their probability."""
    answer = answer_of(study, each)
    if answer.all_constant and not answer.own_fails:
        return no_change(each)
    parts = [_own_value(study, each, answer)]
    if answer.use is not None:
        parts.append(_use(study, each, answer))
        parts.append(_how_sure(each, answer))
        if answer.coarser is not None and answer.keeps_own:
            value = each.ladder.text(answer.coarser.value)
            parts.append(f"A {each.ladder.name} of {value} would do as well.")
    return " ".join(filter(None, parts))


def _own_value(study: "ScriptStudy", each: ScriptLadder, answer: LadderAnswer) -> str:
    """Say whether the script's own value is small enough; empty if it is unknown."""
    if answer.own is None:
        return ""
    yours = f"Your {each.ladder.name} {answer.own:g}"
    if answer.own_fails:
        own = next((crash for crash in study.crashes if crash.value == answer.own), None)
        return f"{yours} is too large: " + ("runs fail near it." if own is None else f"{own.said}.")
    too_large = answer.in_state("too large")
    if too_large and all(math.isinf(a.error) for a in too_large):
        return f"{yours} is coarser than the values tried, so it was not judged."
    too_large += answer.in_state("beyond")
    counting = unscaled_period(study)
    if too_large and counting is not None:
        return (
            f"{yours} is not small enough for {listed(too_large)}. The integrator may not be the "
            f"cause: {counting}, so more often in time at a smaller step. First run the command at "
            "the end of this line."
        )
    if too_large:
        return f"{yours} is too large for {listed(too_large)}."
    if not answer.judged:
        return f"{yours} cannot be judged yet. Keep it for now."
    noisy = answer.in_state("too noisy")
    if not noisy:
        return f"{yours} is small enough for {all_of(answer.judged)}."
    count, total = len(answer.judged), len(answer.judged) + len(answer.in_state("not judged"))
    text = f"{yours} is small enough"
    if total > 1:
        text += f" for {f'all {count}' if count == total else f'{count} of {total}'} quantities"
    return f"{text}, but a single run scatters too much for {listed(noisy)}."


def _use(study: "ScriptStudy", each: ScriptLadder, answer: LadderAnswer) -> str:
    """Return the sentence on the value to use and the number of runs."""
    ladder, use = each.ladder, answer.use
    assert use is not None
    if answer.keeps_own:
        now = " for now" if answer.in_state("not judged") else ""
        if use.runs == 1:
            return f"Keep it{now}; one run is enough."
        text = f"Keep it{now} and {_average(use, answer)}"
        if answer.single is not None:
            text += f", or use {ladder.name} {ladder.text(answer.single.value)} and one run"
        return f"{text}."
    parts = []
    if answer.single is not None:
        parts.append(f"{ladder.text(answer.single.value)} and one run")
    several = answer.several
    if several is not None and (
        answer.single is None or ladder.step(several.value) > ladder.step(answer.single.value)
    ):
        needs = f" ({name_of(several.decides)} needs them)" if len(answer.judged) > 1 else ""
        parts.append(f"{ladder.text(several.value)} and {_average(several, answer)}{needs}")
    where = where_to_set(study, ladder.name)
    use_it = "Use"
    if answer.in_state("too large") and unscaled_period(study) is not None:
        use_it = "Until then, use"
    text = f"{use_it} {ladder.name} {', or '.join(parts)}{where}."
    return f"{text}{_decides(each, answer)}"


def _decides(each: ScriptLadder, answer: LadderAnswer) -> str:
    """Name the quantity that needs the finest value, if runs fail at the script's own value."""
    choice = answer.single
    if choice is None or not answer.own_fails or len(answer.judged) == 1:
        return ""
    row = next(a for a in answer.numbers if a.number is choice.decides)
    # If the chosen value is the coarsest value without a failed run, failed runs limit the choice,
    # and no quantity does.
    coarsest = each.ladder.step(float(each.values[0]))
    if row.largest != choice.value or each.ladder.step(choice.value) >= coarsest:
        return ""
    return f" The quantity that needs the finest {each.ladder.name} is {name_in(row)}."


def _average(choice: Choice, answer: LadderAnswer) -> str:
    """Write how many runs to average; a longer run replaces them if all quantities are means."""
    text = f"average {choice.runs} independent runs"
    if all(a.number.name.endswith(":mean") for a in answer.judged):
        text += f" (or run {choice.runs} times as long)"
    return text


def _how_sure(each: ScriptLadder, answer: LadderAnswer) -> str:
    """Write how probable the advice is, and which quantity is nearest to its tolerance."""
    assert answer.use is not None
    judged = answer.judged
    limit = "very small timesteps" if each.ladder.name == "timestep" else "the fine end"
    one = len(judged) == 1
    names = all_of(judged) if len(judged) <= MOST_LISTED else f"these {all_of(judged)}"
    what = names if one else f"each of {names}"
    by = f"{judged[0].number.tolerance:.2g}" if one else "its tolerance"
    text = f"With 95 % probability, {what} then differs by less than {by} from its value at {limit}"
    if one or not answer.keeps_own or answer.use.runs > 1:
        return f"{text}."
    worst = max(judged, key=lambda a: a.error / (a.number.tolerance or 1e-300))
    return f"{text}; nearest to its tolerance is {listed([worst])}."


def _of_crashes(study: "ScriptStudy") -> str:
    """Write at which values runs stopped early, first the finest of these values."""
    if not study.crashes:
        return "No run stopped early."
    *coarser, finest = study.crashes
    others = ", ".join(f"{crash.value:g}" for crash in coarser)
    # If a run crashed at the script's own step, the first sentence of the bottom line says so.
    text = f"{finest} " if finest.value != study.own_step else ""
    text += f"Runs at {others} stop as well. " if coarser else ""
    return f"{text}No other run stopped early."


def _of_comparison(study: "ScriptStudy") -> str:
    said = []
    for each in study.comparisons:
        known = {name: number.agrees for name, number in each.numbers.items()}
        differ = [name.removesuffix(":mean") for name, agrees in known.items() if agrees is False]
        agree = [name.removesuffix(":mean") for name, agrees in known.items() if agrees]
        text = {
            "same": "all digits agree",
            "together": "the runs differ only by roundings, which is no bug",
            "chaos": "the runs part because the motion is chaotic, which is no bug. Compare "
            "means, not frames",
            "at once": "the runs differ from the beginning: " + "; ".join(each.causes[:1]),
        }[each.kind]
        if each.renumbered and each.kind != "at once":
            text += ". LAMMPS numbered the particles differently; they were matched by position"
        if each.kind in ("chaos", "at once"):
            if differ:
                text += f". Means differ: {', '.join(differ)}"
            elif agree:
                text += f". Means agree: {', '.join(agree)}"
            else:
                text += ". The run is too short to compare means"
        said.append(f"{each.what[0].upper()}{each.what[1:]}: {text}.")
    return " ".join(said)
