"""
Simulate warm chains at a common time step, for distributions instead of single results.

Long chains amplify errors due to the time step, and another time step gives another result for a
single collision. Composed steps, like the exact motion, preserve volumes in phase space and are
reversible. The results at another time step are therefore other samples from the same distribution.
Runs at three time steps whose distributions agree confirm this.
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
    """Results of collisions at one time step."""

    e: NDArray[
        np.float64
    ]  #: Ratio of speeds, of shape (samples,); nan if the end of the collision was not found.
    contacts: NDArray[np.int64]  #: Number of contacts; of shape (samples,).
    endings: list[str]  #: Ending of each collision.


def carry(
    scene: Scene, samples: int, step: float, velocities: NDArray[np.float64] | None = None
) -> Carried:
    """Simulate collisions for many seeds; initial states do not depend on the time step."""
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
    """Return the p-value of McNemar's test, from the numbers of changes in both directions."""
    return float(stats.binomtest(up, up + down).pvalue) if up + down else 1.0
