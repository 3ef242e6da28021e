"""Display figures in a session: in a notebook, or by pyplot if it has been imported."""

import contextlib
import io
import sys
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Figures have almost twice as many pixels per inch as they are displayed with, for high-resolution
# screens.
_DOTS_PER_INCH = 160
_PIXELS_PER_INCH = 90
# Seconds between updates. A notebook stores every message that it receives.
_BAR_SECONDS = 0.3


def in_notebook() -> bool:
    """Return whether this process is a notebook's kernel, which has no terminal and shows HTML."""
    return hasattr(_shell(), "kernel")


def _shell() -> Any:
    if "IPython" not in sys.modules:
        return None
    from IPython import get_ipython

    return get_ipython()


def session_bar(most: int) -> Callable[[float, str], None]:
    """
    Show a progress bar in a notebook without widgets; return a function that updates it.

    The function takes the length of the bar and its text. The bar is complete at the length `most`.
    """
    from html import escape

    from IPython.display import HTML, display

    shown = 0.0
    handle = display(HTML(""), display_id=True)

    def show(length: float, words: str) -> None:
        nonlocal shown
        now = time.monotonic()
        if length < most and now < shown + _BAR_SECONDS:
            return
        shown = now
        bar = f'<progress value="{length:.4g}" max="{most}"></progress>'
        handle.update(HTML(f"{bar} {escape(words)}"))

    return show


def session_axes(settings: Any) -> "Axes":
    """
    Return the axes of a new figure, which the session displays.

    In a notebook the figure appears below the cell that made it, including later changes in the
    same cell. If the session has imported pyplot, ``plt.show()`` shows the figure; otherwise use
    ``ax.figure.savefig(...)``. `settings` are settings of matplotlib.
    """
    with _only(settings):
        if "matplotlib.pyplot" in sys.modules:
            import matplotlib.pyplot as plt

            return plt.figure().subplots()
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        figure = Figure()
        FigureCanvasAgg(figure)
        if in_notebook():
            _show_after_cell(figure)
        return figure.subplots()


@contextlib.contextmanager
def _only(settings: Any) -> Iterator[None]:
    """Change some settings of matplotlib within a block."""
    from matplotlib import rcParams

    # rc_context would also undo the settings of a backend that is loaded within the block.
    before = {name: rcParams[name] for name in settings}
    rcParams.update(settings)
    try:
        yield
    finally:
        rcParams.update(before)


def _show_after_cell(figure: "Figure") -> None:
    events = _shell().events

    def show(*_: Any) -> None:
        events.unregister("post_run_cell", show)
        from IPython.display import Image, display

        picture = io.BytesIO()
        figure.savefig(picture, format="png", dpi=_DOTS_PER_INCH)
        width = round(figure.get_figwidth() * _PIXELS_PER_INCH)
        display(Image(picture.getvalue(), format="png", width=width))

    events.register("post_run_cell", show)
