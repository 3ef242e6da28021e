"""
One step of a free chain by schemes from the literature.

State is particle 1's distance from the wall, the strains and the velocities, as in the in-house
engine; here in NumPy, since only force evaluations are counted. The order of each is observed in
`tests/benchmarks/test_candidates.py`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from benchmarks.schemes import nystrom
from chaincor.workflows.engines.compositions import COMPOSITIONS
from chaincor.workflows.engines.schemes import STEP_SCHEMES

Array = NDArray[np.float64]
State = tuple[float, Array, Array]
# Functions from strains to the force on every particle.
Forces = Callable[[Array], Array]


class Candidate(Protocol):
    """A scheme: what a step of it costs, and the step."""

    order: int
    evaluations: int

    def take_step(self, state: State, step: float, forces: Forces) -> State:
        """Return the state after a step."""


@dataclass(frozen=True)
class Split:
    """Drifts a_k H and kicks b_k H in turns, beginning and ending with a drift."""

    order: int
    drifts: tuple[float, ...]
    kicks: tuple[float, ...]

    @property
    def evaluations(self) -> int:
        """One a kick."""
        return len(self.kicks)

    def take_step(self, state: State, step: float, forces: Forces) -> State:
        """Return the state after a step."""
        x, strain, velocity = state
        for drift, kick in zip(self.drifts, (*self.kicks, 0.0), strict=True):
            x += drift * step * velocity[0]
            strain = strain + drift * step * np.diff(velocity)
            if kick != 0.0:
                velocity = velocity + kick * step * forces(strain)
        return x, strain, velocity


@dataclass(frozen=True)
class Mixed:
    """The step as some numbers of Verlet steps, and the ends mixed."""

    order: int
    counts: tuple[int, ...]
    weights: tuple[float, ...]

    @property
    def evaluations(self) -> int:
        """One a Verlet step."""
        return sum(self.counts)

    def take_step(self, state: State, step: float, forces: Forces) -> State:
        """Return the state after a step."""
        x, strain, velocity = state
        ends = []
        for count in self.counts:
            part = Split(2, (0.5, *[1.0] * (count - 1), 0.5), (1.0,) * count)
            ends.append(part.take_step(state, step / count, forces))
        changes = [
            sum(
                weight * (end[k] - state[k]) for weight, end in zip(self.weights, ends, strict=True)
            )
            for k in range(3)
        ]
        return x + changes[0], strain + changes[1], velocity + changes[2]


@dataclass(frozen=True)
class Nystrom:
    """RKN12(10)17M, see ``nystrom``."""

    order: int = 12
    evaluations: int = len(nystrom.NODES)

    def take_step(self, state: State, step: float, forces: Forces) -> State:
        """Return the state after a step."""
        x, strain, velocity = state
        pushes = np.empty((self.evaluations, len(velocity)))
        for k, (node, row) in enumerate(zip(nystrom.NODES, nystrom.STAGES, strict=True)):
            bent = np.diff(np.array(row) @ pushes[:k]) if k else 0.0
            pushes[k] = forces(strain + node * step * np.diff(velocity) + step**2 * bent)
        shift = step**2 * (np.array(nystrom.POSITIONS) @ pushes)
        return (
            x + step * velocity[0] + shift[0],
            strain + step * np.diff(velocity) + np.diff(shift),
            velocity + step * (np.array(nystrom.VELOCITIES) @ pushes),
        )


def _symmetric(order: int, drifts: tuple[float, ...], kicks: tuple[float, ...]) -> Split:
    """Return a palindrome of its halves, of which that of the kicks ends in the middle."""
    return Split(order, drifts + drifts[::-1], kicks + kicks[-2::-1])


def _composed(order: int, weights: tuple[float, ...]) -> Split:
    padded = (0.0, *weights, 0.0)
    drifts = tuple(0.5 * (a + b) for a, b in pairwise(padded))
    return Split(order, drifts, weights)


def _mixed(name: str) -> Mixed:
    weights, counts = STEP_SCHEMES[name].fractions
    return Mixed(STEP_SCHEMES[name].order, tuple(counts.astype(int).tolist()), tuple(weights))


# Sofroniou and Spaletta (2005), Optim. Methods Softw. 20, 597: half of 35 weights.
_SOFRONIOU = (
    0.07879572252168641926390768, 0.31309610341510852776481247, 0.02791838323507806610952027,
    -0.22959284159390709415121340, 0.13096206107716486317465686, -0.26973340565451071434460973,
    0.07497334315589143566613711, 0.11199342399981020488957508, 0.36613344954622675119314812,
    -0.39910563013603589787862981, 0.10308739852747107731580277, 0.41143087395589023782070412,
    -0.00486636058313526176219566, -0.39203335370863990644808194, 0.05194250296244964703718290,
    0.05066509075992449633587434, 0.04967437063972987905456880,
)  # fmt: skip
# Blanes, Casas, Farres, Laskar, Makazaga and Murua (2013), Appl. Numer. Math. 68, 58.
_DRIFTS_864 = (
    0.0711334264982231177779387300061549964174, 0.241153427956640098736487795326289649618,
    0.521411761772814789212136078067994229991, -0.333698616227678005726562603400438876027,
)  # fmt: skip
_KICKS_864 = (
    0.183083687472197221961703757166430291072, 0.310782859898574869507522291054262796375,
    -0.0265646185119588006972121379164987592663, 0.0653961422823734184559721793911134363710,
)  # fmt: skip

CANDIDATES: dict[str, Candidate] = {
    "Kahan and Li, order 6": _composed(6, COMPOSITIONS["order6"].weights),
    "Kahan and Li, order 8": _composed(8, COMPOSITIONS["order8"].weights),
    "Sofroniou and Spaletta, order 10": _composed(
        10, (*_SOFRONIOU, 1.0 - 2.0 * sum(_SOFRONIOU), *_SOFRONIOU[::-1])
    ),
    "ABA864": _symmetric(4, _DRIFTS_864, _KICKS_864),
    "SRKN14": Split(STEP_SCHEMES["srkn14"].order, *STEP_SCHEMES["srkn14"].fractions),
    "extrapolated12": _mixed("extrapolated12"),
    "extrapolated14": _mixed("extrapolated14"),
    "RKN12(10)": Nystrom(),
}
