"""Declaration of one observable: its meaning, its computation and its places of display."""

from collections.abc import Callable
from dataclasses import MISSING, dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from chaincor.analysis.results import CollisionAnalysis
    from chaincor.analysis.run_record import RunRecord


# Runs seldom show these observables, because eta determines them. A dump of a plain chain gives no
# others.
_OF_EVERY_DUMP = ("masses", "velocity_after")


@dataclass(frozen=True)
class TextRow:
    """Line that results print, with its label and the observables that it shows."""

    label: str  #: Name at the beginning of the line.
    #: Text of a run's result: a format that is filled with the result as ``{0}``, or a function of
    #: the result. The line is left out if the text is None.
    run: str | Callable[[Any], str | None] | None = None
    dump: str | Callable[[Any], str | None] | None = None  #: Text of the analysis of a dump.
    also: tuple[str, ...] = ()  #: Further observables in the line.
    definition: str | None = None  #: Meaning of a line that shows only a part of its observable.
    words: tuple[str, ...] = ()  #: Other words that ``chaincor explain`` accepts for the line.
    #: Whether the line is at the end, among the lines on how the run was made.
    closing: bool = False

    def text(self, result: Any, *, dump: bool = False) -> str | None:
        """Return the text for a result, or for the analysis of a dump; None for no line."""
        shown = self.dump if dump else self.run
        return shown.format(result) if isinstance(shown, str) else shown and shown(result)


@dataclass(frozen=True)
class Observable:
    """
    Description of one printed number.

    The name is the attribute of a result, the JSON key and the store column.
    """

    definition: str  #: Meaning, in one sentence without its full stop.
    unit: str = ""  #: Dimension in the chain's units, or s; empty for counts and ratios.
    symbol: str = ""  #: Symbol or name in lines of text.
    shape: str = ""  #: Shape of an array; empty for a single value.
    #: Function of the record of a run that returns the value; None if only dumps have it.
    run: "Callable[[RunRecord], Any] | None" = None
    #: Function of the analysis of a dump that returns the value; None if dumps do not have it.
    dump: "Callable[[CollisionAnalysis], Any] | None" = None
    #: Meaning in the analysis of a dump, if it differs from the meaning in a run.
    in_dumps: str | None = None
    rows: tuple[TextRow, ...] = ()  #: Lines of text that show it.
    #: Whether JSON and stores leave it out if it is None.
    rare: bool = False
    axis: str | None = None  #: Label of an axis of a figure; the name by default.
    name: str = ""
    dtype: str = ""  #: Type of its values, as it is annotated.

    def compute(self, record: "RunRecord") -> Any:
        """Return the value for a run."""
        assert self.run is not None
        return self.run(record)

    @property
    def is_array(self) -> bool:
        """Whether runs write the value to the file of arrays instead of the JSON object."""
        return self.dtype.startswith("ndarray")

    @property
    def only_two_bodies(self) -> bool:
        """Whether dumps give it only for a chain that hits a free target or a soft body."""
        return self.rare and self.name not in _OF_EVERY_DUMP

    @property
    def kind(self) -> str:
        """Type of its values, apart from None."""
        return self.dtype.removesuffix(" or None")

    @property
    def meaning(self) -> str:
        """The definition, after the symbol that lines of text use."""
        return f"{self.symbol} = {self.definition}" if self.symbol else self.definition


def observable(definition: str, *rows: TextRow, **facts: Any) -> Any:
    """Declare a field of results as an observable; for `facts` see :class:`Observable`."""
    described = Observable(definition, rows=rows, **facts)
    default = None if described.rare else MISSING
    return field(default=default, metadata={"observable": described})


def dtype_of(annotation: Any) -> str:
    """Return the name of the type of an annotation on pages."""
    parts = getattr(annotation, "__args__", ())
    if type(annotation).__name__ == "UnionType" or type(None) in parts:
        return " or ".join(dtype_of(part) for part in parts)
    if "ndarray" in str(annotation):
        return "ndarray"
    if annotation is type(None):
        return "None"
    return str(annotation.__name__)
