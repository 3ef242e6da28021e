"""Test the end of a collision against known states and longer runs."""

import math

import numpy as np
import pytest
from scipy.optimize import minimize

from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones, Toda
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines import end_watch
from chaincor.workflows.engines.end_watch import EndWatch, longest_collision
from chaincor.workflows.engines.ending import (
    RISK_ALLOWED,
    approach,
    argue_end,
    return_risk,
    sound_round_trip,
)
from chaincor.workflows.engines.fragments import Body
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.engines.reference.look_ahead import LookAhead, follow
from chaincor.workflows.engines.whole_end import ENERGY_MARGIN, certain_at

LJ = LennardJones()
LONG = 1e9


def look(watch, now, last_contact, *state):
    """Return the ending that the watch sees for a chain at a wall."""
    return watch.look_at(now, last_contact, [Body(*state)])


def test_an_approaching_chain_is_not_over():
    assert argue_end(1.0, np.zeros(4), np.full(5, -0.1), LONG, Harmonic()) is None
    assert look(EndWatch(5, Harmonic()), LONG, 0.0, 1.0, np.zeros(4), np.full(5, -0.1)) is None


def test_a_resting_chain_that_recedes_is_over_at_once():
    assert argue_end(1e-9, np.zeros(4), np.full(5, 0.1), 0.0, Harmonic()) == "proved"


def test_one_particle():
    assert argue_end(0.0, np.zeros(0), np.array([0.1]), 0.0, LJ) == "proved"
    assert argue_end(0.0, np.zeros(0), np.array([-0.1]), 0.0, LJ) is None


def test_vibration_that_may_reach_back_is_followed_as_long_as_may_be():
    # Harmonic bonds never break. The state gives no proof, and the drift is too slow for a later
    # proof. Only a long time without contact gives an argument.
    state = (0.01, np.zeros(4), np.array([0.5, -0.3, 0.1, -0.3, 1e-6]))
    assert argue_end(*state, LONG, Harmonic()) is None
    watch, cap = EndWatch(5, Harmonic()), longest_collision(5, 1.0, 3.0)
    assert look(watch, 0.999 * cap, 3.0, *state) is None
    assert look(watch, 1.001 * cap, 3.0, *state).kind == "argued"


def test_a_proof_that_will_come_is_waited_for():
    # An energy of 0.32 moves an end particle by up to sqrt(2 0.32 6/5) = 0.88 from its mean
    # position. The mean drifts at 0.1, and 0.01 + 0.1 t exceeds 0.88 from t = 8.7 on.
    state = (0.01, np.zeros(4), np.array([0.5, -0.3, 0.1, -0.3, 0.5]))
    watch, cap = EndWatch(5, Harmonic()), longest_collision(5, 1.0, 3.0)
    assert look(watch, 1.001 * cap, 3.0, *state) is None
    assert cap + 8.7 < watch.followed_until(3.0) < cap + 12.0
    there = (0.01 + 0.1 * 15.0, *state[1:])
    assert look(watch, cap + 15.0, 3.0, *there).kind == "proved"


def test_an_approaching_body_is_waited_for_as_long_as_it_takes_to_meet_for_certain():
    velocities = -np.array([0.5, -0.3, 0.1, -0.3, 0.01])
    watch, cap = EndWatch(5, Harmonic()), longest_collision(5, 1.0, 0.0)
    assert look(watch, 1.001 * cap, 0.0, 1.0, np.zeros(4), velocities) is None
    mean = float(velocities.mean())
    assert mean < 0.0
    # The mean must first move by 1 to the wall, and then by up to the amplitude that the energy
    # allows.
    assert watch.followed_until(0.0) > cap + 1.0 / -mean
    assert watch.followed_until(0.0) < cap + 10.0 / -mean


