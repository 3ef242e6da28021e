"""The argued end of a collision, against states that are known and runs that went on."""

import numpy as np
import pytest
from scipy.optimize import minimize

from lammps_inputs.numerics import Numerics
from lammps_inputs.potentials import Harmonic, LennardJones, Toda
from lammps_inputs.scene import Scene
from workflows.engines import lammps, lammps_collision
from workflows.engines.ending import (
    Fragments,
    argue_end,
    find_fragments,
    quiet_time,
    slowest_behind,
)

LJ = LennardJones()


def test_an_approaching_chain_is_not_over():
    assert argue_end(1.0, np.zeros(4), np.full(5, -0.1), 1e9, Harmonic()) is None


def test_a_resting_chain_that_recedes_is_over_at_once():
    assert argue_end(1e-9, np.zeros(4), np.full(5, 0.1), 0.0, Harmonic()) == "energy"


def test_vibration_that_may_reach_back_is_not_over_until_quiet():
    velocities = np.array([0.5, -0.3, 0.1, -0.3, 0.5])
    state = (0.01, np.zeros(4), velocities)
    assert argue_end(*state, 1.0, Harmonic()) is None
    quiet = quiet_time(5, 1.0)
    assert argue_end(*state, 0.99 * quiet, Harmonic()) is None
    assert argue_end(*state, 1.01 * quiet, Harmonic()) == "quiet"


def test_one_particle():
    assert argue_end(0.0, np.zeros(0), np.array([0.1]), 0.0, LJ) == "energy"
    assert argue_end(0.0, np.zeros(0), np.array([-0.1]), 0.0, LJ) is None


class TestFragments:
    def test_a_bond_breaks_by_energy_not_by_length(self):
        long_but_slow = find_fragments(np.array([1.7]), np.array([0.0, 0.01]), LJ)
        assert len(long_but_slow.sizes) == 1, "2.7 long and coming back"
        # U(1.2) = (1.2^-6 - 1)^2/72 = 0.00614; 0.00775 more, w^2/4, break it: w = 0.176.
        for opening, pieces in ((0.175, 1), (0.177, 2)):
            assert len(find_fragments(np.array([0.2]), np.array([0, opening]), LJ).sizes) == pieces

    def test_closing_and_compressed_bonds_hold(self):
        assert len(find_fragments(np.array([0.2]), np.array([0.0, -1.0]), LJ).sizes) == 1
        assert len(find_fragments(np.array([-0.2]), np.array([0.0, 1.0]), LJ).sizes) == 1

    def test_sizes_and_velocities(self):
        found = find_fragments(np.array([0.0, 0.5, 0.0]), np.array([0.1, 0.3, 1.0, 2.0]), LJ)
        assert found.starts.tolist() == [0, 2]
        assert found.sizes.tolist() == [2, 2]
        assert found.mean_velocities == pytest.approx([0.2, 1.5])

    def test_pieces_that_will_meet_are_not_over(self):
        strains, velocities = np.array([0.0, 3.0, 0.0]), np.array([0.2, 0.2, 0.5, 0.5])
        assert argue_end(1.0, strains, velocities, 0.0, LJ) == "energy"
        catching_up = np.array([0.2, 0.2, 0.9, -0.7])  # bond 2 opens, piece 2 is slower
        assert argue_end(1.0, strains, catching_up, 1e9, LJ) is None


def collide_until_sorted(sizes, speeds):
    """Let fragments meet as elastic bodies; return all speeds on the way."""
    speeds, met = speeds.copy(), [speeds.copy()]
    while np.any(np.diff(speeds) < -1e-12):
        k = int(np.argmin(np.diff(speeds)))
        pair = slice(k, k + 2)
        speeds[pair] = 2.0 * np.average(speeds[pair], weights=sizes[pair]) - speeds[pair]
        met.append(speeds.copy())
    return np.array(met)


def test_no_fragment_gets_slower_than_the_bound():
    random = np.random.default_rng(8)
    tightest = np.inf
    for _ in range(300):
        sizes = random.integers(1, 40, random.integers(3, 9))
        speeds = 1.0 + 0.1 * np.sort(random.normal(size=len(sizes)))
        speeds[1:] += random.normal(size=len(sizes) - 1) * 0.05
        bound = slowest_behind(Fragments(np.cumsum(sizes) - sizes, sizes, speeds))
        if speeds[1] <= speeds[0]:
            assert bound == -np.inf
            continue
        slowest = collide_until_sorted(sizes[1:], speeds[1:]).min()
        assert slowest >= bound - 1e-12
        tightest = min(tightest, slowest - bound)
    assert tightest < 0.01  # a bound that says something


def test_fragments_that_meet_far_away_do_not_keep_a_collision_open():
    # Three pairs; the second, with 0.95, will meet the third, with 0.85, and take its speed. Their
    # ends part for the moment, so that the bond between them is broken.
    strains = np.array([0.0, 3.0, 0.0, 3.0, 0.0])
    velocities = np.array([0.0, 0.0, 1.2, 0.7, 0.8, 0.9])
    silence = quiet_time(6, LJ.stiffness)
    for first, seconds, verdict in ((0.5, 1.01, "quiet"), (0.5, 0.99, None), (0.86, 1.01, None)):
        velocities[:2] = first
        assert argue_end(1.0, strains, velocities, seconds * silence, LJ) == verdict


