"""Define the tables of a results store, their version, and the migrations from older versions."""

import re

from chaincor.analysis.observables import OF_RUNS
from chaincor.lammps_inputs.bonds.potentials import BOND_KEYS
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_KEYS, CONTACT_LAWS, laws_with
from chaincor.lammps_inputs.scene_parts.scene_fields import BODY_KEYS

# The code "CCOR" distinguishes results stores from other SQLite files.
APPLICATION_ID = 0x43434F52

# Statements that create a store.
CREATION = (
    """
    CREATE TABLE environments (
        id INTEGER PRIMARY KEY,
        versions TEXT NOT NULL UNIQUE        -- JSON: library -> version
    )
    """,
    """
    CREATE TABLE collisions (
        collision_sha256 BLOB NOT NULL UNIQUE,  -- hash of the scene without its tolerance
        -- what collides
        potential TEXT NOT NULL,
        toda_b REAL,
        power_order INTEGER,
        power_c REAL,
        particles INTEGER NOT NULL,
        velocity REAL NOT NULL,
        speed REAL,
        engine TEXT NOT NULL,
        tolerance REAL,
        -- what came out; all null as long as there is no result
        restitution REAL,
        restitution_error REAL,
        tolerance_met INTEGER,
        kinematic_restitution REAL,
        contacts INTEGER,
        last_contact_time REAL,
        bond_min REAL,
        bond_max REAL,
        fragments INTEGER,
        crossed INTEGER,
        energy_drift REAL,
        momentum_residual REAL,
        duration REAL,
        ending TEXT,
        v_star REAL,
        reason TEXT,
        -- how
        wall TEXT,
        scheme TEXT,
        timestep REAL,
        "table" TEXT,
        table_points INTEGER,
        seconds REAL,
        seconds_total REAL,
        -- the last failure, if there was one since the result
        failure TEXT,
        failure_message TEXT,
        failure_tolerance REAL,
        failure_stands INTEGER,              -- 1: the same scene would fail again
        -- the record
        tries INTEGER NOT NULL,
        host TEXT NOT NULL,
        finished INTEGER NOT NULL,           -- milliseconds since 1970, UTC
        environment INTEGER REFERENCES environments (id),
        scene TEXT NOT NULL,                 -- JSON: fields of the scene without a column
        details TEXT                         -- JSON: whatever else the result holds
    )
    """,
    """
    CREATE TABLE arrays (
        collision_sha256 BLOB NOT NULL REFERENCES collisions (collision_sha256),
        name TEXT NOT NULL,
        npy BLOB NOT NULL,                   -- NumPy's .npy format
        PRIMARY KEY (collision_sha256, name)
    ) WITHOUT ROWID
    """,
)

_COLUMN = re.compile(r'^ +"?(\w+)"? (?:TEXT|INTEGER|REAL|BLOB)', re.MULTILINE)
# Tables of a store and their required columns.
TABLE_COLUMNS = {
    name: set(_COLUMN.findall(statement))
    for name, statement in zip(("environments", "collisions", "arrays"), CREATION, strict=True)
}
_COLUMNS = tuple(_COLUMN.findall(CREATION[1]))


def _columns(first: str, last: str) -> tuple[str, ...]:
    """Return the names of the columns from `first` to `last`."""
    return _COLUMNS[_COLUMNS.index(first) : _COLUMNS.index(last) + 1]