def test_how_long_a_collision_is_followed():
    for last in (0.0, 10.0, 100.0):
        assert longest_collision(20, 1.0, last) > 20.0 * last + sound_round_trip(20, 1.0)
        # Four times the stiffness makes the motion twice as fast.
        assert longest_collision(20, 4.0, last / 2.0) == pytest.approx(
            longest_collision(20, 1.0, last) / 2.0
        )
    # The longest time has an upper limit, even for very late contacts.
    assert longest_collision(20, 1.0, 1e9) == longest_collision(20, 1.0, 1e8)


def hot_piece(drift, energy, size=6):
    """Return a state in which `size` of seven particles vibrate, and the others recede far away."""
    pattern = np.append([1.0, -1.0, 1.0, -1.0], {5: [0.0], 6: [1.0, -1.0]}[size])
    velocities = np.full(7, drift + 2.0)
    velocities[:size] = drift + math.sqrt(2.0 * energy / (pattern @ pattern)) * pattern
    strains = np.zeros(6)
    strains[size - 1] = 50.0
    return 50.0, strains, velocities


def test_silence_counts_from_when_the_piece_exists():
    # The last contact was long ago, but the piece is new. Its return is unlikely but possible.
    broken = hot_piece(0.1, energy=0.0202)
    risk = return_risk(Body(*broken).pieces(LJ), LJ)
    assert 0.0 < risk <= RISK_ALLOWED
    whole = (0.01, np.zeros(6), np.array([0.1, 0.3, -0.2, 0.3, -0.2, 0.3, -0.2]))
    assert return_risk(Body(*whole).pieces(LJ), LJ) > RISK_ALLOWED
    quiet, watch, last = sound_round_trip(7, 1.0), EndWatch(7, LJ), 100.0
    born = last + 5.0 * quiet
    assert look(watch, born - 1.0, last, *whole) is None
    assert look(watch, born, last, *broken) is None
    assert look(watch, born + 0.9 * quiet, last, *broken) is None
    assert watch.next_look(born + 0.9 * quiet, last) == pytest.approx(born + quiet)
    assert look(watch, born + 0.99 * quiet, last, *broken) is None
    assert look(watch, born + 1.01 * quiet, last, *broken).kind == "argued"


@pytest.mark.parametrize("reason", ["a contact", "another piece", "a risk"])
def test_silence_counts_anew_after(reason):
    broken = hot_piece(0.1, energy=0.0202)
    smaller = hot_piece(0.1, energy=0.0202, size=5)
    assert Body(*smaller).pieces(LJ).sizes[0] == 5
    assert 0.0 < return_risk(Body(*smaller).pieces(LJ), LJ) <= RISK_ALLOWED
    hotter = hot_piece(0.1, energy=0.08)
    assert return_risk(Body(*hotter).pieces(LJ), LJ) > RISK_ALLOWED
    quiet, watch = sound_round_trip(7, 1.0), EndWatch(7, LJ)
    assert look(watch, 1.0, 0.0, *broken) is None
    between = {"a contact": broken, "another piece": smaller, "a risk": hotter}[reason]
    last = 0.9 * quiet if reason == "a contact" else 0.0
    assert look(watch, 0.9 * quiet, last, *between) is None
    # The state in between has ended the silence, whatever state follows.
    assert look(watch, 1.5 * quiet, last, *broken) is None
    assert look(watch, 2.6 * quiet, last, *broken).kind == "argued"


def long_piece(size, particles=900):
    """Return a state with a cold piece that has the energy to break a bond, and a distant rest."""
    velocities = np.full(particles, 2.1)
    velocities[:size] = 0.1 + math.sqrt(2.0 * 0.1 / size) * (-1.0) ** np.arange(size)
    strains = np.zeros(particles - 1)
    strains[size - 1] = 50.0
    return 5000.0, strains, velocities


@pytest.mark.parametrize(("size", "anew"), [(849, False), (848, False), (847, True)])
def test_a_long_piece_may_lose_a_few_in_silence(size, anew):
    # The piece may lose 850 // 400 = 2 particles.
    before, after = long_piece(850), long_piece(size)
    for state in (before, after):
        assert 0.0 < return_risk(Body(*state).pieces(LJ), LJ) <= RISK_ALLOWED
    quiet, watch = sound_round_trip(900, 1.0), EndWatch(900, LJ)
    assert look(watch, 1.0, 0.0, *before) is None
    assert look(watch, 0.5 * quiet, 0.0, *after) is None
    ending = look(watch, 1.1 * quiet, 0.0, *after)
    assert ending is None if anew else ending.kind == "argued"
    assert look(watch, 1.6 * quiet, 0.0, *after).kind == "argued"


