"""Merge stores, such as the parts that the tasks of a job array have written."""

from pathlib import Path
from typing import NamedTuple

from chaincor.lammps_inputs.errors import one_line
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.results_store import Store


class MergedRows(NamedTuple):
    """Counts of a merge."""

    rows: int  #: Rows of the target afterwards.
    added: int  #: Rows that the target did not have.
    replaced: int  #: Rows of the target whose new result has a smaller error.
    equal: int  #: Rows that both have with the same standing.
    kept: int  #: Rows of the target with a smaller error than the new result.

    def __str__(self) -> str:
        return (
            f"{self.rows} rows ({self.added} added, {self.replaced} replaced by better ones, "
            f"{self.equal} equal, {self.kept} kept as better ones)"
        )


def merge_stores(target: Path, sources: list[Path]) -> MergedRows:
    """
    Copy the rows of some stores into another; where both have a row, the smaller error stays.

    The target is made if it is not there. Each source is only read, and copied in one transaction:
    after a StoreWriteError whole stores are missing, no halves. Raises StoreError, and copies
    nothing, if a store cannot be used, or is to be merged into itself.
    """
    for source in sources:
        # A link to the target is the target as well.
        if source.exists() and target.exists() and source.samefile(target):
            raise StoreError(f"{source} cannot be merged into itself; expected another store")
        _check_whole(source)
    replaced = equal = kept = 0
    with Store(target) as store:
        before = len(store)
        for source in sources:
            with Store(source, read_only=True) as part:
                counts = store.merge(part)
            replaced, equal, kept = replaced + counts[0], equal + counts[1], kept + counts[2]
        return MergedRows(len(store), len(store) - before, replaced, equal, kept)


def _check_whole(source: Path) -> None:
    """Read every page of a store: what goes wrong after that is the target's."""
    with Store(source, read_only=True) as store:
        ((found,), *_) = store.select("PRAGMA quick_check(1)")[1]
    if found != "ok":
        reason = one_line(found)
        raise StoreError(
            f"the results store {source} is damaged ({reason}), and nothing was merged; expected a "
            "whole one: run its sweep into a new store, or leave it out"
        )
