"""Joining stores: the parts that the tasks of a job array have written."""

from pathlib import Path
from urllib.parse import quote

from chaincor.workflows.errors import StoreError
from chaincor.workflows.store.connection import named_errors, transaction
from chaincor.workflows.store.results_store import Store


def merge_stores(target: Path, sources: list[Path]) -> int:
    """
    Copy the rows of some stores into another; where both have a row, the tighter result stays.

    Returns how many rows the target, which is made if it is not there, has then. Each source is
    only read, and copied in one transaction: after a StoreWriteError whole stores are missing, no
    halves. Raises StoreError if a store cannot be used, or is to be merged into itself.
    """
    for source in sources:
        if source.resolve() == target.resolve():
            raise StoreError(f"{source} cannot be merged into itself; expected another store")
        Store(source, read_only=True).close()
    with Store(target) as store:
        for source in sources:
            _copy(store, source)
        return len(store)


# A row of the source wins if the target has none, or none with a result, or one that was asked for
# less exactly, or the same without an error bar or without arrays; never a failure over a result.
_WINNERS = """
    CREATE TEMP TABLE winners AS
    SELECT theirs.collision_sha256 AS key FROM source.collisions AS theirs
    LEFT JOIN main.collisions AS ours USING (collision_sha256)
    WHERE ours.collision_sha256 IS NULL
       OR ours.restitution IS NULL AND (theirs.restitution IS NOT NULL
                                        OR theirs.finished > ours.finished)
       OR theirs.restitution IS NOT NULL AND (
              theirs.tolerance < ours.tolerance
              OR theirs.tolerance IS ours.tolerance AND (
                     ours.restitution_error IS NULL AND theirs.restitution_error IS NOT NULL
                     OR NOT EXISTS (SELECT 1 FROM main.arrays AS a
                                    WHERE a.collision_sha256 = ours.collision_sha256)
                        AND EXISTS (SELECT 1 FROM source.arrays AS a
                                    WHERE a.collision_sha256 = theirs.collision_sha256)))
"""


def _copy(store: Store, source: Path) -> None:
    connection = store.connection
    with named_errors(store.path):
        address = f"file:{quote(str(source.absolute()))}?mode=ro"
        connection.execute("ATTACH ? AS source", (address,))
        try:
            names = [row[1] for row in connection.execute("PRAGMA table_info(collisions)")]
            columns = ", ".join(f'"{name}"' for name in names)
            values = columns.replace(
                '"environment"',
                "(SELECT e.id FROM main.environments AS e "
                "JOIN source.environments AS s USING (versions) WHERE s.id = environment)",
            )
            with transaction(connection):
                connection.execute(
                    "INSERT OR IGNORE INTO environments (versions) "
                    "SELECT versions FROM source.environments"
                )
                connection.execute(_WINNERS)
                among = "WHERE collision_sha256 IN (SELECT key FROM winners)"
                connection.execute(f"DELETE FROM main.arrays {among}")
                connection.execute(f"DELETE FROM main.collisions {among}")
                connection.execute(
                    f"INSERT INTO main.collisions ({columns}) "
                    f"SELECT {values} FROM source.collisions {among}"
                )
                connection.execute(f"INSERT INTO main.arrays SELECT * FROM source.arrays {among}")
                connection.execute("DROP TABLE winners")
        finally:
            connection.execute("DETACH source")
