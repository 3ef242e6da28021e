"""Run documents, and copy the pictures that their code draws to docs/images."""

import re
import shutil
import sys
import tempfile
from pathlib import Path

from tests.docs.documents import ROOT, run_document


def update_pictures(document: Path) -> None:
    """
    Run a document and keep the pictures that it shows.

    Parameters
    ----------
    document : pathlib.Path
        Path of the document.
    """
    shown = set(re.findall(r"images/([\w.-]+)", document.read_text()))
    with tempfile.TemporaryDirectory() as folder:
        run_document(document, Path(folder))
        for picture in Path(folder).iterdir():
            if picture.name in shown:
                shutil.copy(picture, ROOT / "docs" / "images" / picture.name)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        update_pictures(Path(name).resolve())