@pytest.mark.parametrize("bond", [Harmonic(), Toda(), LJ], ids=lambda bond: bond.name)
@pytest.mark.parametrize("size", [2, 3, 6])
def test_the_energy_needed_to_reach_the_wall_is_not_overestimated(bond, size):
    # The proof says that stretching the m - 1 bonds until particle 1 is at the wall costs at
    # least W U(D/W). Minimise the cost numerically instead, and let the argument decide just
    # below the true minimum: it must never say "energy" above it.
    weights = np.arange(size - 1, 0, -1) / size
    displacement = 0.02 * size

    def cost(strains):
        return float(np.sum(bond.energy(strains)))

    found = minimize(
        cost,
        np.full(size - 1, displacement / weights.sum()),
        jac=lambda strains: -bond.force(strains),
        constraints={"type": "eq", "fun": lambda s: weights @ s - displacement},
        # The search line's own rounding shows at 1e-14 of the energy; a search asked for that
        # much stops with or without success, as the processor's last bits will have it.
        options={"ftol": 1e-10},
    )
    assert found.success
    bound = weights.sum() * float(bond.energy(displacement / weights.sum()))
    # What is found lies above the minimum by ftol at most, give or take the curvature at its
    # foot: a hundred times ftol is set aside.
    assert bound <= found.fun - 1e-8
    # Give the fragment, unstrained and with its mean displaced by D, this much internal energy.
    pattern = np.where(np.arange(size) % 2, 1.0, -1.0)
    pattern -= pattern.mean()
    for share, verdict in ((0.999, "energy"), (1.001, None)):
        internal = share * bound
        speed = np.sqrt(2.0 * internal / np.sum(pattern**2))
        state = (displacement, np.zeros(size - 1), 1.0 + speed * pattern)
        assert argue_end(*state, 0.0, bond) == verdict


def test_a_strained_fragment_is_weighed_by_its_mean_displacement():
    # D is the mean of u, whichever bond is strained; the last one moves it least.
    displacements = np.array([0.3, 0.3, 0.3, 0.32])
    mean, half_sum = displacements.mean(), 1.5
    bound = half_sum * 0.5 * (mean / half_sum) ** 2
    strains = np.diff(displacements)
    pattern = np.array([1.0, -1.0, 1.0, -1.0])
    for share, verdict in ((0.999, "energy"), (1.001, None)):
        kinetic = share * bound - 0.5 * float(strains @ strains)
        velocities = 1.0 + np.sqrt(kinetic / 2.0) * pattern
        assert argue_end(0.3, strains, velocities, 0.0, Harmonic()) == verdict


SCENES = [
    {"potential": "harmonic", "particles": 2, "velocity": 0.1},
    {"potential": "harmonic", "particles": 13, "velocity": 0.1},
    {"potential": "harmonic", "particles": 60, "velocity": 0.3},
    {"potential": "toda", "particles": 30, "speed": 0.5},
    {"potential": "toda", "particles": 30, "speed": 3.0},
    {"potential": "log", "particles": 25, "speed": 0.8},
    {"potential": "power", "power_order": 4, "power_c": 1.0, "particles": 20, "speed": 0.3},
    {"potential": "lj", "particles": 20, "speed": 0.1},
    {"potential": "lj", "particles": 40, "speed": 0.7},
    {"potential": "lj", "particles": 40, "speed": 1.0},
    {"potential": "lj", "particles": 15, "speed": 3.0},
]


@pytest.mark.parametrize("fields", SCENES, ids=lambda f: f"{f['potential']}-{f['particles']}")
def test_no_hit_follows_once_the_end_was_argued(fields, monkeypatch):
    # Let the engine go on for eight sound crossings after the first verdict, and watch.
    verdicts, patience = [], 80

    def patient(first, strains, velocities, since, bond):
        verdicts.append((argue_end(first, strains, velocities, since, bond), since, first))
        return verdicts[-1][0] if patience < len([1 for v, *_ in verdicts if v]) else None

    monkeypatch.setattr(lammps_collision, "argue_end", patient)
    scene = Scene(**fields)
    wide = (0.3, 400.0) if fields["potential"] == "lj" else (0.3, 5.0)
    numerics = Numerics(scheme="order6", timestep=0.05, bond_range=wide)
    # Frames have to be exact to the end: with them nothing is settled by looking ahead.
    lammps.run(scene, numerics, frame_interval=100.0)
    first = next(k for k, (verdict, *_) in enumerate(verdicts) if verdict)
    _, since, distances = zip(*verdicts[first:], strict=True)
    assert len(since) > patience
    assert np.all(np.diff(since) > 0.0), "a contact came after the end was argued"
    assert min(distances) > 0.0
