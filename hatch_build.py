"""Build the wheel from the folders, so that a checkout needs no symbolic links."""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FOLDERS = ("analysis", "lammps_inputs", "workflows")
# `chaincor explain` reads the page of errors, the report of `reproduce` the slips of the paper, and
# `chaincor lessons` the texts and data of the lessons.
PAGES = (
    "docs/errors.md",
    "docs/paper_slips.md",
    "docs/tutorials",
    "docs/course/class.md",
    "docs/images/schematic.svg",
    "docs/course/data",
)


class FoldersAsPackages(BuildHookInterface):
    """Put each folder into the package ``chaincor``; a checkout has links there instead."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the folders and pages to the wheel; require the links for an editable install."""
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
            # A source distribution has the folder itself in place of each link.
            folder = root / name if (root / name).is_dir() else root / "chaincor" / name
            build_data["force_include"][str(folder)] = f"chaincor/{name}"
        for page in PAGES:
            build_data["force_include"][str(root / page)] = f"chaincor/{page}"