def test_few_losses_of_a_long_piece_add_up():
    quiet, watch = sound_round_trip(900, 1.0), EndWatch(900, LJ)
    for share, size in ((0.01, 850), (0.3, 849), (0.5, 848), (0.7, 847), (1.1, 846)):
        assert look(watch, share * quiet, 0.0, *long_piece(size)) is None
    assert look(watch, 1.65 * quiet, 0.0, *long_piece(846)) is None
    assert look(watch, 1.75 * quiet, 0.0, *long_piece(846)).kind == "argued"


def test_a_piece_under_way_to_the_wall_is_waited_for():
    # The mean moves 50 at speed 0.05, which takes 1000. The engine waits a tenth longer.
    state = hot_piece(-0.05, energy=1e-4)
    watch, late = EndWatch(7, LJ), 1.01 * longest_collision(7, 1.0, 0.0)
    assert look(watch, late, 0.0, *state) is None
    assert watch.followed_until(0.0) == pytest.approx(late + 1100.0)
    # The piece comes no nearer. In total, the engine waits for at most ``ARRIVAL_CROSSINGS``.
    assert look(watch, 1050.0 + late, 0.0, *state) is None
    assert look(watch, 2200.0 + late, 0.0, *state).kind == "open"


def test_nothing_is_argued_while_the_first_piece_approaches(monkeypatch):
    monkeypatch.setattr(end_watch, "ARRIVAL_CROSSINGS", 0.0)
    # The positive momentum is that of a distant particle. While the piece approaches, no silence is
    # an argument.
    state = hot_piece(-0.05, energy=1e-4)
    assert state[2].sum() > 0.0
    assert argue_end(*state, LONG, LJ) is None
    watch, cap = EndWatch(7, LJ), longest_collision(7, 1.0, 0.0)
    for now in np.linspace(1.0, 0.99 * cap, 20):
        assert look(watch, now, 0.0, *state) is None
    ending = look(watch, 1.01 * cap, 0.0, *state)
    assert ending.kind == "open"
    # At most, six particles reverse their velocity, which gives 2 m V. Their vibration adds sqrt((m
    # V)^2 + 2 m I) - m V, which is m I/(m V) at first order.
    assert ending.missed_momentum == pytest.approx(2.0 * 6 * 0.05 + 1e-4 / 0.05, rel=0.01)


def test_no_contact_gives_more_than_is_reckoned_with():
    # Follow a piece that approaches to its contacts, and compare with the prediction.
    scene = Scene(particles=6, velocity=0.05)
    for frequency in (0.0, 0.02, 0.05):
        pattern = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])
        start = -0.05 + frequency * pattern
        pieces = Body(1.0, np.zeros(5), start).pieces(LJ)
        outcome = stepping.run(scene.problem, Numerics(scheme="order8", timestep=0.1))
        gained = float(outcome.velocities.sum()) + 6 * 0.05
        assert gained <= approach(pieces) * (1.0 + 1e-9)


def test_the_ends_of_a_broken_bond_are_bound_to_pieces_of_their_own():
    """Use a chain that hits the wall again although by its energy bond 1 seems broken."""
    strains, velocities = np.array([0.5, 0.0]), np.array([0.001, 0.30, -0.25])
    for silence in (0.0, LONG):
        assert argue_end(0.05, strains, velocities, silence, LJ) is None
    scene = Scene(potential="lj", particles=3, velocity=0.1)
    state = np.append(0.05, strains), np.append(0.0, velocities)
    for now in (100.0, 200.0):
        found = follow(scene.problem, *state, now=now, last_contact=100.0, shortest=0.9)
        assert found.ending is None
        # The judge (tests/judge/judge.py) gives 3.819; steps of order 8 have an error of 1e-6.
        assert found.time == pytest.approx(now + 3.819, abs=1e-3)


