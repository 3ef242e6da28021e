"""Declare the step schemes: their names, orders, sources, usual steps and coefficients."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

# A scene can name compositions of Verlet steps. Runs with a tolerance and Python programs can use
# further schemes: extrapolation to a time step of zero in both engines, and a splitting method with
# modified kicks in the reference engine.
Scheme = Literal["verlet", "order4", "order6", "order8"]
StepSchemeName = Scheme | Literal["srkn14", "extrapolated12", "extrapolated14"]


@dataclass(frozen=True, kw_only=True)
class SchemeFacts:
    """Declaration of a scheme; the subclasses have its coefficients."""

    order: int  #: Exponent p in the error of one run, which is proportional to H^p.
    source: str  #: Publication of the coefficients.
    #: Usual step H, for uncompressed bonds; the default of scenes. Chains of about 100 particles
    #: have the error of eta in `measured.toml` (`usual_error`) at this step.
    usual_step: float
    #: Order at usual steps; it differs for schemes that reach their order only at shorter steps.
    usual_order: int | None = None
    #: In nine scenes of ten, the error is below the median error times this factor, if it is not
    #: about two. Only the first guess of a step depends on it.
    usual_scatter: float = 1.0


@dataclass(frozen=True, kw_only=True)
class Composition(SchemeFacts):
    """Palindromic sequence of Verlet steps w_k H, which LAMMPS and its scripts can take."""

    half: tuple[float, ...]  #: Weights w_k before the central weight.

    @cached_property
    def weights(self) -> tuple[float, ...]:
        """All weights; the central weight makes their sum exactly one."""
        return (*self.half, 1.0 - 2.0 * sum(self.half), *reversed(self.half))

    def largest_step(self, frequency: float) -> float:
        """
        Return a step a tenth below the limit of stability.

        A stage of weight w is stable if 2 |w| H < 2 for the fastest mode of a uniform chain, whose
        frequency is twice the `frequency` of a bond.
        """
        return _STABILITY_SHARE / (self._heaviest * frequency)

    @cached_property
    def _heaviest(self) -> float:
        return max(abs(weight) for weight in self.weights)


@dataclass(frozen=True, kw_only=True)
class FurtherScheme(SchemeFacts):
    """Scheme that scenes cannot name."""

    #: Largest step for uncompressed bonds. Stability limits this step. In LAMMPS, the bond table
    #: also limits the longest Verlet step, which must not need a much longer table.
    limit: float

    def largest_step(self, frequency: float) -> float:
        """Return the largest step for a `frequency` of a bond."""
        return self.limit / frequency


@dataclass(frozen=True, kw_only=True)
class SplitSteps(FurtherScheme):
    """Alternating drifts a_k H and kicks b_k H, beginning and ending with a drift."""

    drifts: tuple[float, ...]  #: Drifts a_k before the central drift; all drifts sum to 1.
    kicks: tuple[float, ...]  #: Kicks b_k before the two central kicks; all kicks sum to 1.


@dataclass(frozen=True, kw_only=True)
class ExtrapolatedSteps(FurtherScheme):
    """Results of m Verlet steps of H/m each, for several m, extrapolated to m = infinity."""

    counts: tuple[int, ...]  #: Numbers m of Verlet steps.


# Composed steps stay a tenth below the limit of stability.
_STABILITY_SHARE = 0.9
_KAHAN_LI = "Kahan and Li (1997), Math. Comp. 66, 1089"
_HAIRER = "Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, II.14"
_SUZUKI = 1.0 / (4.0 - 4.0 ** (1.0 / 3.0))

COMPOSITIONS: dict[Scheme, Composition] = {
    "verlet": Composition(order=2, source="one step", usual_step=0.0125, half=()),
    "order4": Composition(
        order=4,
        source="Suzuki (1990), Phys. Lett. A 146, 319, five stages with w = 1/(4 - 4^(1/3))",
        usual_step=0.05,
        half=(_SUZUKI, _SUZUKI),
    ),
    "order6": Composition(
        order=6,
        source=f"{_KAHAN_LI}, s9odr6a",
        usual_step=0.1,
        half=(
            0.39216144400731413927925056,
            0.33259913678935943859974864,
            -0.70624617255763935980996482,
            0.08221359629355080023149045,
        ),
    ),
    "order8": Composition(
        order=8,
        source=f"{_KAHAN_LI}, s17odr8a",
        usual_step=0.2,
        half=(
            0.13020248308889008087881763,
            0.56116298177510838456196441,
            -0.38947496264484728640807860,
            0.15884190655515560089621075,
            -0.39590389413323757733623154,
            0.18453964097831570709183254,
            0.25837438768632204729397911,
            0.29501172360931029887096624,
        ),
    ),
}
SCHEMES: dict[str, Composition | SplitSteps | ExtrapolatedSteps] = {
    **{str(name): facts for name, facts in COMPOSITIONS.items()},
    "srkn14": SplitSteps(
        order=6,
        source="Blanes and Moan (2002), J. Comput. Appl. Math. 142, 313, table 3",
        usual_step=1.0,
        usual_order=9,
        usual_scatter=20.0,
        limit=1.4,
        drifts=(
            0.0378593198406116,
            0.102635633102435,
            -0.0258678882665587,
            0.314241403071447,
            -0.130144459517415,
            0.106417700369543,
            -0.00879424312851058,
        ),
        kicks=(
            0.09171915262446165,
            0.183983170005006,
            -0.05653436583288827,
            0.004914688774712854,
            0.143761127168358,
            0.328567693746804,
        ),
    ),
    # Extrapolation multiplies rounding errors by the sum of |c_m|. For order 12 this sum is 8,
    # because the counts end with 6 and 8; with the counts 1 to 6 the sum would be 27. For order 14
    # it is 56. LAMMPS uses order 12 because its coordinates are coarsely rounded.
    "extrapolated12": ExtrapolatedSteps(
        order=12, source=_HAIRER, usual_step=0.6, limit=0.7, counts=(1, 2, 3, 4, 6, 8)
    ),
    "extrapolated14": ExtrapolatedSteps(
        order=14, source=_HAIRER, usual_step=0.8, limit=1.2, counts=(1, 2, 3, 4, 5, 6, 7)
    ),
}
