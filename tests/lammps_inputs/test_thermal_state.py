"""Test warm bodies: draws against theory, initial positions, and seeds."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad

from benchmarks.warm_draws import POTENTIALS
from chaincor.analysis.modes import mode_energies
from chaincor.lammps_inputs.bonds.equilibrium import bond_distribution
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.thermal_state import draw, start_margin
from chaincor.workflows.engines.reference import modal

NONE = np.zeros(0)
TEMPERATURES = (1e-6, 1e-4, 1.5e-3)
# With fixed seeds, a p-value below this means a wrong distribution. For a right distribution, one
# set of seeds in twenty would give such a value among the 48.
LEAST_P = 1e-3


@pytest.mark.parametrize("temperature", TEMPERATURES)
@pytest.mark.parametrize("name", POTENTIALS)
@pytest.mark.slow_cases
def test_bonds_and_velocities_are_distributed_as_theory_says(name, temperature):
    bond = Scene(**POTENTIALS[name]).bond
    masses = np.array([1.0, 3.0, 2.0, 0.5])
    # With the same seeds, all cases would have the same p-value.
    case = 3 * list(POTENTIALS).index(name) + TEMPERATURES.index(temperature)
    drawn = draw(bond, temperature, masses, NONE, list(range(4000 * case, 4000 * case + 4000)))
    # The expected distribution is a quadrature on a fine grid. Its error is far below 1/sqrt(N).
    ends = bond_distribution(bond, temperature).edges[[0, -1]]
    grid = np.linspace(*ends, 200_001)
    density = np.exp(-bond.energy(grid) / temperature, where=grid > -1.0, out=np.zeros_like(grid))
    below = np.concatenate(([0.0], np.cumsum(density[1:] + density[:-1])))
    found = stats.kstest(drawn.strains.ravel(), lambda s: np.interp(s, grid, below / below[-1]))
    assert found.pvalue > LEAST_P
    # Without the motion of the centre of mass, a particle's energy is smaller by a fraction m/M.
    # The velocities in one state are correlated, so that each particle is tested separately.
    for particle, mass in enumerate(masses):
        width = math.sqrt(temperature / mass * (1.0 - mass / masses.sum()))
        found = stats.kstest(drawn.velocities[:, particle] / width, "norm")
        assert found.pvalue > LEAST_P / 2
    momenta = np.abs(drawn.velocities @ masses)
    # The momentum is a sum of four terms of up to about 5 sqrt(m T).
    assert np.max(momenta) < 1e-14 * math.sqrt(temperature)


def test_bonds_of_one_state_and_of_two_seeds_are_independent():
    drawn = draw(LennardJones(), 1e-3, np.ones(6), np.ones(4), list(range(20_000)))
    chain = np.hstack((drawn.strains, drawn.target_strains))
    columns = [*chain.T, *np.roll(chain, 1, axis=0).T, drawn.velocities[:, 0]]
    correlations = np.corrcoef(columns)[np.triu_indices(len(columns), 1)]
    # There are 136 correlations with standard deviation 1/sqrt(N). One set in a thousand exceeds
    # 4.5 standard deviations.
    assert np.max(np.abs(correlations)) < 4.5 / math.sqrt(20_000)


@pytest.mark.slow
def test_every_mode_of_springs_has_the_energy_of_the_temperature():
    scene = Scene(potential="harmonic", particles=8, masses=[1, 2], temperature=1e-4, velocity=0.1)
    count = 4000
    energies = np.zeros((count, 8))
    for seed in range(count):
        line = scene.replace(seed=seed).line
        displacements = np.concatenate(([0.0], np.cumsum(line.strains[1:])))
        energies[seed] = mode_energies(displacements, line.velocities[1:], masses=line.chain_masses)
    assert energies[:, 0] == pytest.approx(0.5 * 12 * 0.1**2, rel=1e-12)
    # E_j is distributed as exp(-E/T), with standard deviation T.
    assert energies[:, 1:].mean(axis=0) == pytest.approx(1e-4, rel=4.0 / math.sqrt(count))
    assert stats.kstest(energies[:, 1:].ravel() / 1e-4, "expon").pvalue > LEAST_P


@pytest.mark.parametrize("masses", [[1], [1, 2, 5]])
def test_the_centre_of_mass_starts_at_one_distance(masses):
    scene = Scene(particles=20, masses=masses, temperature=1e-3, speed=0.3)
    for bodies in ({}, {"target_particles": 7, "target_masses": [2, 1]}):
        distances = []
        for seed in range(30):
            line = scene.replace(seed=seed, **bodies).line
            places = np.concatenate(([0.0], np.cumsum(1.0 + line.strains)))
            places[line.first :] -= 1.0  # The gap has no natural length.
            chain = line.chain_masses @ places[line.first :] / line.chain_masses.sum()
            target = places[0]
            if not line.rigid:
                target = line.masses[: line.first] @ places[: line.first]
                target /= line.masses[: line.first].sum()
            distances.append(chain - target)
            assert line.strains[line.gap] > 0.0
            assert line.separation(line.velocities) == pytest.approx(
                -scene.impact_velocity, rel=1e-13
            )
        # Positions are sums of some 30 lengths of about 1.
        assert np.ptp(distances) < 1e-13


def test_margins_are_those_of_the_bound():
    bond = Scene(potential="harmonic").bond
    shares = np.arange(1, 100) / 100
    # For Gaussians, the margin is sqrt(2 ln(1e12)) standard deviations. The computed margin is
    # slightly larger: shares are rounded upward by up to 1/256, and the bound is evaluated on a
    # grid.
    wanted = math.sqrt(2.0 * math.log(1e12) * 1e-4 * np.sum(shares**2))
    found = start_margin(bond, 1e-4, shares)
    assert wanted <= found < 1.01 * wanted
    # For a single bond, the probability of the tail is known and below the bound.
    log = Scene(potential="log").bond
    margin = start_margin(log, 0.5, np.array([0.5]))
    mean = bond_distribution(log, 0.5).mean
    tail = quad(lambda s: math.exp(-2.0 * (s - math.log1p(s))), mean + 2.0 * margin, math.inf)[0]
    whole = quad(lambda s: math.exp(-2.0 * (s - math.log1p(s))), -1.0, math.inf)[0]
    assert 1e-15 < tail / whole < 1e-12
    assert start_margin(log, 0.5, NONE) == 0.0


@pytest.mark.slow
def test_a_farther_start_changes_no_distribution():
    scene = Scene(potential="harmonic", particles=3, velocity=0.03, temperature=1e-3)

    def speeds(seeds, gap_of):
        found = []
        for seed in seeds:
            drawn = scene.replace(seed=seed)
            line = drawn.line
            strains = line.strains.copy()
            strains[line.gap] = gap_of(strains[line.gap])
            line = replace(line, strains=strains)
            drawn.__dict__["line"] = line  # the cached property
            found.append(modal.run(drawn.problem).separation_velocity)
        return found

    count = 500
    started = speeds(range(count), lambda gap: gap)
    farther = speeds(range(count, 2 * count), lambda gap: gap + 1.7)
    assert stats.ks_2samp(started, farther).pvalue > 0.01
    # If particle 1 starts at the wall, the distribution differs: vibrations always have the same
    # phase.
    nearest = speeds(range(count), lambda _: 1e-9)
    assert stats.ks_2samp(started, nearest).pvalue < 1e-5


def test_a_body_that_would_overlap_starts_farther_away(monkeypatch):
    plain = draw(LennardJones(), 1e-3, np.ones(4), NONE, list(range(50))).gaps
    margin = start_margin(LennardJones(), 1e-3, np.array([0.75, 0.5, 0.25]))
    small = 0.01 * margin
    monkeypatch.setattr("chaincor.lammps_inputs.thermal_state.start_margin", lambda *_: small)
    gaps = draw(LennardJones(), 1e-3, np.ones(4), NONE, list(range(50))).gaps
    assert np.all(gaps > 0.0)
    over = plain - margin + small
    assert np.any(over < 0.0)
    assert gaps[over > 0.0] == pytest.approx(over[over > 0.0], abs=1e-14)
    assert np.all(gaps[over < 0.0] <= small + 1e-15)


def test_a_state_depends_on_its_own_seed_alone():
    bond = LennardJones()
    many = draw(bond, 1e-3, np.ones(9), np.ones(3), [5, 6, 7])
    for row, seed in enumerate([5, 6, 7]):
        one = draw(bond, 1e-3, np.ones(9), np.ones(3), [seed])
        assert all(np.array_equal(a[row], b[0]) for a, b in zip(many, one, strict=True))
    longer = draw(bond, 1e-3, np.ones(12), NONE, [6])
    # The strains of a longer chain begin with those of a shorter chain; the target has its own
    # random numbers.
    assert np.array_equal(longer.strains[0, :8], many.strains[1])
    assert not np.allclose(many.strains[1, :2], many.target_strains[1])


# States are reproducible on any machine, except for the last digits of exponentials.
VELOCITIES = [-0.029559229979791216, 0.013208167755346254, 0.0031428944690987115]
GOLDEN = {
    "harmonic": (0.23382434003243294, [-0.06466012729896908, 0.0021165554261466336]),
    "lj": (0.7589888628507311, [-0.048824268917258946, 0.010082079477855565]),
    "toda": (0.33891641146016377, [-0.05578235978555696, 0.00552290087720318]),
    "morse": (0.5772448862124754, [-0.050741575895460266, 0.008824466935327057]),
    "log": (0.2465286656281802, [-0.06262716014433672, 0.0027853819697858054]),
}


@pytest.mark.parametrize("name", GOLDEN)
def test_a_seed_means_the_same_on_every_machine(name):
    drawn = draw(Scene(**POTENTIALS[name]).bond, 1e-3, np.array([1.0, 2.0, 1.0]), NONE, [2026])
    gap, strains = GOLDEN[name]
    assert drawn.gaps[0] == pytest.approx(gap, rel=1e-12)
    assert drawn.strains[0] == pytest.approx(strains, rel=1e-12)
    assert drawn.velocities[0] == pytest.approx(VELOCITIES, rel=1e-12)


WARM = {"particles": 4, "temperature": 1e-4}
BAD = [
    ({"seed": 1, "temperature": None}, "seed has no effect without temperature. Give"),
    ({"temperature": 0.0}, "temperature is 0.0: .*greater than 0"),
    ({"temperature": -1e-3}, "temperature is -0.001: .*greater than 0"),
    ({"temperature": math.nan}, "temperature is nan"),
    ({"temperature": math.inf}, "temperature is inf"),
    ({"temperature": True}, "temperature is True: expected a number"),
    ({"temperature": "hot"}, "temperature is 'hot'"),
    ({"seed": -1}, "seed is -1: .*greater than or equal to 0"),
    ({"seed": True}, "seed is True: expected a whole number"),
    ({"seed": 1.5}, "seed is 1.5"),
    ({"seed": 2**63}, "seed is 9223372036854775808: .*less than or equal"),
    ({"compression": 0.1}, "temperature and compression both define the initial state"),
    ({"temperature": 0.01}, "temperature is 0.01: an energy of 0.0138889 breaks a lj bond"),
    ({"velocity": 1e-7}, "temperature is 0.0001 and the impact velocity 1e-07, less than 0.0001"),
]


@pytest.mark.parametrize(("fields", "line"), BAD, ids=[str(fields)[:60] for fields, _ in BAD])
def test_bad_input_is_one_clear_line(fields, line):
    with pytest.raises(InputError, match=line) as caught:
        Scene(**(WARM | fields))
    assert "\n" not in str(caught.value)
    assert caught.value.exit_status == 2


def test_a_state_is_given_or_drawn(tmp_path):
    (tmp_path / "state.csv").write_text("strain\n0\n0\n")
    with pytest.raises(InputError, match="temperature and initial both define the initial state"):
        Scene(particles=2, initial=tmp_path / "state.csv", temperature=1e-4)


def test_a_scene_is_known_by_its_temperature_and_seed():
    scene = Scene(**WARM)
    assert scene.sha256 == Scene(**WARM, seed=1).sha256
    others = [Scene(**WARM, seed=2), Scene(**(WARM | {"temperature": 2e-4})), Scene(particles=4)]
    assert len({scene.sha256, *(other.sha256 for other in others)}) == 4
    again = Scene.from_toml(Scene(**WARM, seed=7).to_toml())
    assert (again.temperature, again.seed) == (1e-4, 7)


def test_one_particle_has_nothing_to_vibrate():
    line = Scene(particles=1, temperature=1e-4, velocity=0.1).line
    assert line.velocities.tolist() == [0.0, -0.1]
    assert line.strains.tolist() == [0.0]
