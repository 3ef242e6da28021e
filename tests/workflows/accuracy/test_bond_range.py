"""Test in both engines that ranges of bond lengths cover the time from first to last contact."""

import numpy as np
import pytest

from chaincor import collide
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.accuracy.bond_range import bonds_from_start, bonds_to_contact
from chaincor.workflows.engines.reference import modal, stepping

STEP, INTERVAL = 0.02, 0.01


def lengths_before_contact(scene):
    """Return bond lengths, of shape (steps, bonds), up to the first contact."""
    x, v, step, lengths = np.cumsum(scene.line.strains), scene.line.velocities[1:].copy(), 1e-3, []
    while x[0] > 0.0 and len(lengths) < 60_000:
        tension = -scene.bond.force(np.diff(x))
        v += step * (np.append(tension, 0.0) - np.append(0.0, tension))
        x += step * v
        lengths.append(1.0 + np.diff(x))
    return np.array(lengths)


def test_compressed_chain_is_never_longer_than_at_its_first_contact():
    scene = Scene(
        potential="lj",
        compression=0.02348,
        particles=2,
        engine="reference",
        velocity=0.17023939917503003,
    )
    # The collision begins with the first contact. Then the bond has a length of 0.97652, and later
    # it is shorter.
    assert collide(scene).bond_max == pytest.approx(1.0 - 0.02348, abs=1e-12)


@pytest.mark.parametrize("potential", ["lj", "harmonic"])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_warm_chain_has_the_range_of_its_frames_between_contacts(potential, seed):
    scene = Scene(potential=potential, particles=4, velocity=0.05, temperature=1e-3, seed=seed)
    if potential == "harmonic":
        outcome = modal.run(scene.problem, frame_interval=INTERVAL)
    else:
        numerics = Numerics(scheme="order8", timestep=STEP)
        outcome = stepping.run(scene.problem, numerics, frame_interval=INTERVAL)
    frames = outcome.frames
    lengths = 1.0 + np.diff(frames.displacements, axis=1)
    during = lengths[(frames.times >= 0.0) & (frames.times <= outcome.contact_times[-1])]
    # Between two frames, steps of 0.02 or samples, a bond length changes by at most the interval
    # times its largest rate, here 0.3.
    room = 0.3 * modal.SAMPLE_INTERVAL if potential == "harmonic" else 0.3 * (STEP + INTERVAL)
    assert outcome.bond_min == pytest.approx(during.min(), abs=room)
    assert outcome.bond_max == pytest.approx(during.max(), abs=room)
    low, high = bonds_from_start(outcome)
    before = lengths_before_contact(scene)
    # Coarse steps have errors of a percent in strains, which are below 0.1.
    assert low == pytest.approx(min(before.min(), outcome.bond_min), abs=room + 1e-3)
    assert high == pytest.approx(max(before.max(), outcome.bond_max), abs=room + 1e-3)


def test_range_up_to_a_contact_ends_there():
    scene = Scene(potential="lj", particles=8, velocity=0.05)
    outcome = stepping.run(scene.problem, Numerics(scheme="order8", timestep=STEP))
    count, times = len(outcome.contact_times), outcome.contact_times
    assert count > 1
    whole = bonds_to_contact(outcome, count, float(times[-1]))
    assert whole == (outcome.bond_min, outcome.bond_max)
    # At the first contact no bond of a cold chain has moved.
    assert bonds_to_contact(outcome, 1, float(times[0])) == (1.0, 1.0)
    # At this time, the motion has another number of contacts.
    assert bonds_to_contact(outcome, count + 1, float(times[-1])) is None


@pytest.mark.slow
def test_late_contact_of_the_pilot_run_does_not_widen_the_range():
    scene = Scene(
        potential="morse",
        morse_a=7.315,
        particles=32,
        engine="lammps",
        tolerance=1e-5,
        velocity=0.19913051821672154,
    )
    found = collide(scene)
    # The expected values are those of the reference engine, which has no late contact at its own
    # steps.
    assert found.contacts == 31
    assert found.bond_max == pytest.approx(1.46166, abs=found.bond_error + 1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["lammps", "reference"])
def test_ranges_of_random_chains_are_within_their_errors(engine):
    random, judged = np.random.default_rng(534), 0
    while judged < 10:
        potential, particles = random.choice(["lj", "toda", "log"]), random.integers(2, 13)
        speed = float(random.uniform(0.05, 1.2))
        chain = {"potential": str(potential), "particles": int(particles), "speed": speed}
        found = collide(Scene(**chain, engine=engine, tolerance=1e-5))
        right = collide(Scene(**chain, engine="reference", scheme="order8", timestep=0.01))
        if found.contacts != right.contacts:
            continue
        judged += 1
        for name in ("bond_min", "bond_max"):
            off = abs(getattr(found, name) - getattr(right, name))
            # Each range is sampled, and strains have errors of up to that of restitution.
            assert off <= found.bond_error + right.bond_error + found.restitution_error, chain
