"""Test potentials: no cancellation, forces as derivatives of energies, the speed scale v*."""

import math
import sys
from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from chaincor.lammps_inputs.bonds.exponential_bonds import TodaParameters
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones, Logarithmic, Morse, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power, PowerParameters, power_kernels
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.errors import PotentialError

EPSILON = sys.float_info.epsilon
BONDS = [
    Harmonic(),
    LennardJones(),
    Toda(),
    Toda(3.0),
    Morse(),
    Morse(2.0),
    Logarithmic(),
    Power(3, -1.0),
    Power(4, 1.0),
    Power(5, -1.0),
    Power(6, 0.5),
]
BOND_IDS = [f"{bond.name}{bond.anharmonic_order}{tuple(bond.parameters)}" for bond in BONDS]
each_bond = pytest.mark.parametrize("bond", BONDS, ids=BOND_IDS)

# U(s) and -dU/dr(s) are computed here in exact arithmetic by the paper's formulas, not by those of
# the code.
EXACT = {
    "harmonic": (lambda s: s * s / 2, lambda s: -s),
    "lj": (
        lambda s: ((1 + s) ** -12 - 2 * (1 + s) ** -6 + 1) / 72,
        lambda s: ((1 + s) ** -13 - (1 + s) ** -7) / 6,
    ),
    "toda": (
        lambda s, b: ((-b * s).exp() - 1) / b**2 + s / b,
        lambda s, b: ((-b * s).exp() - 1) / b,
    ),
    "morse": (
        lambda s, a: (1 - (-a * s).exp()) ** 2 / (2 * a**2),
        lambda s, a: -(1 - (-a * s).exp()) * (-a * s).exp() / a,
    ),
    "log": (lambda s: s - (1 + s).ln(), lambda s: 1 / (1 + s) - 1),
    "power": (
        lambda s, c, order: s**2 / 2 + c * s**order,
        lambda s, c, order: -s - order * c * s ** (order - 1),
    ),
}
MAGNITUDES = np.geomspace(1e-15, 0.3, 120)
STRAINS = np.concatenate([MAGNITUDES, -MAGNITUDES])


def in_exact_arithmetic(function, strains, bond):
    values = [Decimal(value) for value in bond.parameters]
    values += [Decimal(bond.order)] if bond.name == "power" else []
    with localcontext() as context:
        context.prec = 80
        return np.array([float(function(Decimal(float(s)), *values)) for s in strains])


@each_bond
def test_energy_and_force_keep_their_digits_at_any_strain(bond):
    # In a power r^-13, rounding of r is amplified 13 times; a square of expm1(6 log1p(s)) loses
    # slightly more. The plain formula has a relative error of 1e-4 at strain 1e-6, and of 1 at
    # strain 1e-9.
    energy, force = EXACT[bond.name]
    tolerance = 40.0 * EPSILON
    expected = in_exact_arithmetic(energy, STRAINS, bond)
    assert bond.energy(STRAINS) == pytest.approx(expected, rel=tolerance, abs=0.0)
    expected = in_exact_arithmetic(force, STRAINS, bond)
    assert bond.force(STRAINS) == pytest.approx(expected, rel=tolerance, abs=0.0)


@each_bond
def test_rest_is_the_origin_of_energy_with_unit_stiffness(bond):
    assert bond.energy(0.0) == 0.0
    assert bond.force(0.0) == 0.0
    assert bond.curvature(0.0) == 1.0
    assert bond.stiffness == 1.0


@each_bond
def test_force_and_curvature_are_derivatives(bond):
    # A central difference has an error of h^2/6 times the third derivative and a rounding error of
    # eps |U|/h.
    h = 1e-4
    strains = np.linspace(-0.25, 0.25, 101)
    for value, derivative in ((bond.energy, bond.force), (bond.force, bond.curvature)):
        slope = -(value(strains + h) - value(strains - h)) / (2.0 * h)
        wide = np.array([derivative(strains + k * 2.0 * h) for k in (-1, 0, 1)])
        third = np.abs(wide[2] - 2.0 * wide[1] + wide[0]) / (2.0 * h) ** 2
        noise = np.max(np.abs(value(strains))) * EPSILON / h
        noise += np.max(np.abs(wide)) * EPSILON / (2.0 * h) ** 2 * h**2  # rounding error of `third`
        allowed = 2.0 * (h * h / 6.0 * third + noise) + 40.0 * EPSILON
        assert np.all(np.abs(slope - derivative(strains)) <= allowed)


