"""Draw the map of the extremes, with a panel for each engine and number of particles."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.extremes.cells import ENGINES, POTENTIALS, SIZES, SPEEDS, Cell
from benchmarks.extremes.verdicts import Verdict
from chaincor.analysis.figures.style import BLUE, GREEN, GREY, ORANGE, VERMILION, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {"green": GREEN, "amber": ORANGE, "red": VERMILION, "unverified": BLUE}
ABSENT = "#EFEFEF"
# Colours are lightened to make letters on them legible. Red is not lightened.
LIGHT = 0.5
TITLES = {"reference": "in-house", "lammps": "LAMMPS"}
MEANINGS = (
    ("green", "", "right, within 1e-6"),
    ("green", "o", "same, by the limit of hard spheres"),
    ("amber", "w", "right, but the bar is wider than 1e-6, and says so"),
    ("amber", "x", "refused: particles would meet"),
    ("amber", "b", "refused: a bond goes over its barrier"),
    ("amber", "s", "refused: bonds too sharp for fixed steps"),
    ("amber", "d", "refused: drowns in the rounding of coordinates"),
    ("red", "X", "wrong, or an unclear refusal"),
    ("red", "T", "no answer in time"),
    ("unverified", "?", "not verified: no judge, or none sure enough"),
    ("", "", "not run"),
)


def draw(judged: Mapping[tuple[Cell, str], Verdict], path: Path) -> None:
    """Draw the verdicts as colours and letters."""
    figure, panels = new_figure(
        len(ENGINES), len(SIZES), figsize=(12.5, 8.6), sharex=True, sharey=True
    )
    for row, engine in zip(panels, ENGINES, strict=True):
        for panel, size in zip(row, SIZES, strict=True):
            _draw_panel(panel, judged, engine, size)
            panel.set_title(f"{TITLES[engine]}, n = {size}", fontsize=9)
        row[0].set_ylabel("bond")
    panels[-1, 2].set_xlabel("impact speed (units of v*; for harmonic bonds, the velocity)")
    handles = [_swatch(*meaning) for meaning in MEANINGS]
    figure.legend(
        *zip(*handles, strict=True),
        handler_map=_letters(),
        loc="outside lower center",
        ncols=3,
        frameon=False,
        fontsize=9,
    )
    figure.savefig(path, dpi=120)


def _draw_panel(
    panel: "Axes", judged: Mapping[tuple[Cell, str], Verdict], engine: str, size: int
) -> None:
    from matplotlib.patches import Rectangle

    for y, name in enumerate(POTENTIALS):
        for x, speed in enumerate(SPEEDS):
            found = judged.get((Cell(name, size, speed), engine))
            colour = ABSENT if found is None else _light(found.colour)
            panel.add_patch(Rectangle((x - 0.5, y - 0.5), 1, 1, color=colour, linewidth=0))
            if found is not None:
                panel.text(x, y, found.letter, ha="center", va="center", fontsize=7)
    panel.set_xlim(-0.5, len(SPEEDS) - 0.5)
    panel.set_ylim(len(POTENTIALS) - 0.5, -0.5)
    panel.set_xticks(range(len(SPEEDS)), [_short(speed) for speed in SPEEDS], rotation=90)
    panel.set_yticks(range(len(POTENTIALS)), list(POTENTIALS))
    panel.tick_params(length=0, labelsize=7)
    panel.grid(False)
    for edge in range(1, len(SPEEDS)):
        panel.axvline(edge - 0.5, color="white", linewidth=0.8)
    for edge in range(1, len(POTENTIALS)):
        panel.axhline(edge - 0.5, color="white", linewidth=0.8)
    for spine in panel.spines.values():
        spine.set_visible(False)


def _short(speed: float) -> str:
    return (
        f"{speed:g}"
        if 0.01 <= speed < 1e3
        else f"{speed:.0e}".replace("e-0", "e-").replace("+0", "")
    )


def _light(colour: str) -> tuple[float, ...]:
    from matplotlib.colors import to_rgb

    share = 1.0 if colour == "red" else LIGHT
    return tuple(1.0 - share * (1.0 - part) for part in to_rgb(COLOURS[colour]))


def _swatch(colour: str, letter: str, meaning: str):  # type: ignore[no-untyped-def]
    from matplotlib.patches import Patch

    patch = Patch(facecolor=_light(colour) if colour else ABSENT, edgecolor=GREY)
    patch.letter = letter
    return patch, meaning


def _letters():  # type: ignore[no-untyped-def]
    """Return the handler that draws letters into the patches of a legend."""
    from matplotlib.legend_handler import HandlerPatch
    from matplotlib.patches import Patch
    from matplotlib.text import Text

    class Lettered(HandlerPatch):
        def create_artists(self, legend, handle, x, y, width, height, size, transform):
            drawn = super().create_artists(legend, handle, x, y, width, height, size, transform)
            place = (0.5 * (width - x), 0.5 * (height - y))
            text = Text(*place, handle.letter, ha="center", va="center", fontsize=8)
            text.set_transform(transform)
            return [*drawn, text]

    return {Patch: Lettered()}
