"""Where the pages of the documentation are that the program reads."""

from pathlib import Path

# Beside the packages in a checkout, among them in a wheel, which holds these pages alone.
DOCUMENTS = Path(__file__).resolve().parents[1] / "docs"
