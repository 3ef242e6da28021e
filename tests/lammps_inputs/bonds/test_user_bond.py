"""Test users' bonds: the properties that are derived, and the refusals."""

import math

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones, Logarithmic, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.errors import InputError, PotentialError


def bent(stiffness, strain, **options):
    """Return a bond with stiffness 1, and with another stiffness beyond a strain."""
    more = stiffness - 1.0
    return UserBond(
        lambda s: 0.5 * s**2 + 0.5 * more * np.maximum(s - strain, 0.0) ** 2,
        lambda s: -s - more * np.maximum(s - strain, 0.0),
        **options,
    )


def slack():
    """Return a bond without tension."""
    return UserBond(lambda s: 0.5 * np.minimum(s, 0.0) ** 2, lambda s: -np.minimum(s, 0.0))


class TestKinks:
    @pytest.mark.parametrize("strain", [0.0, 1e-3, 0.03, 0.123456789])
    @pytest.mark.parametrize("stiffness", [0.0, 0.99, 5.0])
    def test_are_found(self, stiffness, strain):
        # The kink is the intersection of the lines on its two sides, within a bracket of 1e-8.
        assert bent(stiffness, strain).kinks == pytest.approx((strain,), abs=1e-10)

    def test_several_are_found(self):
        bond = UserBond(
            lambda s: (
                0.5 * s**2 + np.maximum(s - 0.03, 0) ** 2 + 2 * np.minimum(s + 0.0123, 0) ** 2
            ),
            lambda s: -s - 2 * np.maximum(s - 0.03, 0) - 4 * np.minimum(s + 0.0123, 0),
        )
        assert bond.kinks == pytest.approx((-0.0123, 0.03), abs=1e-10)

    def test_named_ones_stay_where_they_were_named(self):
        assert bent(3.0, 0.03, kinks=(0.03, 0.5)).kinks == (0.03, 0.5)

    def test_named_ones_lie_within_the_bond(self):
        with pytest.raises(PotentialError, match=r"kinks \(2.0,\)\. Give kinks between"):
            bent(3.0, 0.03, kinks=(2.0,), strain_max=1.0)

    @pytest.mark.parametrize(
        "bond",
        [Harmonic(), LennardJones(), Toda(), Toda(100.0), Logarithmic(), Power(3, -1.0)],
        ids=lambda bond: f"{bond.name}{tuple(bond.parameters)}",
    )
    def test_smooth_bonds_have_none(self, bond):
        assert UserBond(bond.energy, bond.force, strain_max=5.0).kinks == ()
        assert bond.kinks == ()

    def test_stiffness_at_a_kink_is_that_of_compression(self):
        bond = slack()
        assert bond.stiffness == pytest.approx(1.0, rel=1e-9)
        assert bond.curvature(np.array([-1e-6, 0.0, 1e-6])) == pytest.approx([1, 1, 0], abs=1e-9)

    def test_a_jump_of_the_force_is_refused(self):
        def energy(s):
            return 0.5 * s**2 + 0.01 * np.maximum(s - 0.2, 0.0)

        def force(s):
            return -s - np.where(s > 0.2, 0.01, 0.0)

        with pytest.raises(PotentialError, match=r"jumps by 0.01 at strain 0.2. Join"):
            _ = UserBond(energy, force).kinks


class TestEnergyAndForce:
    def test_must_belong_together(self):
        with pytest.raises(PotentialError, match=r"contradict each other: near strain -?[\d.]+"):
            UserBond(lambda s: s**2 / 2 + s**4, lambda s: -s - 3 * s**3)

    def test_the_range_counts(self):
        # The bond is accepted if the range is given.
        options = {"energy": lambda s: 0.5 * s**2, "force": lambda s: -np.clip(s, -0.5, 0.5)}
        with pytest.raises(PotentialError, match="strain_min and strain_max"):
            UserBond(**options)
        assert UserBond(**options, strain_min=-0.5, strain_max=0.5).stiffness == pytest.approx(1.0)

    def test_rounding_is_no_mismatch(self):
        # At strain 1e-4, the bond's energy is only 1e-10 times the constant.
        constant = 50.0
        bond = UserBond(lambda s: 0.5 * s**2 + constant, lambda s: -s)
        assert bond.energy(0.0) == 0.0
        plain = UserBond(
            lambda s: ((1 + s) ** -12 - 2 * (1 + s) ** -6) / 72,
            lambda s: ((1 + s) ** -13 - (1 + s) ** -7) / 6,
        )
        assert plain.kinks == ()