SCENE_COLUMNS = (*_columns("potential", "particles"), "engine")
# Fields of a scene that the columns of its row contain; see chaincor.workflows.store.short_scene.
HELD = (*SCENE_COLUMNS, "tolerance", "velocity")
_HELD = ", ".join(HELD)
# SQL expressions for columns that have another form in the file than in a Row. The functions are
# defined in chaincor.workflows.store.short_scene.
EXPRESSIONS = {
    "collision_sha256": "lower(hex(collision_sha256))",
    "scene": f"whole_scene(scene, {_HELD})",
    "scene_sha256": f"scene_sha256(scene, {_HELD})",
    "finished": "strftime('%Y-%m-%dT%H:%M:%f', finished / 1000.0, 'unixepoch') || '+00:00'",
}
_CONVERTED = ("collision_sha256", "finished")
# SQL expressions for all columns of a Row, whose scene stays short.
ROW_COLUMNS = ", ".join(
    f'{EXPRESSIONS[name]} AS "{name}"' if name in _CONVERTED else f'"{name}"' for name in _COLUMNS
)
_FROM_1 = {
    "collision_sha256": "bytes_of_hex(collision_sha256)",
    "scene": f"short_scene(scene, {_HELD})",
    "finished": "CAST(round((julianday(finished) - 2440587.5) * 86400000) AS INTEGER)",
}
_COPIED = ", ".join(_FROM_1.get(name, f'"{name}"') for name in _COLUMNS)
# Item k turns version k + 1 of the schema into version k + 2. To change the schema, change CREATION
# and append an item.
MIGRATIONS: tuple[tuple[str, ...], ...] = (
    (
        "ALTER TABLE collisions RENAME TO old_collisions",
        "ALTER TABLE arrays RENAME TO old_arrays",
        *CREATION[1:],
        f"INSERT INTO collisions SELECT {_COPIED} FROM old_collisions ORDER BY rowid",
        "INSERT INTO arrays SELECT bytes_of_hex(collision_sha256), name, npy FROM old_arrays "
        "WHERE collision_sha256 IN (SELECT collision_sha256 FROM old_collisions)",
        "DROP TABLE old_arrays",
        "DROP TABLE old_collisions",
    ),
)
SCHEMA_VERSION = 1 + len(MIGRATIONS)
# Columns of older versions that are computed on reading.
DROPPED_COLUMNS = {"scene_sha256"}


# Keys of rare bonds have no columns. They are extracted from the scene's JSON.
SCENE_KEYS = tuple(key for key in BOND_KEYS if key not in (*SCENE_COLUMNS, "bond_file"))
FAILURE_COLUMNS = _columns("failure", "failure_stands")
RECORD_COLUMNS = ("collision_sha256", "scene_sha256", "tries", "host", "finished")
# Types of all observables. Observables without a column go to `details`.
_OF_RUNS = {each.name: each.kind for each in OF_RUNS}
RESULT_COLUMNS = tuple(
    # The store itself fills `details`.
    name
    for name in _COLUMNS
    if name in _OF_RUNS and name not in (*SCENE_COLUMNS, "details")
)


def _contact_parameter(key: str) -> str:
    """Return the SQL expression that reads a parameter from the stored text of a contact law."""
    found = []
    for name in laws_with(key):
        law = CONTACT_LAWS[name]
        value = f"json_extract(scene, '$.contact[{law.place_in_identity(key)}]')"
        if law.named_in_identity:
            is_law = f"json_extract(scene, '$.contact[0]') = '{name}'"
        else:
            is_law = "json_type(scene, '$.contact[0]') <> 'text'"
        found.append(f"CASE WHEN {is_law} THEN {value} END")
    return found[0] if len(found) == 1 else f"coalesce({', '.join(found)})"


# SQL expressions for values in the JSON of the scene or of `details`. Such values need no new
# schema, and no columns that are empty in most rows.
BODY_COLUMNS = {
    name: _contact_parameter(name) if name in CONTACT_KEYS else f"json_extract(scene, '$.{name}')"
    for name in BODY_KEYS
    if name != "contact"
} | {
    name: f"json_extract(details, '$.{name}')"
    for name, kind in _OF_RUNS.items()
    if kind in ("int", "float", "bool", "str")
    and name not in (*_COLUMNS, *RECORD_COLUMNS, *BODY_KEYS, *SCENE_KEYS)
}
# Observables without a column whose values are text or lists.
WORDS = tuple(
    name
    for name, kind in _OF_RUNS.items()
    if name not in _COLUMNS and kind not in ("int", "float", "bool")
)
# Columns that can be shown, filtered, plotted and exported.
PLAIN_COLUMNS = (
    *SCENE_COLUMNS,
    *RESULT_COLUMNS,
    *FAILURE_COLUMNS,
    *RECORD_COLUMNS,
    *BODY_COLUMNS,
    *SCENE_KEYS,
)
FLAG_COLUMNS = (*(name for name, kind in _OF_RUNS.items() if kind == "bool"), "failure_stands")