def test_particle_1_alone_may_approach_while_its_piece_recedes():
    assert argue_end(0.02, np.zeros(1), np.array([-0.1, 0.15]), LONG, LJ) is None


def test_pieces_that_will_meet_are_not_over():
    strains = np.array([0.0, 6.0, 0.0])
    assert argue_end(1.0, strains, np.array([0.2, 0.2, 0.5, 0.5]), 0.0, LJ) == "proved"
    catching_up = np.array([0.2, 0.2, 0.9, -0.7])  # bond 2 opens, but piece 2 is slower
    assert argue_end(1.0, strains, catching_up, LONG, LJ) is None


@pytest.mark.parametrize("bond", [Harmonic(), Toda(), LJ], ids=lambda bond: bond.name)
@pytest.mark.parametrize("size", [2, 3, 6])
def test_the_energy_of_a_return_is_not_overestimated(bond, size):
    # In the state with the least energy, particle 1 is at the wall and does not recede. The m - 1
    # bonds are stretched by the displacement of the mean, and particle 1 moves against the mean.
    # This energy is minimised numerically.
    weights = np.arange(size - 1, 0, -1) / size
    displacement, drift = 0.02 * size, 0.01

    def cost(strains):
        return float(np.sum(bond.energy(strains)))

    found = minimize(
        cost,
        np.full(size - 1, displacement / weights.sum()),
        jac=lambda strains: -bond.force(strains),
        constraints={"type": "eq", "fun": lambda s: weights @ s - displacement},
        # Rounding in the line search is about 1e-14 of the energy. With such a tolerance, success
        # would depend on the last bits of the processor.
        options={"ftol": 1e-10},
    )
    assert found.success
    least = found.fun + 0.5 * drift**2 * size / (size - 1)
    pattern = np.where(np.arange(size) % 2, 1.0, -1.0)
    pattern -= pattern.mean()

    def verdict(internal):
        """Return the argument for an unstrained piece with this internal energy."""
        speed = np.sqrt(2.0 * internal / np.sum(pattern**2))
        return argue_end(displacement, np.zeros(size - 1), drift + speed * pattern, 0.0, bond)

    assert verdict(1.001 * least) is None
    # The factor of 0.5 covers the margin of 1.01 for coarse steps and bounds above the minimum.
    assert verdict(0.5 * least) == "proved"


def test_a_strained_piece_is_weighed_by_its_mean_displacement():
    # D is the mean of u. A strain of the last bond moves it least. The least energy that stretches
    # harmonic bonds by D is D^2/(2 sum w_i^2), with s_i proportional to the weights w_i.
    displacements = np.array([0.3, 0.3, 0.3, 0.32])
    mean, squares = displacements.mean(), (1.0 + 4.0 + 9.0) / 16.0
    drift = 1e-3
    least = 0.5 * mean**2 / squares + 0.5 * drift**2 * 4.0 / 3.0
    strains = np.diff(displacements)
    pattern = np.array([1.0, -1.0, 1.0, -1.0])
    for share, verdict in ((0.985, "proved"), (1.001, None)):  # 1/1.01 is the margin
        kinetic = share * least - 0.5 * float(strains @ strains)
        velocities = drift + np.sqrt(kinetic / 2.0) * pattern
        assert argue_end(0.3, strains, velocities, 0.0, Harmonic()) == verdict


SCENES = [
    {"potential": "harmonic", "particles": 2, "velocity": 0.1},
    {"potential": "harmonic", "particles": 13, "velocity": 0.1},
    {"potential": "harmonic", "particles": 60, "velocity": 0.3},
    {"potential": "toda", "particles": 30, "speed": 0.5},
    {"potential": "toda", "particles": 30, "speed": 3.0},
    {"potential": "log", "particles": 25, "speed": 0.8},
    pytest.param(
        {"potential": "power", "power_order": 4, "power_c": 1.0, "particles": 20, "speed": 0.3},
        marks=pytest.mark.slow,
    ),
    {"potential": "lj", "particles": 20, "speed": 0.1},
    {"potential": "lj", "particles": 40, "speed": 0.7},
    {"potential": "lj", "particles": 40, "speed": 1.0},
    {"potential": "lj", "particles": 15, "speed": 3.0},
]


