"""
List all observables of a collision; every display of observables is generated from the list.

A field of :class:`Observed` declares one observable of a run. The attribute of the result, the JSON
key, the store column, the line of text, the entry of ``chaincor explain`` and the row of the
reference page follow from the field. The declarations are in ``analysis/observed``.
"""

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Any, get_type_hints

from chaincor.analysis.observed.arrays import MeasuredArrays
from chaincor.analysis.observed.bodies import Bodies
from chaincor.analysis.observed.dumps import OF_DUMPS_ALONE
from chaincor.analysis.observed.making import Making
from chaincor.analysis.observed.observable import Observable, TextRow, dtype_of
from chaincor.analysis.observed.outcome import MeasuredOutcome


@dataclass(frozen=True, repr=False, kw_only=True)
class Observed(Making, MeasuredArrays, MeasuredOutcome, Bodies):
    """Observables of a run, as attributes."""


def _declared() -> dict[str, Observable]:
    types = get_type_hints(Observed)
    of_runs = {
        f.name: replace(f.metadata["observable"], name=f.name, dtype=dtype_of(types[f.name]))
        for f in fields(Observed)
    }
    return of_runs | {name: replace(each, name=name) for name, each in OF_DUMPS_ALONE.items()}


#: All observables by name, in the order of display.
OBSERVABLES: dict[str, Observable] = _declared()
OF_RUNS = tuple(each for each in OBSERVABLES.values() if each.run is not None)
OF_DUMPS = tuple(each for each in OBSERVABLES.values() if each.dump is not None)


def attributes_section(observables: Iterable[Observable]) -> str:
    """Return the section "Attributes" of a docstring for some observables."""
    found = ["    Attributes", "    ----------"]
    for each in observables:
        kind = f"{each.dtype}, of shape {each.shape}" if each.shape else each.dtype
        text = each.meaning + (f" [{each.unit}]" if each.unit else "") + "."
        found += [f"    {each.name} : {kind}", f"        {text[:1].upper()}{text[1:]}"]
    return "\n".join(found) + "\n"


def rows_of(result: Any, *, dump: bool = False, closing: bool = False) -> list[tuple[str, str]]:
    """Return the labels and texts of a result; with `dump`, of the analysis of a dump."""
    return [
        (row.label, text)
        for each in (OF_DUMPS if dump else OF_RUNS)
        for row in each.rows
        if row.closing == closing
        and (dump or getattr(result, each.name) is not None)
        and (text := row.text(result, dump=dump)) is not None
    ]


def _definition(row: TextRow, of: Observable) -> str:
    """Return the meaning of a printed line, with a sentence for each of its observables."""
    if row.definition is not None:
        return row.definition
    shown = [OBSERVABLES[name] for name in row.also]
    # Symbols, such as "t = time", keep their case.
    sentences = [
        each.meaning if each.symbol else each.meaning[:1].upper() + each.meaning[1:]
        for each in shown
    ]
    return ". ".join([of.meaning, *sentences])


def _terms(observables: Iterable[Observable]) -> dict[str, str]:
    return {row.label: _definition(row, each) for each in observables for row in each.rows}


#: Explanations of the lines of text in ``chaincor explain``, by label.
TERMS = _terms(OF_RUNS)
TERMS_OF_DUMPS = _terms(OF_DUMPS_ALONE.values())
#: Other words that ``chaincor explain`` accepts, and the labels of the lines that they stand for.
OTHER_WORDS = {
    word: row.label for each in OBSERVABLES.values() for row in each.rows for word in row.words
}


def json_keys(command: str) -> list[tuple[Observable, bool]]:
    """
    Return the observables in the JSON output of ``run`` or ``analyze``, with their meanings.

    The second item of each pair says whether the key may be absent. Arrays of runs are not in the
    JSON output, because they are written to a separate file.
    """
    if command == "run":
        return [(each, each.rare) for each in OF_RUNS if not each.is_array]
    return [
        (replace(each, definition=each.in_dumps or each.definition), each.only_two_bodies)
        for each in OF_DUMPS
    ]