@each_bond
def test_kernel_is_the_method(bond):
    kernel = bond.force_kernel
    one_by_one = [float(kernel(float(s), bond.parameters)) for s in STRAINS]
    # Powers and exponentials of Python and NumPy may round differently.
    assert bond.force(STRAINS) == pytest.approx(one_by_one, rel=8.0 * EPSILON, abs=0.0)


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 63, reason="needs more than double digits")
def test_exponential_of_toda_to_two_epsilon():
    sizes = np.logspace(-17.0, np.log10(38.0), 100_001)
    # exp(709) is the largest value before the cutoff, exp(-38) the smallest that changes -1.
    strains = np.concatenate((-sizes, sizes, [-709.0, 1e-12, -1e-12], np.linspace(-3, 3, 100_001)))
    exact = np.expm1(-strains.astype(np.longdouble))
    steep = TodaParameters(1.0)
    error = np.abs(Toda.force_kernel(strains, steep) - exact)
    assert np.all(error <= 2.0 * EPSILON * np.abs(exact))
    assert np.array_equal(
        Toda.force_kernel(np.array([50.0, 1e9, np.inf]), steep), [-1.0, -1.0, -1.0]
    )
    assert Toda.force_kernel(-1e9, steep) > 1e307
    assert np.isnan(Toda.force_kernel(np.nan, steep))


@pytest.mark.parametrize("order", [3, 4, 7, 12])
def test_power_kernels_are_distinguished(order):
    # Cached loops are found by their qualified names.
    kernel = power_kernels(order)[0]
    assert kernel is power_kernels(order)[0]
    assert kernel.__qualname__ == f"power{order}_force"
    assert kernel(-0.5, PowerParameters(0.25)) == pytest.approx(
        0.5 - order * 0.25 * (-0.5) ** (order - 1)
    )


@pytest.mark.parametrize(
    ("bond", "speed"),
    [
        (LennardJones(), 0.128489059895),
        (Toda(), 0.253608391351),
        (Logarithmic(), 0.967042944497),
        (Morse(), 0.154921210939),
        (Power(3, -1.0), 0.707106781187),
        (Power(4, 1.0), 1.0),
        (Power(5, -1.0), 1.12246204831),
    ],
)
def test_natural_speed(bond, speed):
    # The published values have 12 digits.
    assert bond.natural_speed == pytest.approx(speed, rel=3e-12)


@each_bond
def test_compressed_root_doubles_the_harmonic_energy(bond):
    root = bond.compressed_root
    if bond.name == "harmonic":
        assert root is None
        assert bond.natural_speed is None
        return
    assert root < 1.0
    strain = root - 1.0
    # An error of 1e-15 in the root s changes U/s^2 by a relative error of a few times 1e-15/|s|.
    assert bond.energy(strain) == pytest.approx(strain**2, rel=1e-13)


@given(b=st.floats(1e-90, 1e90))
def test_toda_speed_scales_as_one_over_b(b):
    # U(s; b) = U(b s; 1)/b^2, so that v* b is a constant. At small b, the natural speed belongs to
    # a strain below -1, which only a chain forbids, not the potential. Each v* is rounded to 5e-13.
    assert Toda(b).natural_speed * b == pytest.approx(Toda(1.0).natural_speed, rel=1.1e-12)


@each_bond
def test_limits_of_convexity_and_of_barriers(bond):
    if math.isfinite(bond.convex_strain):
        assert bond.curvature(bond.convex_strain) == pytest.approx(0.0, abs=1e-12)
        assert bond.curvature(bond.convex_strain - 1e-3) > 0.0
        assert bond.curvature(bond.convex_strain + 1e-3) < 0.0
    if math.isfinite(bond.barrier):
        assert bond.force(bond.barrier_strain) == pytest.approx(0.0, abs=4.0 * EPSILON)
        assert bond.barrier == bond.energy(bond.barrier_strain)
        assert bond.energy(bond.barrier_strain + 1e-3) < bond.barrier


@each_bond
def test_lammps_formula_is_the_energy(bond):
    formula = bond.lammps_formula.format(s="s", bond=bond).replace("^", "**")
    names = {"exp": np.exp, "ln": np.log}
    for s in np.linspace(-0.2, 0.3, 21):
        value = eval(formula, names, {"s": s})
        # LAMMPS has no expm1 or log1p. The formula therefore has an error of a few eps times its
        # largest term, 1.
        assert value == pytest.approx(bond.energy(s), abs=4.0 * EPSILON, rel=1e-12)