@pytest.mark.parametrize("fields", SCENES, ids=lambda f: f"{f['potential']}-{f['particles']}")
def test_no_hit_follows_once_the_end_was_seen(fields, monkeypatch):
    # The engine continues with exact steps for eight sound crossings after the first ending. No
    # contact may follow.
    scene = Scene(**fields)
    look, seen = EndWatch.look_at, []

    def patient(self, now, last_contact, *state):
        ending = look(self, now, last_contact, *state)
        if ending is not None and not seen:
            seen.append((now, last_contact))
        long = seen and now > seen[0][0] + 8.0 * scene.particles
        # If the end was given at the longest time, the engine has already followed the chain for
        # long.
        return (
            ending if long or now > longest_collision(scene.particles, 1.0, last_contact) else None
        )

    stays_clear = LookAhead.stays_clear

    def patiently_off(self, until):
        # From this time on, energy rules out a contact.
        off, time, evaluations = stays_clear(self, until)
        run_state = self._moving.run_state
        now, last_contact = run_state.steps * self._stepper.step, float(run_state.last_contact)
        if off and not seen:
            seen.append((now, last_contact))
        long = seen and now > seen[0][0] + 8.0 * scene.particles
        return off and long, time if long else now, evaluations

    monkeypatch.setattr(EndWatch, "look_at", patient)
    monkeypatch.setattr(LookAhead, "stays_clear", patiently_off)
    monkeypatch.setattr(LookAhead, "settle", lambda *_: None)
    step = 0.02 if scene.velocity is None and scene.speed > 2.0 else 0.05
    outcome = stepping.run(scene.problem, Numerics(scheme="order6", timestep=step))
    assert outcome.duration > outcome.contact_times[-1] + 5.0 * scene.particles
    assert outcome.contact_times[-1] == seen[0][1], "a contact came after the end was seen"


def test_what_is_unlikely_in_a_long_chain_is_not_taken_for_impossible():
    # These 2000 particles have 1.3 times the energy that breaks a bond. The probability that one
    # bond has this energy, (1 - 1/1.3)^1998, underflows. However, the mean of this chain is nearer
    # to the wall than without vibration, and the chain hits the wall after a time of 1.3.
    size, drift = 2000, 0.0132
    wave = np.cos(np.pi * (np.arange(size) + 0.5) / size)
    kinetic = 1.3 * LJ.dissociation
    velocities = drift + wave * np.sqrt(2.0 * kinetic / np.sum(wave**2))
    strains = np.full(size - 1, -1e-4)
    for displacement, verdict in ((4e-4, None), (40.0, "argued")):
        state = (displacement, strains if verdict is None else 0.0 * strains, velocities)
        assert argue_end(*state, 0.0, LJ) is None
        assert argue_end(*state, 1e9, LJ) == verdict


def test_two_particles_are_off_the_wall_when_no_energy_reaches_it():
    # With v0 = 0.1 and a speed of 0.06, the internal energy is 1.01 0.01 - 0.0036 = 0.0065. Of
    # this, at least 0.0036 is the motion by which particle 1 would still approach. The rest, E,
    # strains the bond by sqrt(2 E) and moves particle 1 by half of this, which the mean covers at
    # speed 0.06.
    reach = 0.5 * (2.0 * ((1.0 + ENERGY_MARGIN) * 0.01 - 0.0072)) ** 0.5
    for distance in (0.0, 0.01, 0.1):
        found = certain_at(Harmonic(), 0.1, 0.12, distance, np.zeros(1), 3.0, 0.0)
        assert found == pytest.approx(3.0 + max(reach - distance, 0.0) / 0.06, rel=1e-12)
