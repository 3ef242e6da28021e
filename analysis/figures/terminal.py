"""Draw a chain with its velocities, or a histogram, as lines of text."""

import numpy as np
from numpy.typing import ArrayLike
from rich.text import Text

from chaincor.analysis.figures.style import BLUE, GREY, ORANGE, SKY, rest_positions

# Colours range from blue (towards the wall) through grey to yellow (away from the wall).
# Colour-blind readers can distinguish these colours. The height of a symbol also shows the
# velocity.
_COLOURS = (BLUE, SKY, GREY, ORANGE, "#F0E442")
_WALL, _PARTICLE, _SPEED, _REST = "█", "●", "•", "─"
_HISTOGRAM_COLUMNS, _HISTOGRAM_ROWS = 78, 20


def draw_moment(
    displacements: ArrayLike,
    velocities: ArrayLike,
    *,
    impact_velocity: float,
    longest: float,
    columns: int = 80,
    rows: int = 9,
    lowest: float = 0.0,
    targets: int = 0,
) -> Text:
    """
    Draw one state of a chain as lines of text.

    The upper lines show velocities from -1.5 to 1.5 v0; larger velocities are drawn at the edge.
    The last line shows the chain. If particles share a column, the column shows their mean
    velocity.

    Particle 1 comes first. The wall is at x = 0, and the last column is at x = `longest`.
    Velocities occupy `rows` lines, an odd number. If the first `targets` particles are those of a
    free target, beginning at its far end, the first column is at x = `lowest`, and no wall is
    drawn.
    """
    u = np.asarray(displacements, dtype=float)
    x = u + rest_positions(u.size, targets)
    v = np.asarray(velocities, dtype=float) / impact_velocity
    width = columns - 1
    place = np.clip(
        ((x - lowest) / (longest - lowest) * (width - 1)).round().astype(int), 0, width - 1
    )
    count = np.bincount(place, minlength=width)
    seen = np.flatnonzero(count)
    mean = np.bincount(place, weights=v, minlength=width)[seen] / count[seen]
    middle = rows // 2
    height = np.clip((mean / 1.5 * middle).round().astype(int), -middle, middle)
    shade = np.clip((mean / 1.2 * 2.0).round().astype(int), -2, 2) + 2

    grid = np.full((rows + 1, width), " ")
    grid[middle, :] = _REST
    styles = np.full((rows + 1, width), "dim", dtype=object)
    for column, up, colour in zip(seen, height, shade, strict=True):
        for row, mark in ((middle - up, _SPEED), (rows, _PARTICLE)):
            grid[row, column] = mark
            styles[row, column] = _COLOURS[colour]
    text = Text()
    for row in range(rows + 1):
        text.append(" " if targets else _WALL)
        for mark, style in zip(grid[row], styles[row], strict=True):
            text.append(str(mark), style)
        text.append("\n")
    return text


def draw_histogram(values: ArrayLike, *, label: str, mark: float) -> str:
    """
    Draw a histogram as text, with one line per bin.

    Bins have a width of 1, 2 or 5 times a power of ten. About twenty bins contain the middle 99 %
    of the values. The first bin also contains all smaller values, and the last bin all larger
    values. Each line has the lower edge of the bin, a bar and the number of values, in at most 78
    columns. An arrow marks the edge that equals `mark`.
    """
    x = np.sort(np.asarray(values, dtype=float))
    low, high = np.quantile(x, (0.005, 0.995))
    width = _round_width((high - low) / _HISTOGRAM_ROWS)
    first = int(np.floor(low / width))
    count = int(np.floor(high / width)) - first + 1
    bins = np.clip(np.floor(x / width).astype(int) - first, 0, count - 1)
    heights = np.bincount(bins, minlength=count)
    digits = max(0, -int(np.floor(np.log10(width) + 1e-9)))
    edges = [f"{(first + k) * width:.{digits}f}" for k in range(count)]
    left, right = max(map(len, edges)), len(str(heights.max()))
    longest = _HISTOGRAM_COLUMNS - left - right - 5
    lines = [f"{label:>{left}}"]
    for k, (edge, height) in enumerate(zip(edges, heights.tolist(), strict=True)):
        pointed = k > 0 and round(mark / width) == first + k
        eighths = round(8 * longest * height / heights.max())
        bar = "█" * (eighths // 8) + _EIGHTHS[eighths % 8]
        lines.append(f"{edge:>{left}} {'>' if pointed else '|'} {bar} {height}")
    return "\n".join(lines)


# Blocks from zero to seven eighths of a character wide.
_EIGHTHS = ("", "▏", "▎", "▍", "▌", "▋", "▊", "▉")


def _round_width(width: float) -> float:
    """Round a width up to 1, 2 or 5 times a power of ten; return 1 for equal values."""
    if not width > 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(width))
    return float(next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= width * 0.999999))