def test_lj_dissociates_at_its_depth():
    assert LennardJones().energy(1e6) == pytest.approx(LennardJones.dissociation, rel=1e-12)
    assert Morse(5.0).energy(1e6) == Morse(5.0).dissociation == 0.02
    others = [bond for bond in BONDS if bond.name not in ("lj", "morse")]
    assert all(math.isinf(bond.dissociation) for bond in others)


@pytest.mark.parametrize("a", [0.0, -1.0, math.nan, math.inf, 1e200, 1e-200])
def test_morse_refuses_a(a):
    with pytest.raises(PotentialError, match="morse_a is"):
        Morse(a)


@pytest.mark.parametrize("b", [0.0, -1.0, math.nan, math.inf, 1e200, 1e-200])
def test_toda_refuses_b(b):
    with pytest.raises(PotentialError, match="toda_b is"):
        Toda(b)


@pytest.mark.parametrize(
    ("order", "c"),
    [(2, 1.0), (3, 1.0), (4, -1.0), (3, 0.0), (4, math.nan), (3, -math.inf), (4, 1e200)],
)
def test_power_refuses(order, c):
    with pytest.raises(PotentialError, match=r"power_(order|c) is"):
        Power(order, c)


def test_the_log_bond_as_a_function_of_the_logarithm_of_its_length():
    bond = Logarithmic()
    for y in (-30.0, -1.0, -1e-9, 1e-9, 0.5):
        force, inverse_length = bond.log_length.kernel(y, bond.parameters)
        if y > -20.0:  # strains of shorter bonds have lost their digits
            assert force == pytest.approx(float(bond.force(np.expm1(y))), rel=1e-9)
            energy = float(bond.energy(np.expm1(y)))
            assert float(bond.log_length.energy(y)) == pytest.approx(energy, rel=1e-7)
        assert inverse_length == pytest.approx(np.exp(-y), rel=1e-14)


def test_what_engines_ask_of_a_bond_that_says_no_more_than_it_must():
    class Spring(Potential):
        name = "spring"

        def energy(self, strain):
            return np.square(strain)

        def force(self, strain):
            return -2.0 * strain

        def curvature(self, strain):
            return 2.0 * np.ones_like(strain)

    bond = Spring()
    assert (bond.barrier_strain, bond.barrier, bond.convex_strain) == (math.inf,) * 3
    assert (bond.force_kernel, bond.users_force, bond.log_length) == (None,) * 3
    assert (bond.is_harmonic, bond.kinks, bond.energy_offset) == (False, (), 0.0)
    assert [one.name for one in BONDS if one.is_harmonic] == ["harmonic"]


class TestUserBond:
    def test_finds_the_speed_scale_numerically(self):
        lj = LennardJones()
        user = UserBond(lambda s: lj.energy(s) - 0.7, lj.force, name="mine")
        # The stiffness comes from a central difference with step 1e-5. Its error is 1e-10 U''''/6,
        # with U''''(1) = 371 for lj. The relative error of v* has a similar size.
        assert user.stiffness == pytest.approx(1.0, abs=371e-10 / 6 * 1.2)
        assert user.natural_speed == pytest.approx(lj.natural_speed, rel=1e-7)
        # Subtracting the constant leaves its rounding error.
        strains = np.linspace(-0.1, 0.1, 7)
        assert user.energy(strains) == pytest.approx(lj.energy(strains), abs=EPSILON)

    def test_keeps_a_stiffness_of_its_own(self):
        user = UserBond(lambda s: 2.0 * s * s, lambda s: -4.0 * s)
        assert user.stiffness == pytest.approx(4.0, rel=1e-9)
        assert user.natural_speed is None

    def test_refuses_a_force_at_natural_length(self):
        with pytest.raises(PotentialError, match="the force vanishes at length 1"):
            UserBond(lambda s: s + s * s, lambda s: -1.0 - 2.0 * s)

    def test_refuses_an_unstable_bond(self):
        with pytest.raises(PotentialError, match="positive curvature"):
            UserBond(lambda s: -s * s, lambda s: 2.0 * s)

    def test_a_steep_bond_has_its_root_very_near(self):
        # For U = s^2/2 + 1e6 |s|^3, the root of U = s^2 is at s = -5e-7.
        user = UserBond(
            lambda s: 0.5 * s * s + 1e6 * np.abs(s) ** 3, lambda s: -s - 3e6 * np.abs(s) * s
        )
        # Here, the stiffness K from a central difference over 2e-5 comes mostly from the cubic
        # term. The root is that of U = K s^2.
        strain = user.compressed_root - 1.0
        assert user.energy(strain) == pytest.approx(user.stiffness * strain**2, rel=1e-6)
