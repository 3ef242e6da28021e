"""Locate the documentation pages that the program reads."""

from pathlib import Path

# In a checkout the folder lies beside the packages. In a wheel it lies among them.
DOCUMENTS = Path(__file__).resolve().parents[1] / "docs"
