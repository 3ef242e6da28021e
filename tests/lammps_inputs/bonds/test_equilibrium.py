"""Test the thermal distribution of a bond's strain against closed forms and quadrature."""

import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from scipy.special import gammainc, gammaincc, ndtr

from chaincor.lammps_inputs.bonds.equilibrium import LEAST_DEPTH, bond_distribution
from chaincor.lammps_inputs.bonds.formula import formula_bond
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones, Logarithmic, Morse, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.thermal_state import start_margin

# Rounding error of cumulative probabilities, which are sums of some hundred terms near 1.
ROUNDING = 1e-13

# For each bond, an independent formula of the energy for mpmath, and the dissociation energy.
PLAIN = {
    "harmonic": (Harmonic(), lambda s: s**2 / 2, None),
    "lj": (LennardJones(), lambda s: (1 - (1 + s) ** -6) ** 2 / 72, mpmath.mpf(1) / 72),
    "toda": (Toda(), lambda s: (mpmath.exp(-10 * s) - 1 + 10 * s) / 100, None),
    "morse": (Morse(), lambda s: (1 - mpmath.exp(-6 * s)) ** 2 / 72, mpmath.mpf(1) / 72),
    "log": (Logarithmic(), lambda s: s - mpmath.log(1 + s), None),
    "cubic": (Power(3, -1.0), lambda s: s**2 / 2 - s**3, None),
    "quartic": (Power(4, 10.0), lambda s: s**2 / 2 + 10 * s**4, None),
}
# A cubic bond is lost at its barrier, s = 1/3.
BARRIER = {"cubic": 1 / 3}
TEMPERATURES = (1e-6, 1e-4, 1e-3)


def end_of(name, temperature):
    """Return the strain at which the bond breaks: at the barrier, or where U = D - T."""
    depth = PLAIN[name][2]
    if depth is None:
        return BARRIER.get(name, math.inf)
    root = mpmath.sqrt(1 - temperature / depth)
    return float(
        (1 - root) ** (-mpmath.mpf(1) / 6) - 1 if name == "lj" else -mpmath.log1p(-root) / 6
    )


@pytest.mark.parametrize("temperature", TEMPERATURES)
@pytest.mark.parametrize("name", PLAIN)
@pytest.mark.slow_cases
def test_shares_are_those_of_quadrature_with_many_digits(name, temperature):
    bond, energy, _ = PLAIN[name]
    found = bond_distribution(bond, temperature)
    width = math.sqrt(temperature)
    # The intervals cover the well up to the breaking strain, or 14 widths, beyond which the density
    # is below exp(-98).
    places = [max(-14 * width, -0.999), *(np.linspace(-4, 4, 9) * width).tolist()]
    last = min(end_of(name, temperature), 40 * width)
    places = [s for s in places if s < last] + [last]

    def density(s):
        return mpmath.exp(-energy(s) / temperature)

    with mpmath.workdps(25):
        parts = [mpmath.quad(density, [a, (a + b) / 2, b]) for a, b in pairwise(places)]
        whole = mpmath.fsum(parts)
        wanted = [float(mpmath.fsum(parts[: k + 1]) / whole) for k in range(len(parts))]
    assert found.share_below(np.array(places[1:])) == pytest.approx(wanted, abs=ROUNDING)


@pytest.mark.parametrize("temperature", [1e-6, 1e-2, 1.0, 20.0])
def test_shares_are_those_of_closed_forms(temperature):
    shares = np.linspace(0.001, 0.999, 97)
    bonds = {
        Harmonic(): lambda s: ndtr(s / math.sqrt(temperature)),
        # r/T has a Gamma distribution of shape 1 + 1/T, and exp(-b s)/(b^2 T) one of shape 1/(b^2
        # T).
        Logarithmic(): lambda s: gammainc(1 + 1 / temperature, (1 + s) / temperature),
        Toda(): lambda s: gammaincc(1 / (100 * temperature), np.exp(-10 * s) / (100 * temperature)),
    }
    if temperature > 1.0:
        del bonds[Toda()]  # exp(-b s) leaves the range of floating-point numbers
    for bond, below in bonds.items():
        found = bond_distribution(bond, temperature)
        # SciPy's Gamma distribution with shape 1e6 has an error of some 1e-12.
        assert below(found.strains(shares)) == pytest.approx(shares, abs=1e-11), bond
        assert found.share_below(found.strains(shares)) == pytest.approx(shares, abs=ROUNDING)


