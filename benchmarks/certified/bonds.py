"""Forces and energies of the named bonds in ball arithmetic."""

from collections import defaultdict
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from flint import acb, arb, arb_mat

# Known coefficients of the series from which the force of a bond is computed, by name.
Memory = defaultdict[str, list[arb]]


class Bond(Protocol):
    """Bond for proofs: Taylor coefficients of U'(s), U' on complex boxes, and U(s)."""

    # Energy above which a bond may break; None if it never breaks.
    breaks_at: Fraction | None

    def next_term(self, strain: list[arb], memory: Memory) -> arb:
        """Return the Taylor coefficient of U'(s(t)) of the same order as the strain's last one."""

    def force(self, strain: acb) -> acb:
        """Return U'(s) on a box of the complex plane; not finite if the box contains a pole."""

    def energy(self, strain: arb) -> arb:
        """Return U(s), with U(0) = 0."""


def _dot(left: list[arb], right: list[arb]) -> arb:
    """Return the sum of products, with a single rounding by the library."""
    return (arb_mat(1, len(left), left) * arb_mat(len(right), 1, right))[0, 0]


def _next_of_power(power: int, base: list[arb], known: list[arb]) -> arb:
    """Append the next coefficient of base^power to the known coefficients, and return it."""
    order = len(known)
    if order == 0:
        known.append(base[0] ** power)
    else:
        weights = [(power * j - (order - j)) * base[j] for j in range(1, order + 1)]
        known.append(_dot(weights, known[::-1]) / (order * base[0]))
    return known[-1]


@dataclass(frozen=True)
class Harmonic:
    """U = s^2/2."""

    breaks_at = None

    def next_term(self, strain: list[arb], memory: Memory) -> arb:
        return strain[-1]

    def force(self, strain: acb) -> acb:
        return strain

    def energy(self, strain: arb) -> arb:
        return strain * strain / 2


@dataclass(frozen=True)
class Toda:
    """U = (exp(-b s) - 1)/b^2 + s/b."""

    b: int = 10
    breaks_at = None

    def next_term(self, strain: list[arb], memory: Memory) -> arb:
        known = memory["exp(-b s)"]
        order = len(known)
        if order == 0:
            known.append((-self.b * strain[0]).exp())
            return (1 - known[0]) / self.b
        weights = [j * strain[j] for j in range(1, order + 1)]
        known.append(-self.b * _dot(weights, known[::-1]) / order)
        return -known[-1] / self.b

    def force(self, strain: acb) -> acb:
        return (1 - (-self.b * strain).exp()) / self.b

    def energy(self, strain: arb) -> arb:
        return ((-self.b * strain).exp() - 1) / self.b**2 + strain / self.b


@dataclass(frozen=True)
class Log:
    """U = s - ln(1 + s)."""

    breaks_at = None

    def next_term(self, strain: list[arb], memory: Memory) -> arb:
        length = [1 + strain[0], *strain[1:]]
        inverse = _next_of_power(-1, length, memory["1/r"])
        return (1 if len(strain) == 1 else 0) - inverse

    def force(self, strain: acb) -> acb:
        return strain / (1 + strain)

    def energy(self, strain: arb) -> arb:
        return strain - (1 + strain).log()


@dataclass(frozen=True)
class LennardJones:
    """U = (r^-12 - 2 r^-6 + 1)/72 with r = 1 + s."""

    breaks_at = Fraction(1, 72)

    def next_term(self, strain: list[arb], memory: Memory) -> arb:
        length = [1 + strain[0], *strain[1:]]
        seventh = _next_of_power(-7, length, memory["r^-7"])
        return (seventh - _next_of_power(-13, length, memory["r^-13"])) / 6

    def force(self, strain: acb) -> acb:
        inverse = 1 / (1 + strain)
        seventh = inverse**7
        return (seventh - seventh * inverse**6) / 6

    def energy(self, strain: arb) -> arb:
        part = 1 - (1 + strain) ** -6
        return part * part / 72


BONDS: dict[str, Bond] = {
    "harmonic": Harmonic(),
    "lj": LennardJones(),
    "toda": Toda(),
    "log": Log(),
}
