"""Build the wheel from the folders themselves: a checkout without symbolic links will do."""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FOLDERS = ("analysis", "lammps_inputs", "workflows")


class FoldersAsPackages(BuildHookInterface):
    """Put each folder into the package ``chaincor``, where a link to it stands in a checkout."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Say where the files of the wheel are; refuse an editable one that needs the links."""
        root = Path(self.root)
        for name in FOLDERS:
            link = root / "chaincor" / name
            if version == "editable" and not link.is_dir():
                raise SystemExit(
                    f"chaincor/{name} is a file; expected a symbolic link: install with "
                    "`pip install .` without --editable, or have git write links "
                    "(git config core.symlinks true; on Windows in developer mode) and check out "
                    "again"
                )
            # A source distribution has plain files in place of the links, and nothing beside them.
            folder = root / name if (root / name).is_dir() else link
            build_data["force_include"][str(folder)] = f"chaincor/{name}"
