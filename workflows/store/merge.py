"""Joining stores: the parts that the tasks of a job array have written."""

from pathlib import Path

from chaincor.lammps_inputs.errors import one_line
from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.results_store import Store


def merge_stores(target: Path, sources: list[Path]) -> int:
    """
    Copy the rows of some stores into another; where both have a row, the smaller error stays.

    Returns how many rows the target, which is made if it is not there, has then. Each source is
    only read, and copied in one transaction: after a StoreWriteError whole stores are missing, no
    halves. Raises StoreError, and copies nothing, if a store cannot be used, or is to be merged
    into itself.
    """
    for source in sources:
        # A link to the target is the target as well.
        if source.exists() and target.exists() and source.samefile(target):
            raise StoreError(f"{source} cannot be merged into itself; expected another store")
        _check_whole(source)
    with Store(target) as store:
        for source in sources:
            with Store(source, read_only=True) as part:
                store.merge(part)
        return len(store)


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
