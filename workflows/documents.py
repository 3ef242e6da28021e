"""Locate the documentation pages that the program reads."""

from pathlib import Path

# In a checkout, the folder ``docs`` lies beside the packages; in a wheel it lies among the
# packages.
DOCUMENTS = Path(__file__).resolve().parents[1] / "docs"
