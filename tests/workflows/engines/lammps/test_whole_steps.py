"""Test composed steps that LAMMPS takes with other masses against steps with other time steps."""

import numpy as np
import pytest

from chaincor.lammps_inputs.bond_table import tabulate_near_and_far
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import COMPOSITIONS
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import BondRangeError

STEP = 0.3
SCENES = {
    "chain": Scene(particles=10, speed=0.4),
    "no table": Scene(potential="harmonic", particles=10, velocity=0.1),
    "unequal masses": Scene(particles=9, speed=0.4, masses=(1.0, 2.5, 0.4)),
    "free target": Scene(particles=6, speed=0.4, target_particles=4, target_masses=(3.0,)),
}


def set_up(scene, folder, scheme="extrapolated12", bond_range=(0.8, 1.3)):
    numerics = Numerics(scheme=scheme, timestep=STEP, bond_range=bond_range)
    table = None if scene.bond.is_harmonic else tabulate_near_and_far(scene.bond, bond_range)
    return LammpsChain(scene.problem, numerics, table, folder)


def masses_of(chain):
    return chain.lammps.numpy.extract_atom("mass").copy()


def parts_of(chain, scheme, duration, before):
    """Take a composed step by separate LAMMPS runs; return x, v and f."""
    if scheme in COMPOSITIONS:
        for weight in COMPOSITIONS[scheme].weights:
            chain.commands(f"timestep {weight * duration:.17g}\nrun 1 pre no post no")
        return np.array(chain.snapshot()[:3])
    mixture, mixed = STEP_SCHEMES[scheme].fractions, 0.0
    for count, weight in zip(mixture.counts.astype(int), mixture.weights, strict=True):
        chain.restore(before)
        chain.commands(f"timestep {duration / count:.17g}\nrun {count} pre no post no")
        mixed = mixed + weight * np.array(chain.snapshot()[:3])
    return mixed


@pytest.mark.parametrize(
    "scheme", ["verlet", "order4", "order6", "order8", "extrapolated12", "extrapolated14"]
)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("duration", [None, 0.17])
def test_a_step_is_what_its_parts_make(tmp_path, name, scheme, duration):
    with set_up(SCENES[name], tmp_path, scheme) as chain:
        chain.v[0] = -chain.v[0]  # so that bonds are strained
        masses = masses_of(chain)
        for _ in range(4):
            chain.step()
        before, done = chain.snapshot(), chain.stages_done
        chain.step(duration)
        after = np.array(chain.snapshot()[:3])
        assert chain.stages_done - done == STEP_SCHEMES[scheme].evaluations
        chain.restore(before)
        expected = parts_of(chain, scheme, duration or STEP, before)
        # Coordinates up to 10 are rounded to 1e-15 in each of 8 or 17 steps, and extrapolation
        # amplifies this up to 60 times. A wrong mass would change the state by 1e-3.
        assert np.max(np.abs(after - expected)) < 5e-13
        assert np.max(np.abs(after - before[:3])) > 1e-3
        assert np.array_equal(masses_of(chain), masses)


@pytest.mark.parametrize("scheme", ["order8", "extrapolated12"])
def test_steps_of_either_length_take_turns(tmp_path, scheme):
    with set_up(SCENES["chain"], tmp_path, scheme) as chain:
        chain.v[0] = -chain.v[0]
        start = chain.snapshot()
        chain.step(0.5 * STEP)
        chain.verlet(1e-9)
        middle = chain.snapshot()
        chain.step()
        turns = np.array(chain.snapshot()[:3])
        chain.restore(middle)
        chain.step(STEP)
        assert np.array_equal(turns, chain.snapshot()[:3])
        chain.restart(0.5 * STEP)
        chain.restore(start)
        chain.step()
        chain.verlet(1e-9)
        assert np.array_equal(middle[:3], chain.snapshot()[:3])


@pytest.mark.parametrize("scheme", ["order8", "extrapolated12"])
def test_a_step_that_fails_leaves_masses_as_they_are(tmp_path, scheme):
    with set_up(SCENES["unequal masses"], tmp_path, scheme, (0.99, 1.01)) as chain:
        chain.v[0] = -chain.v[0]
        masses, before = masses_of(chain), chain.snapshot()
        with pytest.raises(BondRangeError, match=r"its table\. Give a wider"):
            chain.step(6.0 * STEP)
        assert np.array_equal(masses_of(chain), masses)
        chain.restore(before)
        chain.verlet(1e-3)
        assert np.max(np.abs(chain.x - before[0])) < 1e-3
