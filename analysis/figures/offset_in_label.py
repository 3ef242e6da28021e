"""Tick formatter that writes the common factor of an axis into its label."""

from matplotlib.ticker import ScalarFormatter


class OffsetInLabel(ScalarFormatter):
    """Formatter that writes a common factor or offset after the axis label, not above the panel."""

    def __init__(self) -> None:
        super().__init__(useMathText=True)
        self._plain = self._shown = ""

    def set_locs(self, locs: list[float]) -> None:
        """Set the positions of the ticks, and write their common factor into the label."""
        super().set_locs(locs)
        label = self.axis.label  # type: ignore[union-attr]
        if label.get_text() != self._shown:  # the label is new or has changed
            self._plain = label.get_text()
        offset = super().get_offset()
        self._shown = f"{self._plain} ({offset})" if offset else self._plain
        label.set_text(self._shown)

    def get_offset(self) -> str:
        """Return an empty text, because the label contains the offset."""
        return ""
