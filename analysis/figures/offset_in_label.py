"""What all numbers of an axis have in common, such as a power of ten, said in the axis's label."""

from matplotlib.ticker import ScalarFormatter


class OffsetInLabel(ScalarFormatter):
    """A formatter that says a common factor or summand after the label, not above the panel."""

    def __init__(self) -> None:
        super().__init__(useMathText=True)
        self._plain = self._told = ""

    def set_locs(self, locs: list[float]) -> None:
        """Take the places of the ticks, and tell in the label what they have in common."""
        super().set_locs(locs)
        label = self.axis.label  # type: ignore[union-attr]
        if label.get_text() != self._told:  # the first time, or a new one since
            self._plain = label.get_text()
        offset = super().get_offset()
        self._told = f"{self._plain} ({offset})" if offset else self._plain
        label.set_text(self._told)

    def get_offset(self) -> str:
        """Return nothing: the label has it."""
        return ""
