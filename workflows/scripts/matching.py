"""Match the particles of two runs by id or by initial position."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.scripts.frames import ScriptFrames

IndexArray = NDArray[np.intp]
# Two positions agree if they differ by less than _SAME_PLACE times the distance between neighbours.
# Two velocities agree if they differ by less than _SAME_SPEED times the root-mean-square velocity.
_SAME_PLACE, _SAME_SPEED = 1e-9, 1e-9


@dataclass(frozen=True)
class Match:
    """Pairs of corresponding particles in two runs, and whether the runs start alike."""

    order: IndexArray  #: For each particle of the first run, its index in the second run.
    renumbered: bool  #: Whether ids differ, so that particles were matched by position.
    same_places: bool  #: Whether the positions agree up to rounding.
    same_speeds: bool  #: Whether the velocities agree up to rounding.


def match_particles(first: ScriptFrames, second: ScriptFrames, at: tuple[int, int]) -> Match:
    """
    Match the particles of two runs in two frames of equal time.

    `at` gives the index of the frame in each run. Positions are compared in the periodic box.
    Velocities are compared only if both indices are 0, because only first frames have velocities.
    """
    here, there = first.positions[at[0]], second.positions[at[1]]
    here, there = (each[np.isfinite(each[:, 0])] for each in (here, there))
    order = np.arange(min(len(here), len(there)))
    allowed = _SAME_PLACE * first.spacing
    if len(here) != len(there):
        return Match(order, False, False, False)
    same_places = bool(np.all(_distances(here, there, first.edges) <= allowed))
    renumbered = False
    if not same_places:
        found = _nearest(here, there, first.edges)
        apart = _distances(here, there[found], first.edges)
        if len(set(found.tolist())) == len(here) and np.all(apart <= allowed):
            order, renumbered, same_places = found, True, True
    same_speeds = True
    if at == (0, 0) and len(first.velocities) == len(second.velocities) == len(order):
        speeds = second.velocities[order]
        size = float(np.sqrt(np.mean(first.velocities**2))) or 1.0
        same_speeds = bool(np.all(np.abs(first.velocities - speeds) <= _SAME_SPEED * size))
    return Match(order, renumbered, same_places, same_speeds)


def _distances(here: Array, there: Array, edges: Array) -> Array:
    """Return the distances between the nearest periodic images of the particles."""
    apart = here - there
    inside = np.isfinite(edges)
    apart[:, inside] -= edges[inside] * np.round(apart[:, inside] / edges[inside])
    return np.sqrt(np.sum(apart**2, axis=1))


def _nearest(here: Array, there: Array, edges: Array) -> IndexArray:
    """Return, for each particle of `here`, the index of the nearest particle of `there`."""
    from scipy.spatial import KDTree

    box = np.where(np.isfinite(edges), edges, 0.0)
    wrapped = [
        np.where(box > 0.0, np.mod(each, np.where(box > 0.0, box, 1.0)), each)
        for each in (here, there)
    ]
    # SciPy's tree refuses a position that was rounded up to the edge of the box.
    wrapped = [np.where((box > 0.0) & (each >= box), 0.0, each) for each in wrapped]
    shift = np.where(box > 0.0, 0.0, np.minimum(*(each.min(axis=0) for each in wrapped)))
    tree = KDTree(wrapped[1] - shift, boxsize=box)
    return np.asarray(tree.query(wrapped[0] - shift)[1], dtype=np.intp)
