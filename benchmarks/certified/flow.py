"""
Enclose one step of a chain's motion.

The unknowns are the gap g between the first particle and the wall, the strains s_j of the bonds and
the velocities v_i. In the frame of the wall, between contacts,

    g' = v_1,    s_j' = v_{j+1} - v_j,    m_i v_i' = U'(s_i) - U'(s_{i-1}).

These equations have the form x' = f(x). Let B be a box around x(0) in complex space with x(0) + z
f(B) inside B for all abs(z) <= R. The motion then exists and is analytic for these z, and stays in
B (Picard and Lindeloef). According to Cauchy's estimate, its Taylor coefficients are at most rho /
R^k with the half-width rho of B. The remainder after the last computed coefficient is bounded by a
geometric series.
"""

from collections import defaultdict
from dataclasses import dataclass
from itertools import pairwise

from flint import acb, arb

from benchmarks.certified.bonds import Bond, Memory

# Length of a step, as a fraction of the disc in which the motion was proved to exist. Longer steps
# need more terms, and shorter steps are more numerous. The fraction exp(-2) minimises the number of
# steps times the squared number of terms.
STEP_SHARE = 1 / 8
# Width of the first box in units of the motion at the rates of its centre, and how often the box is
# widened before a smaller disc is tried.
_WIDER, _TRIES = 1.2, 3


class NotProvedError(Exception):
    """Error: a statement cannot be proved with these digits or methods."""


@dataclass(frozen=True)
class State:
    """Gap, n - 1 strains and n velocities in the frame of the wall, as balls."""

    gap: arb
    strains: tuple[arb, ...]
    velocities: tuple[arb, ...]

    def flat(self) -> list[arb]:
        """Return gap, strains and velocities in one list."""
        return [self.gap, *self.strains, *self.velocities]

    @classmethod
    def from_flat(cls, values: list[arb]) -> "State":
        """Return the state from a list of 2 n balls."""
        n = len(values) // 2
        return cls(values[0], tuple(values[1:n]), tuple(values[n:]))


@dataclass(frozen=True)
class Step:
    """Motion during a time: Taylor polynomials, and bounds on their remainders."""

    terms: list[list[arb]]  #: Taylor coefficients of each unknown.
    widths: list[arb]  #: Half-widths rho of the box, for each unknown.
    disc: arb  #: Radius R of a disc of complex times in which the motion stays in the box.
    length: arb  #: Length of the step, less than R.

    def unknown(self, index: int, time: arb) -> arb:
        """Enclose an unknown for all times in a ball within the step."""
        return _polynomial(self.terms[index], time) + self._left_out(index, time)

    def slope_from_zero(self, index: int, time: arb) -> arb:
        """Enclose (x(t) - x(0))/t, which has no zero if x never returns to x(0)."""
        left_out = self.widths[index] / self.disc * self._tail(time, len(self.terms[0]) - 1)
        return _polynomial(self.terms[index][1:], time) + arb(0, left_out.upper())

    def state(self, time: arb) -> State:
        """Enclose all unknowns at a time."""
        return State.from_flat([self.unknown(i, time) for i in range(len(self.terms))])

    def _left_out(self, index: int, time: arb) -> arb:
        return arb(0, (self.widths[index] * self._tail(time, len(self.terms[0]))).upper())

    def _tail(self, time: arb, terms: int) -> arb:
        ratio = abs(time).upper() / self.disc
        return ratio**terms / (1 - ratio)


def _polynomial(terms: list[arb], time: arb) -> arb:
    value = arb(0)
    for term in reversed(terms):
        value = value * time + term
    return value


@dataclass(frozen=True)
class Chain:
    """Chain of particles."""

    bond: Bond  #: Bond between neighbours.
    masses: tuple[arb, ...]  #: Masses of the particles, from the wall outward.

    def step(self, state: State, terms: int, longest: float) -> Step:
        """Enclose the motion after a state, with `terms` Taylor terms."""
        disc, widths = self._disc(state)
        length = min(arb(STEP_SHARE * float(disc.mid())), arb(longest), key=float)
        return Step(self._terms(state, terms), widths, disc, length)

    def _terms(self, state: State, terms: int) -> list[list[arb]]:
        n = len(self.masses)
        strains = [[strain] for strain in state.strains]
        velocities = [[velocity] for velocity in state.velocities]
        gap = [state.gap]
        memories: list[Memory] = [defaultdict(list) for _ in strains]
        for k in range(1, terms):
            pull = [
                self.bond.next_term(strain, memory)
                for strain, memory in zip(strains, memories, strict=True)
            ]
            gap.append(velocities[0][-1] / k)
            speeds = [velocity[-1] for velocity in velocities]
            for j, strain in enumerate(strains):
                strain.append((speeds[j + 1] - speeds[j]) / k)
            for i, (velocity, mass) in enumerate(zip(velocities, self.masses, strict=True)):
                force = (pull[i] if i < n - 1 else 0) - (pull[i - 1] if i > 0 else 0)
                velocity.append(arb(force) / (k * mass))
        return [gap, *strains, *velocities]

    def _disc(self, state: State) -> tuple[arb, list[arb]]:
        """Return the radius of a disc of times, and half-widths of a box around the motion."""
        start = [acb(value) for value in state.flat()]
        for disc in (arb(2) ** (2 - k / 4) for k in range(80)):
            disc = arb(float(disc.mid()))
            widths = [(_WIDER * disc * abs(rate)).upper() for rate in self._rates(start)]
            for _ in range(_TRIES * len(start)):
                box = [
                    value + acb(arb(0, width), arb(0, width))
                    for value, width in zip(start, widths, strict=True)
                ]
                moved = [(disc * abs(rate)).upper() for rate in self._rates(box)]
                if not all(bound.is_finite() for bound in moved):
                    break
                if all(bound <= width for bound, width in zip(moved, widths, strict=True)):
                    return disc, widths
                widths = [
                    (bound * arb(1.1)).upper() if not bound <= width else width
                    for bound, width in zip(moved, widths, strict=True)
                ]
        raise NotProvedError("no box encloses the motion, for however short a time")

    def _rates(self, values: list[acb]) -> list[acb]:
        n = len(self.masses)
        strains, velocities = values[1:n], values[n:]
        pull = [self.bond.force(strain) for strain in strains]
        zero = acb(0)
        return [
            velocities[0],
            *(after - before for before, after in pairwise(velocities)),
            *(
                ((pull[i] if i < n - 1 else zero) - (pull[i - 1] if i > 0 else zero)) / mass
                for i, mass in enumerate(self.masses)
            ),
        ]
