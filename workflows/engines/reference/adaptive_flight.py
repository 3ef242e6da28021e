"""Motion with adaptive steps: code shared by chains and beads."""

from collections.abc import Callable
from typing import Any

import numpy as np

from chaincor.workflows.engines.reference.adaptive_loops import PAUSE, Tableau
from chaincor.workflows.engines.time_limit import check_time, steps_at_once

STAGES = 12  # number of stages of the Dormand-Prince method


def dormand_prince() -> Tableau:
    """Return the coefficients of the Dormand-Prince method of order 8."""
    from scipy.integrate import DOP853

    tableau = (DOP853.A, DOP853.B, DOP853.E3, DOP853.E5)
    return Tableau(*(np.ascontiguousarray(part) for part in tableau))


class AdaptiveFlight:
    """Arrays and state of a flight, and the loop that advances them."""

    def __init__(
        self, loop: Callable[..., int], run_state: Any, arrays: Any, parameters: Any, particles: int
    ) -> None:
        self.run_state, self.arrays = run_state, arrays
        self._loop, self._parameters, self._particles = loop, parameters, particles
        self._method = dormand_prince()

    def _advance(self) -> int:
        stages = len(self._method.b)
        while True:
            check_time()
            self.run_state.pause = self.run_state.steps + steps_at_once(stages * self._particles)
            status = self._loop(self.run_state, self.arrays, self._method, self._parameters)
            if status != PAUSE:
                return int(status)

    def warm_up(self) -> None:
        """Load or compile the loops before the integration is timed."""
        longest, self.run_state.longest = float(self.run_state.longest), -1.0
        self._advance()
        self.run_state.longest = longest

    def _make_room(self) -> None:
        contacts, frames = self.arrays.contacts, self.arrays.frames
        if self.run_state.contacts == contacts.shape[1]:
            contacts = np.concatenate((contacts, np.zeros_like(contacts)), axis=1)
        else:
            frames = np.concatenate((frames, np.zeros_like(frames)))
        self.arrays = self.arrays._replace(contacts=contacts, frames=frames)