def test_moments_are_those_of_closed_forms():
    for temperature in (1e-4, 0.3):
        log = bond_distribution(Logarithmic(), temperature)
        assert log.mean == pytest.approx(temperature, rel=1e-10)
        assert log.variance == pytest.approx(temperature * (1 + temperature), rel=1e-10)
        spring = bond_distribution(Harmonic(), temperature)
        slopes = np.array([0.5, 3.0]) / math.sqrt(temperature)
        assert spring.log_moment(slopes) == pytest.approx([0.125, 4.5], rel=1e-10)


def test_each_share_is_found_by_itself():
    found = bond_distribution(LennardJones(), 1e-3)
    shares = np.random.default_rng(1).random(1000)
    alone = [found.strains(np.array([share]))[0] for share in shares[:50]]
    assert found.strains(shares)[:50].tolist() == alone
    assert found.strains(shares.reshape(10, 100)).shape == (10, 100)


def test_no_share_is_drawn_where_the_bond_is_not():
    ends = np.array([2.0**-54, 1 - 2.0**-53])
    for bond in (Logarithmic(), Power(3, -1.0), Power(4, 1.0)):
        low, high = bond_distribution(bond, 2e-3).strains(ends)
        assert -1.0 < low < 0.0 < high < bond.barrier_strain


def test_kinks_and_noise_of_users_bonds_are_met():
    def energy(s):
        return np.where(s < 0, 4.0, 1.0) * s**2 / 2 + 3.0

    bond = UserBond(energy, lambda s: -np.where(s < 0, 4.0, 1.0) * s, strain_min=-math.inf)
    found = bond_distribution(bond, 1e-2)
    # The distribution consists of two half Gaussians of widths 1/2 and 1.
    assert found.share_below(np.array([0.0])) == pytest.approx([1 / 3], abs=1e-12)
    with pytest.raises(SceneError, match="rounded to more than T"):
        bond_distribution(bond, 1e-15)


BAD = [
    (
        LennardJones(),
        1.8e-3,
        "an energy of 0.0138889 breaks a lj bond. Give a temperature of at most 0.00173611",
    ),
    (Morse(), 1.8e-3, "an energy of 0.0138889 breaks a morse bond"),
    # At the barrier s = 1/3, U = 1/54.
    (Power(3, -1.0), 0.0024, "an energy of 0.0185185 breaks a power bond"),
    # At strain -1, where particles would pass through each other, U = 1.5.
    (Power(4, 1.0), 0.2, "an energy of 1.5 presses the ends of a power bond together"),
    (formula_bond("log(1+s)^2", ()), 30.0, "grows too slowly"),
]


@pytest.mark.parametrize(("bond", "temperature", "line"), BAD, ids=[b[2][:40] for b in BAD])
def test_temperatures_without_equilibrium_are_refused(bond, temperature, line):
    with pytest.raises(SceneError, match=line) as caught:
        bond_distribution(bond, temperature)
    assert "\n" not in str(caught.value)


def test_bonds_without_tension_are_refused():
    bond = UserBond(
        lambda s: np.minimum(s, 0.0) ** 2 / 2, lambda s: -np.minimum(s, 0.0), name="grains"
    )
    with pytest.raises(SceneError, match="a grains bond has no force in tension"):
        bond_distribution(bond, 1e-6)


def test_a_bond_holds_up_to_the_temperature_that_the_message_names():
    assert bond_distribution(LennardJones(), 1 / 72 / LEAST_DEPTH).mean > 0.0


def test_an_object_without_a_hash_will_do():
    class Mine(Harmonic):
        __hash__ = None

    found = bond_distribution(Mine(), 1e-2)
    assert found.variance == pytest.approx(1e-2, rel=1e-12)
    assert start_margin(Mine(), 1e-2, np.array([0.5])) > 0.0
