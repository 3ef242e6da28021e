"""Results that show themselves where they are the last line of a cell or of a session."""

from chaincor.workflows.showing.described import Described
from chaincor.workflows.showing.plots import Plots
from chaincor.workflows.showing.table import html_table
from chaincor.workflows.showing.text import describe_shortly


class Shown(Described):
    """What a result shows of itself."""

    def __repr__(self) -> str:
        return describe_shortly(self)

    def __str__(self) -> str:
        return describe_shortly(self)

    def _repr_html_(self) -> str:
        return html_table(self)

    @property
    def plot(self) -> Plots:
        """Pictures: ``world_lines()``, ``spectrum()``, ``energy()``, ``contacts()`` and so on."""
        return Plots(self)
