"""Declaration of one observable: its meaning, its computation, and where it is displayed."""

from collections.abc import Callable
from dataclasses import MISSING, dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from chaincor.analysis.results import CollisionAnalysis
    from chaincor.analysis.run_record import RunRecord


# These observables are rare in runs, but the analysis of a dump always has them.
_OF_EVERY_DUMP = ("masses", "velocity_after")


@dataclass(frozen=True)
class TextRow:
    """Printed line of a result, with its label and its texts."""

    label: str  #: Name at the beginning of the line.
    #: Text for a run: a format, in which ``{0}`` is the result, or a function of the result. If the
    #: text is None, the line is omitted.
    run: str | Callable[[Any], str | None] | None = None
    dump: str | Callable[[Any], str | None] | None = None  #: Text for the analysis of a dump.
    also: tuple[str, ...] = ()  #: Names of further observables in the line.
    definition: str | None = (
        None  #: Meaning of the line, if it shows only a part of its observable.
    )
    words: tuple[str, ...] = ()  #: Other words that ``chaincor explain`` accepts for the line.
    #: Whether the line is at the end, among lines about the engine and the numerics.
    closing: bool = False

    def text(self, result: Any, *, dump: bool = False) -> str | None:
        """Return the text for a run, or for the analysis of a dump; None for no line."""
        shown = self.dump if dump else self.run
        return shown.format(result) if isinstance(shown, str) else shown and shown(result)


@dataclass(frozen=True)
class Observable:
    """
    Description of one observable.

    `name` is the name of the result's attribute, of the JSON key and of the store column.
    """

    definition: str  #: Meaning, in one sentence without a full stop.
    unit: str = ""  #: Dimension in the chain's units, or s; empty for counts and ratios.
    symbol: str = ""  #: Symbol or name in lines of text.
    shape: str = ""  #: Shape of an array; empty for a single value.
    #: Function that computes the value from the record of a run; None if only dumps have it.
    run: "Callable[[RunRecord], Any] | None" = None
    #: Function that reads the value from the analysis of a dump; None if only runs have it.
    dump: "Callable[[CollisionAnalysis], Any] | None" = None
    #: Meaning in the analysis of a dump, if it differs from the meaning in a run.
    in_dumps: str | None = None
    rows: tuple[TextRow, ...] = ()  #: Printed lines that show the observable.
    #: Whether JSON and stores omit the observable if it is None.
    rare: bool = False
    #: Whether standard chains (cold, unit masses, hard wall) at other speeds have the same value.
    shared: bool = False
    axis: str | None = None  #: Label of an axis in figures; by default the name.
    name: str = ""
    dtype: str = ""  #: Type of the values, as annotated.

    def compute(self, record: "RunRecord") -> Any:
        """Return the value for a run."""
        assert self.run is not None
        return self.run(record)

    @property
    def is_array(self) -> bool:
        """Whether runs write the observable to the file of arrays instead of the JSON object."""
        return self.dtype.startswith("ndarray")

    @property
    def only_two_bodies(self) -> bool:
        """Whether dumps have the observable only if the chain hits a free target or a soft body."""
        return self.rare and self.name not in _OF_EVERY_DUMP

    @property
    def kind(self) -> str:
        """Type of the values, apart from None."""
        return self.dtype.removesuffix(" or None")

    @property
    def meaning(self) -> str:
        """The definition, preceded by the symbol."""
        return f"{self.symbol} = {self.definition}" if self.symbol else self.definition


def observable(definition: str, *rows: TextRow, **facts: Any) -> Any:
    """Declare a field of results as an observable; for `facts` see :class:`Observable`."""
    described = Observable(definition, rows=rows, **facts)
    default = None if described.rare else MISSING
    return field(default=default, metadata={"observable": described})


def dtype_of(annotation: Any) -> str:
    """Return the name of an annotated type, as the documentation shows it."""
    parts = getattr(annotation, "__args__", ())
    if type(annotation).__name__ == "UnionType" or type(None) in parts:
        return " or ".join(dtype_of(part) for part in parts)
    if "ndarray" in str(annotation):
        return "ndarray"
    if annotation is type(None):
        return "None"
    return str(annotation.__name__)
