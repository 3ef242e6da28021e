"""Merge stores, such as the parts from the tasks of a job array."""

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
    equal: int  #: Rows of both stores of which neither replaces the other.
    kept: int  #: Rows of the target with a smaller error than the new result.

    def __str__(self) -> str:
        return (
            f"{self.rows} rows ({self.added} added, {self.replaced} replaced by better ones, "
            f"{self.equal} equal, {self.kept} kept as better ones)"
        )


def merge_stores(target: Path, sources: list[Path]) -> MergedRows:
    """
    Copy the rows of some stores into another; if both have a row, the smaller error stays.

    A missing target is created. Each source is copied in one transaction, so that no source is
    copied in part after a StoreWriteError. Raises StoreError before any copy if a store cannot be
    used, or if a source is the target.
    """
    for source in sources:
        # samefile also finds links to the target.
        if source.exists() and target.exists() and source.samefile(target):
            raise StoreError(f"{source} cannot be merged into itself. Give another store")
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
    """Check every page of a source, so that later errors can only come from the target."""
    with Store(source, read_only=True) as store:
        ((found,), *_) = store.select("PRAGMA quick_check(1)")[1]
    if found != "ok":
        reason = one_line(found)
        raise StoreError(
            f"the results store {source} is damaged ({reason}), so nothing was merged. "
            "Leave it out, or run its sweep into a new store"
        )
