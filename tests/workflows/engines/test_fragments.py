"""Test the barrier between fragments of a chain against minimisation and the judge."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq, minimize

from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones, Logarithmic, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.workflows.engines.fragment_bounds import Lever, escape_risk, reach
from chaincor.workflows.engines.fragments import Body, count_fragments, levers_of
from tests.judge.end_counterexamples import argument_for, check, draw_state

LJ = LennardJones()
BONDS = [Harmonic(), LJ, Toda(), Logarithmic(), Power(4, 1.0)]
NAMES = [bond.name for bond in BONDS]


class TestFragments:
    def test_a_bond_breaks_by_energy_not_by_length(self):
        assert count_fragments(np.array([1.7]), np.array([0.0, 0.01]), LJ) == 1
        # U(1.2) = (1.2^-6 - 1)^2/72 = 0.00614. A further energy of w^2/4 = 0.00775 breaks the bond:
        # w = 0.176.
        for opening, pieces in ((0.175, 1), (0.177, 2)):
            assert count_fragments(np.array([0.2]), np.array([0, opening]), LJ) == pieces

    def test_closing_and_compressed_bonds_hold(self):
        assert count_fragments(np.array([0.2]), np.array([0.0, -1.0]), LJ) == 1
        assert count_fragments(np.array([-0.2]), np.array([0.0, 1.0]), LJ) == 1


class TestPieces:
    def test_sizes_speeds_and_places(self):
        strains, velocities = np.array([0.0, 9.0, 0.0]), np.array([0.1, 0.1, 1.0, 1.2])
        found = Body(0.5, strains, velocities).pieces(LJ)
        assert found.sizes.tolist() == [2, 2]
        assert found.speeds == pytest.approx([0.1, 1.1])
        assert found.displacements == pytest.approx([0.5, 9.5])
        # The second piece has an internal energy of 2 (0.1)^2/2; a margin and the pull of the bond
        # are added.
        assert 0.01 <= found.energies[1] <= 0.012
        assert found.return_risk == 0.0

    def test_pieces_are_bound_by_the_energy_of_their_relative_motion(self):
        # The kinetic energy of the reduced mass 1/(1/4 + 1/8) is compared with the energy that the
        # stretched bond lacks to break.
        strains = np.where(np.arange(11) == 3, 1.0, 0.0)
        bound = math.sqrt(2.0 * (LJ.dissociation - float(LJ.energy(np.array(1.0)))) * (3.0 / 8.0))
        for speed, sizes in ((0.99 * bound, [12]), (1.01 * bound, [4, 8])):
            velocities = np.repeat([0.0, speed], [4, 8])
            assert Body(0.5, strains, velocities).pieces(LJ).sizes.tolist() == sizes

    def test_bonds_that_never_break_leave_one_piece(self):
        found = Body(0.5, np.array([50.0]), np.array([0.1, 9.0])).pieces(Harmonic())
        assert found.sizes.tolist() == [2]

    def test_pieces_do_not_flicker_with_the_vibration_of_their_ends(self):
        # Two pairs separate permanently. Their ends at the gap vibrate, so that the energy with
        # which the bond opens depends on the phase. The motion of the pieces does not.
        fragments, sizes = set(), set()
        for phase in np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False):
            swing, speed = 0.02 * np.sin(phase), 0.11 * np.cos(phase)
            strains = np.array([swing, 8.0 - swing, swing])
            velocities = np.array([-speed, speed, 0.2 - speed, 0.2 + speed])
            fragments.add(count_fragments(strains, velocities, LJ))
            sizes.add(tuple(Body(1.0, strains, velocities).pieces(LJ).sizes))
        assert fragments == {1, 2}
        assert sizes == {(2, 2)}


@pytest.mark.parametrize("bond", BONDS, ids=NAMES)
@pytest.mark.parametrize("energy", [1e-6, 1e-3, 0.01, 0.1])
def test_the_strains_of_an_energy(bond, energy):
    shortest, longest = bond.strain_range(energy)

    def missing(strain):
        return float(bond.energy(strain)) - energy

    low = brentq(missing, -min(0.999999, 3.0 * math.sqrt(energy) + 0.3), 0.0, xtol=1e-14)
    assert 1.001 * low <= shortest <= low * (1.0 - 1e-9)
    if energy >= bond.dissociation:
        assert longest == math.inf
    else:
        high = brentq(missing, 0.0, 10.0, xtol=1e-14)
        assert high * (1.0 - 1e-9) <= longest <= 1.001 * high


# Older versions of SciPy warn if bounds shorten a step of the search.
@pytest.mark.filterwarnings("ignore:Values in x were outside bounds:RuntimeWarning")
@pytest.mark.parametrize("bond", BONDS, ids=NAMES)
@pytest.mark.parametrize("particles", [2, 3, 6])
@pytest.mark.parametrize("energy", [1e-4, 5e-3, 0.012])
def test_no_end_gets_farther_than_its_reach(bond, particles, energy):
    # D = sum w_i s_i is maximised at a given energy of the bonds, from several starts.
    weights = np.arange(1, particles) / particles
    scale = math.sqrt(2.0 * energy)
    random = np.random.default_rng(3)
    farthest = 0.0
    for _ in range(6):
        start = random.uniform(0.0, 0.5, particles - 1) * scale
        found = minimize(
            lambda s: -float(weights @ s),
            start,
            jac=lambda s: -weights,
            constraints={
                "type": "ineq",
                "fun": lambda s: (energy - float(np.sum(bond.energy(s)))) / energy,
                "jac": lambda s: bond.force(s) / energy,
            },
            bounds=[(-0.5, 10.0)] * (particles - 1),
            options={"ftol": 1e-14, "maxiter": 500},
        )
        if float(np.sum(bond.energy(found.x))) <= energy * (1.0 + 1e-9):
            farthest = max(farthest, float(weights @ found.x))
    bound = reach(bond, energy, Lever.of(np.ones(particles)))
    assert farthest > 0.3 * scale
    assert farthest <= bound * (1.0 + 1e-9)
    # The bound is not too wide. For a harmonic bond, it is the amplitude, within 1e-3 from the
    # grid.
    assert bound < 3.0 * farthest
    if bond.name == "harmonic":
        assert bound == pytest.approx(farthest, rel=2e-3)


def test_reach_ends_where_bonds_may_break():
    assert reach(LJ, LJ.dissociation, Lever.of(np.ones(3))) == math.inf
    assert reach(LJ, 1.0, Lever.of(np.ones(1))) == 0.0
    assert math.isfinite(reach(LJ, 0.999 * LJ.dissociation, Lever.of(np.ones(3))))


@pytest.mark.parametrize("particles", [2, 3, 7])
@pytest.mark.parametrize("speed", [1e-3, 0.05, 0.3])
def test_the_least_energy_of_an_escape(particles, speed):
    # The end particle has broken its bond and moves at the speed -u relative to the mean.
    found = minimize(
        lambda v: 0.5 * float(v @ v) / speed**2,
        np.linspace(-speed, speed, particles),
        jac=lambda v: v / speed**2,
        constraints=[
            {"type": "eq", "fun": lambda v: float(np.sum(v)) / speed},
            {"type": "eq", "fun": lambda v: float(v[0] + speed) / speed},
        ],
        options={"ftol": 1e-14},
    )
    least = LJ.dissociation + found.fun * speed**2
    step = 1e-6 * (least - LJ.dissociation)
    assert escape_risk(LJ, least - step, Lever.of(np.ones(particles)), speed, 1e9) == 0.0
    assert escape_risk(LJ, 1.5 * least, Lever.of(np.ones(particles)), speed, 1e9) > 0.0
    assert escape_risk(LJ, least, Lever.of(np.ones(particles)), 0.0, 1.0) == 1.0


def test_a_bond_over_its_barrier_brings_particle_1_back_at_any_speed():
    # The bond between two particles has all the energy again and again.
    bond = Power(3, -1.0)
    assert escape_risk(bond, 1.01 * bond.barrier, Lever.of(np.ones(2)), 100.0, 1.0) == 1.0
    assert escape_risk(bond, 0.99 * bond.barrier, Lever.of(np.ones(2)), 0.01, 1e9) == 0.0


def test_the_risk_of_one_vibration_is_that_of_energy_shared_freely():
    # If m - 1 vibrations share the energy I at random, their energies are uniform on a simplex.
    particles, speed, energy = 6, 0.1, 0.05
    needed = LJ.dissociation + 0.5 * speed**2 * particles / (particles - 1)
    shares = np.random.default_rng(2).dirichlet(np.ones(particles - 1), 100_000)
    often = float(np.mean(shares[:, 0] > needed / energy))
    deviation = math.sqrt(often / len(shares))
    risk = escape_risk(LJ, energy, Lever.of(np.ones(particles)), speed, 1.0)
    assert risk == pytest.approx(often, abs=4.0 * deviation)


def test_the_risk_never_falls_with_energy_or_patience():
    energies = np.linspace(0.01, 0.2, 60)
    for patience in (1.0, 600.0):
        lever = Lever.of(np.ones(6))
        risks = [escape_risk(LJ, energy, lever, 0.1, patience) for energy in energies]
        assert np.all(np.diff(risks) >= 0.0)
        assert 0.0 == risks[0] < risks[-1] <= 1.0


@pytest.mark.slow
def test_what_is_proved_is_never_followed_by_a_contact():
    """Compare proofs for random states of one to three pieces with the judge."""
    proved = 0
    for index in range(250):
        state = draw_state(5, index)
        if argument_for(state) != "proved":
            continue
        proved += 1
        claim = check("proved", state)
        assert claim.refusal is None, state
        assert claim.next_contact is None, state
    assert proved > 25


@pytest.mark.parametrize("cuts", [[], [0], [3, 4, 9], [18]])
def test_levers_of_all_pieces_are_those_of_each(cuts):
    random = np.random.default_rng(4)
    masses = 10.0 ** random.uniform(-2.0, 2.0, 20)
    starts = np.array([0, *(cut + 1 for cut in cuts)])
    sizes = np.diff(np.append(starts, 20))
    pieces = np.split(masses, starts[1:])
    for (first, last), piece in zip(levers_of(masses, starts, sizes), pieces, strict=True):
        # Sums over a chain round by an epsilon of the total mass per particle, which is 1e4 times
        # some masses.
        assert first == pytest.approx(Lever.of(piece), rel=1e-10, abs=1e-10)
        assert last == pytest.approx(Lever.of(piece[::-1]), rel=1e-10, abs=1e-10)
