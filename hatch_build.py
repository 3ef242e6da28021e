"""Build the wheel from the folders themselves: a checkout without symbolic links will do."""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FOLDERS = ("analysis", "lammps_inputs", "workflows")
# What errors mean, for `chaincor explain`; the slips of the paper, for the report of `reproduce`;
# texts and data of the lessons, for `chaincor lessons`.
PAGES = (
    "docs/errors.md",
    "docs/paper_slips.md",
    "docs/tutorials",
    "docs/course/class.md",
    "docs/images/schematic.svg",
    "docs/course/data",
)


class FoldersAsPackages(BuildHookInterface):
    """Put each folder into the package ``chaincor``, where a link to it stands in a checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Say where the files of the wheel are; an editable one has none, and needs the links."""
        root = Path(self.root)
        if version == "editable":
            for name in FOLDERS:
                if not (root / "chaincor" / name).is_dir():
                    raise SystemExit(
                        f"chaincor/{name} is a file; expected a symbolic link: install with "
                        "`pip install .` without --editable, or have git write links "
                        "(git config core.symlinks true; on Windows in developer mode) and check "
                        "out again"
                    )
            return
        for name in FOLDERS:
            # A source distribution has plain files in place of the links, and nothing beside them.
            folder = root / name if (root / name).is_dir() else root / "chaincor" / name
            build_data["force_include"][str(folder)] = f"chaincor/{name}"
        for page in PAGES:
            build_data["force_include"][str(root / page)] = f"chaincor/{page}"
