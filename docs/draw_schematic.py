"""Draw the wall, the numbered chain and the x axis, before and after the collision."""

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

PICTURE = Path(__file__).parent / "images" / "schematic.svg"

_WALL, _SPACING, _RADIUS = 70.0, 105.0, 15.0
_INK, _BLUE, _RED = "#1b1f24", "#0072B2", "#D55E00"
_STYLE = (
    'font-family="system-ui, -apple-system, Segoe UI, DejaVu Sans, sans-serif" font-size="18" '
    f'fill="{_INK}" stroke-linecap="round" stroke-linejoin="round"'
)


def draw() -> str:
    """Return the picture as SVG without a background."""
    before = [_WALL + _SPACING * x for x in (0.4, 1.4, 2.4, 4.4)]
    # Not to scale: a vibrating chain has unequal bond lengths and velocities.
    after = [_WALL + _SPACING * x for x in (0.85, 1.95, 2.8, 4.85)]
    parts = [
        *_row(
            before,
            96.0,
            "shortly before: every velocity −v₀, every bond U(r) at r = 1",
            [-46.0] * 4,
        ),
        *_row(after, 246.0, "after: V = e v₀ on average, and vibration", [62.0, 24.0, 56.0, 44.0]),
        *_axis(326.0),
    ]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="640" height="366" '
        f'viewBox="0 0 640 366" {_STYLE}>\n' + "\n".join(parts) + "\n</svg>\n"
    )


def _row(places: Sequence[float], y: float, name: str, speeds: Sequence[float]) -> list[str]:
    """Draw one state: wall, bonds, numbered particles, and an arrow for each velocity."""
    numbers = ["1", "2", "3", "n"]
    parts = [_text(20, y - 68, name, weight=600), *_wall(y - 44, y + 34)]
    for left, right in pairwise(places[:3]):
        parts.append(_spring(left + _RADIUS, right - _RADIUS, y))
    parts.append(_spring(places[2] + _RADIUS, places[2] + 60.0, y, turns=3))
    parts.append(_text((places[2] + places[3]) / 2, y + 5, "· · ·", anchor="middle"))
    parts.append(_spring(places[3] - 60.0, places[3] - _RADIUS, y, turns=3))
    for place, number, speed in zip(places, numbers, speeds, strict=True):
        parts.append(
            f'<circle cx="{place:.1f}" cy="{y:.1f}" r="{_RADIUS}" fill="{_BLUE}" stroke="none"/>'
        )
        parts.append(_text(place, y + 6, number, anchor="middle", weight=600, ink="#fff"))
        start = place - math.copysign(0.5 * abs(speed), speed)
        parts.append(_arrow(start, start + speed, y - 30.0, _RED))
    return parts


def _wall(top: float, bottom: float) -> list[str]:
    hatching = "".join(
        f"M{_WALL - 16:.0f} {y + 12:.0f}L{_WALL:.0f} {y:.0f}"
        for y in range(int(top), int(bottom), 13)
    )
    return [
        f'<path d="{hatching}" stroke="{_INK}" stroke-width="1.2" fill="none"/>',
        f'<path d="M{_WALL} {top}V{bottom}" stroke="{_INK}" stroke-width="3" fill="none"/>',
    ]


def _spring(left: float, right: float, y: float, turns: int = 5) -> str:
    """Return the zigzag line of a spring, with straight ends."""
    end = 7.0
    width = (right - left - 2 * end) / turns
    points = [(left, y), (left + end, y)]
    for k in range(turns):
        points.append((left + end + (k + 0.25) * width, y - 8.0))
        points.append((left + end + (k + 0.75) * width, y + 8.0))
    points += [(right - end, y), (right, y)]
    path = "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in points)
    return f'<path d="{path}" stroke="{_INK}" stroke-width="1.5" fill="none"/>'


def _arrow(start: float, end: float, y: float, ink: str = _INK) -> str:
    back = math.copysign(8.0, end - start)
    return (
        f'<path d="M{start:.1f} {y:.1f}H{end:.1f}M{end - back:.1f} {y - 4:.1f}L{end:.1f} {y:.1f}'
        f'L{end - back:.1f} {y + 4:.1f}" stroke="{ink}" stroke-width="2" fill="none"/>'
    )


def _axis(y: float) -> list[str]:
    parts = [_arrow(_WALL - 30.0, 624.0, y)]
    for k in range(5):
        place = _WALL + k * _SPACING
        parts.append(f'<path d="M{place} {y - 5}V{y + 5}" stroke="{_INK}" stroke-width="1.5"/>')
        parts.append(_text(place, y + 26, str(k), anchor="middle"))
    parts.append(_text(_WALL - 14, y + 26, "wall", anchor="end"))
    return [*parts, _text(620, y + 26, "x", anchor="middle")]


def _text(
    x: float,
    y: float,
    text: str,
    *,
    anchor: str = "start",
    weight: int = 400,
    ink: str = _INK,
) -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-weight="{weight}" '
        f'fill="{ink}">{text}</text>'
    )


if __name__ == "__main__":
    PICTURE.write_text(draw(), encoding="utf-8")
