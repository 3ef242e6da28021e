"""Define symmetric compositions of Verlet steps, which reach higher orders."""

from dataclasses import dataclass

from chaincor.lammps_inputs.schemes import SCHEME_ORDERS, Scheme

_KAHAN_LI = "Kahan and Li (1997), Math. Comp. 66, 1089"
SOURCES: dict[str, str] = {
    "verlet": "one step",
    "order4": "Suzuki (1990), Phys. Lett. A 146, 319, five stages with w = 1/(4 - 4^(1/3))",
    "order6": f"{_KAHAN_LI}, s9odr6a",
    "order8": f"{_KAHAN_LI}, s17odr8a",
}
# Each sequence of weights is a palindrome, given by its first half and its centre. The centre makes
# the sum of all weights exactly one.
_SUZUKI = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))
_HALVES: dict[Scheme, tuple[float, ...]] = {
    "verlet": (),
    "order4": (_SUZUKI, _SUZUKI),
    "order6": (
        0.39216144400731413927925056,
        0.33259913678935943859974864,
        -0.70624617255763935980996482,
        0.08221359629355080023149045,
    ),
    "order8": (
        0.13020248308889008087881763,
        0.56116298177510838456196441,
        -0.38947496264484728640807860,
        0.15884190655515560089621075,
        -0.39590389413323757733623154,
        0.18453964097831570709183254,
        0.25837438768632204729397911,
        0.29501172360931029887096624,
    ),
}


@dataclass(frozen=True)
class Composition:
    """Palindromic sequence of Verlet steps w_k H."""

    name: Scheme  #: Name of the scheme in scenes.
    order: int  #: Exponent p in the error of one run, which is proportional to H^p.
    weights: tuple[float, ...]  #: Weights w_k in the order of the steps; their sum is 1.


def _compose(name: Scheme) -> Composition:
    half = _HALVES[name]
    centre = 1.0 - 2.0 * sum(half)
    return Composition(name, SCHEME_ORDERS[name], (*half, centre, *reversed(half)))


COMPOSITIONS: dict[str, Composition] = {name: _compose(name) for name in _HALVES}