class TestFunctionsOfOneNumber:
    def test_are_called_for_each(self):
        toda = UserBond(
            lambda s: math.exp(-s) - 1.0 + s, lambda s: math.exp(-s) - 1.0, strain_max=10.0
        )
        strains = np.linspace(-0.2, 0.2, 11).reshape(1, 11)
        assert toda.force(strains) == pytest.approx(np.expm1(-strains), abs=1e-15)
        branches = UserBond(lambda s: 0.5 * s * s if s < 0 else 0.0, lambda s: -min(s, 0.0))
        assert branches.kinks == (0.0,)

    @pytest.mark.parametrize(
        "force",
        [
            lambda s: "much",
            lambda s: [1.0, 2.0],
            lambda s: np.zeros(3),
            lambda s: -s * (1.0 + 0.1j),
            lambda s: 1 / 0,
            lambda: 0.0,
        ],
    )
    def test_others_are_refused_by_name(self, force):
        with pytest.raises(PotentialError, match="force of bond 'mine' fails at strain") as refusal:
            UserBond(lambda s: 0.5 * s**2, force, name="mine")
        assert "\n" not in str(refusal.value)


class TestBreaking:
    def test_bonds_without_tension_hold_nothing(self):
        assert slack().dissociation == 0.0

    def test_dissociation_is_found(self):
        lj = LennardJones()
        assert UserBond(lj.energy, lj.force).dissociation == pytest.approx(1.0 / 72.0, rel=1e-12)
        for bond in (Harmonic(), Logarithmic()):
            assert math.isinf(UserBond(bond.energy, bond.force).dissociation)

    def test_convexity_ends_at_the_inflection(self):
        lj = LennardJones()
        # The examined strains are 5.5 % apart.
        found = UserBond(lj.energy, lj.force).convex_strain
        assert found <= lj.convex_strain <= 1.06 * found
        # Without tension, the convex range ends at strain 0.
        assert slack().convex_strain == 0.0

    def test_a_bond_that_softens_in_compression_is_never_convex(self):
        soft = UserBond(
            lambda s: 0.5 * s**2 - 1.5 * s**4 + 2 * s**6,
            lambda s: -s + 6 * s**3 - 12 * s**5,
        )
        assert soft.convex_strain == 0.0


def test_an_energy_that_overflows_far_out_has_no_end():
    assert UserBond(lambda s: 5e299 * s**2, lambda s: -1e300 * s).dissociation == np.inf


@pytest.mark.parametrize(
    ("energy", "force", "barrier"),
    [
        (lambda s: s**2 / 2 - s**3 / 3, lambda s: -s + s**2, 1.0),
        # U returns to its value at rest, or to less.
        (
            lambda s: 0.5 * s**2 * np.exp(-4 * s**2),
            lambda s: -(s - 4 * s**3) * np.exp(-4 * s**2),
            0.5,
        ),
    ],
)
def test_a_bond_that_loses_energy_beyond_a_barrier_does_not_dissociate(energy, force, barrier):
    bond = UserBond(energy, force, strain_min=-0.3)
    assert bond.barrier_strain == pytest.approx(barrier, rel=1e-6)
    assert bond.dissociation == np.inf


def test_bonds_without_a_barrier_keep_their_dissociation():
    lj = LennardJones()
    assert UserBond(lj.energy, lj.force, strain_min=-0.9).barrier_strain == np.inf
    assert slack().barrier_strain == np.inf
    assert slack().dissociation == 0.0


@pytest.mark.parametrize(
    ("energy", "force"),
    [
        (lambda s: s**2 / 2 + s**4, lambda s: s + 4 * s**3),
        (lambda s: np.exp(-s) + s, lambda s: 1.0 - np.exp(-s)),
    ],
)
def test_a_force_of_the_wrong_sign_is_called_that(energy, force):
    with pytest.raises(PotentialError, match="the force of bond 'mine' has the wrong sign"):
        UserBond(energy, force, name="mine", strain_min=-0.5, strain_max=2.0)
    # The force is right only in compression.
    half = lambda s: np.where(s < 0.0, -force(s), force(s))  # noqa: E731
    with pytest.raises(PotentialError, match="has the wrong sign near strain"):
        UserBond(energy, half, name="mine", strain_min=-0.5, strain_max=2.0, kinks=(0.0,))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"kinks": 5}, "kinks is 5. Give a list of numbers"),
        ({"kinks": ["a"]}, r"kinks is \['a'\]. Give a list of numbers"),
        ({"kinks": np.array(0.1)}, "Give a list of numbers"),
        ({"strain_min": "a"}, r"range of strains is \('a', inf\)"),
        ({"strain_max": True}, "Give a list of numbers"),
        ({"strain_max": 10**400}, "Give a list of numbers"),
        ({"name": 3}, "name is 3. Give a text"),
    ],
)
def test_arguments_of_other_types_are_refused_by_name(given, message):
    with pytest.raises(InputError, match=message):
        UserBond(lambda s: s * s / 2, lambda s: -s, **given)
