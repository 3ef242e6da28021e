"""
Warm chains at one step for all: a distribution needs no single collision to be right.

Long chains amplify what steps miss, so that another step gives another number. Composed steps keep
volumes in phase space, and can be reversed, as the motion does and can: numbers are then others of
the same distribution. Runs at three steps that agree in the distribution confirm this.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from chaincor import Scene
from chaincor.workflows.campaign.groups import group_scenes
from chaincor.workflows.engines.reference.batch.runner import Batch

SCHEME = "order8"


@dataclass(frozen=True)
class Carried:
    """Collisions at one step."""

    e: NDArray[np.float64]  #: Restitution of speeds; nan if no end was found; of shape (samples,).
    contacts: NDArray[np.int64]  #: Number of contacts; of shape (samples,).
    endings: list[str]  #: Ending of each collision.


def carry(
    scene: Scene, samples: int, step: float, velocities: NDArray[np.float64] | None = None
) -> Carried:
    """Carry out the collisions of so many seeds; what is drawn is the same at any step."""
    (group,) = group_scenes(scene.replace(seed=1), samples, velocities)
    batch = Batch(scene.line, scene.bond, SCHEME)
    share, parts = batch.share(step), []
    for begin in range(0, samples, share):
        part = group[begin : begin + share]
        runs = batch.follow(part.starts(), np.full(len(part), step))
        e = np.where(runs.settled, runs.speeds / part.velocities, np.nan)
        kinds = ["open" if ending is None else ending.kind for ending in runs.endings]
        parts.append(Carried(e, runs.counts, kinds))
    return Carried(
        np.concatenate([part.e for part in parts]),
        np.concatenate([part.contacts for part in parts]),
        [kind for part in parts for kind in part.endings],
    )


def same_probability(up: int, down: int) -> float:
    """Return how likely samples that change sides do so as unequally as these, by McNemar."""
    return float(stats.binomtest(up, up + down).pvalue) if up + down else 1.0
