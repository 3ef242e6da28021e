"""Test that the character picture of one moment shows positions and velocities."""

import numpy as np

from chaincor.analysis.figures.terminal import draw_moment


def lines_of(displacements, velocities, **options):
    text = draw_moment(
        displacements, velocities, impact_velocity=0.1, longest=10.0, columns=12, rows=9, **options
    )
    lines = text.plain.splitlines()
    assert len(lines) == 10
    assert all(len(line) == 12 and line[0] == "█" for line in lines)
    return [line[1:] for line in lines]


def test_particles_stand_where_they_are():
    # positions 0, 3, 10 on an axis from 0 to 10
    *_, chain = lines_of([0.0, 2.0, 8.0], [0.1, 0.0, -0.1])
    assert [k for k, mark in enumerate(chain) if mark == "●"] == [0, 3, 10]


def test_the_height_of_a_mark_is_the_velocity():
    # Rows -4 to 4 stand for -1.5 to 1.5, so v0 is at row 2.7. Larger velocities stay at the edge.
    *plot, _ = lines_of([0.0, 2.0, 4.0, 7.0], [0.1, 0.0, -0.1, 1.0])
    columns = ["".join(line[k] for line in plot) for k in (0, 3, 6, 10)]
    assert [4 - column.index("•") for column in columns] == [3, 0, -3, 4]


def test_particles_that_share_a_column_show_their_mean():
    *plot, chain = lines_of(
        np.zeros(9),
        [0.1, -0.1] * 4 + [-0.1],
    )
    assert chain.count("●") == 9
    crowded = draw_moment(
        np.zeros(100), [0.1, -0.1] * 50, impact_velocity=0.1, longest=100.0, columns=11, rows=9
    )
    *plot, chain = crowded.plain.splitlines()
    # A column stands for ten particles, the first and the last for five. Half of them approach,
    # half leave.
    assert chain == "█" + 10 * "●"
    assert plot[4].count("•") >= 8
