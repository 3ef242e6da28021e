"""Folder of the documentation pages that the program reads."""

from pathlib import Path

# The folder is beside the packages in a checkout, and among them in a wheel.
DOCUMENTS = Path(__file__).resolve().parents[1] / "docs"
