"""Test that compiled loops agree with NumPy, are cached by potential, and find all contacts."""

import os
import subprocess
import sys

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones, Logarithmic, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.lammps_inputs.contacts.contact_laws import CONTACT_LAWS
from chaincor.workflows.engines.contact_search import (
    SEARCH_FIELDS,
    build_contact_search,
    count_sign_changes,
    fit_path,
)
from chaincor.workflows.engines.reference import kernels
from chaincor.workflows.engines.reference.array_stages import array_stages
from chaincor.workflows.engines.reference.compile import LoopCompiler, scalar_force
from chaincor.workflows.engines.reference.line_traits import WALL, KernelSpec, LineTraits
from chaincor.workflows.engines.reference.motion import build_coarse_steps
from chaincor.workflows.engines.reference.stages import State, looped_stages
from chaincor.workflows.engines.schemes import STEP_SCHEMES, StepCoefficients

BONDS = [Harmonic(), LennardJones(), Toda(), Logarithmic(), Power(4, 1.0)]


def unregistered(function):
    return function


def kernel_of(bond):
    force = scalar_force(bond)
    assert force is not None
    return force


def random_state(rng, bonds):
    return State(rng.uniform(-0.1, 0.1, bonds), rng.uniform(-0.1, 0.1, bonds + 1))


def copied(state):
    return State(*(part.copy() for part in state))


@pytest.mark.parametrize("bond", BONDS, ids=lambda bond: bond.name)
def test_compiled_stage_is_the_stage_in_numpy(bond):
    loops = random_state(np.random.default_rng(5), 37)
    arrays = copied(loops)
    force = kernel_of(bond)
    compiler = LoopCompiler("test_kernels", keep=False)
    stages = looped_stages(KernelSpec(compiler.register(force.function), compiler.register))
    compiler.compile(stages.stage)(*loops, 37, 0.03, 0.05, force.parameters)
    array_stages(bond).stage(*arrays, 37, 0.03, 0.05, bond.parameters)
    # Fused multiply-adds round once instead of twice, which gives differences of a few epsilon
    # times 0.1.
    assert np.allclose(loops.strain, arrays.strain, rtol=0.0, atol=1e-16)
    assert np.allclose(loops.velocity, arrays.velocity, rtol=0.0, atol=2e-15)


def test_each_kind_of_line_keeps_its_loops_under_its_own_name():
    force = kernel_of(LennardJones()).function
    contacts = (WALL, *CONTACT_LAWS)
    kinds = [LineTraits(contact, unit) for contact in contacts for unit in (True, False)]
    loops = [kernels._compile(force, True, kind, build_coarse_steps) for kind in kinds]
    assert len({loop._function.__qualname__ for loop in loops}) == len(kinds)


@pytest.mark.parametrize("bonds", [9, 5])
def test_loops_say_what_arrays_say(bonds):
    # The step includes all 9 bonds of a chain, or the first 5.
    rng = np.random.default_rng(6)
    bond = LennardJones()
    loops = looped_stages(KernelSpec(kernel_of(bond).function, unregistered))
    arrays = array_stages(bond)
    old = random_state(rng, 9)
    for name, inputs, arguments in (
        ("start", (old,), (0.1, 0.2, bond.parameters)),
        ("stage", (), (0.1, 0.2, bond.parameters)),
        ("drift", (), (0.1,)),
    ):
        first = random_state(rng, 9)
        states = first, copied(first)
        for stages, state in zip((loops, arrays), states, strict=True):
            getattr(stages, name)(*inputs, *state, bonds, *arguments)
        for ours, theirs in zip(*states, strict=True):
            assert np.allclose(ours, theirs, rtol=1e-14)
    copies = []
    for stages in (loops, arrays):
        copies.append(State(np.zeros(9), np.zeros(10)))
        stages.copy(*old, copies[-1], bonds)
    assert all(np.array_equal(ours, theirs) for ours, theirs in zip(*copies, strict=True))
    assert np.array_equal(copies[0].velocity[: bonds + 1], old.velocity[: bonds + 1])
    half = State(0.5 * old.strain, 0.5 * old.velocity)
    mixtures = []
    for stages in (loops, arrays):
        mixture = State(np.ones(9), np.ones(10))
        stages.mix(old, half, mixture, bonds, 0.1, 3.0)
        mixtures.append(mixture)
    assert np.allclose(mixtures[0].strain, mixtures[1].strain, rtol=1e-14)
    assert np.allclose(
        mixtures[0].velocity[: bonds + 1], 1.0 + 1.5 * old.velocity[: bonds + 1], rtol=1e-14
    )
    assert np.array_equal(mixtures[0].velocity[bonds + 1 :], np.ones(9 - bonds))
    strain = old.strain.copy()
    strain[3] = strain[7] = np.nan
    expected = 2 if bonds == 9 else 1
    for stages in (loops, arrays):
        assert stages.count_outside(strain, bonds, -1.0, 1.0, bond.parameters) == expected


@pytest.mark.parametrize("scheme", STEP_SCHEMES.values(), ids=lambda scheme: scheme.name)
def test_near_the_wall_a_step_needs_no_more_particles_than_it_has_stages(scheme):
    bond = LennardJones()
    take_step = scheme.build_step(array_stages(bond))
    old = random_state(np.random.default_rng(7), 39)
    rule = StepCoefficients(scheme.fractions, bond.parameters)

    def after(bonds, size):
        new, trial = [State(np.full(size, np.nan), np.full(size + 1, np.nan)) for _ in range(2)]
        x = take_step(0.1, old, new, trial, 39, bonds, 0.1, rule)
        return x, new.strain[:bonds], new.velocity[:bonds]

    whole, near = after(39, 39), after(1, scheme.reach)
    # The operations and their operands are the same.
    assert whole[0] == near[0]
    assert whole[1][0] == near[1][0]
    assert whole[2][0] == near[2][0]


@pytest.mark.parametrize("scheme", STEP_SCHEMES.values(), ids=lambda scheme: scheme.name)
def test_weights(scheme):
    if scheme.extrapolated:
        # An extrapolation must be exact for constants and remove the even powers up to its order.
        weights, counts = scheme.fractions
        for power in range(0, scheme.order, 2):
            total = float(weights @ counts ** (-float(power)))
            assert total == pytest.approx(1.0 if power == 0 else 0.0, abs=1e-13)
        assert scheme.evaluations == sum(counts)
        assert scheme.runs == len(counts) == scheme.order // 2
        assert scheme.shortest_stage(0.6) == pytest.approx(0.6 / max(counts), rel=1e-15)
        # The numbers of steps for order 12 are further apart than 1 to 6, which would amplify
        # rounding 27 times.
        assert (scheme.amplification > 20.0) is (scheme.order > 12)
    else:
        drifts, kicks = scheme.fractions
        assert drifts.sum() == pytest.approx(1.0, rel=1e-15)
        assert kicks.sum() == pytest.approx(1.0, rel=1e-15)
        assert np.array_equal(drifts, drifts[::-1])
        assert scheme.evaluations == len(kicks)
        assert scheme.shortest_stage(0.5) == 0.5 * min(abs(kicks))
        assert scheme.amplification == 1.0


# The loops of the coarse motion compile in a second. All other loops are cached in the same way.
TWO_COARSE_STEPS = """
import sys
import numba, pydantic, numpy as np
sys.dont_write_bytecode, sys.pycache_prefix = False, sys.argv[1]
from chaincor.lammps_inputs.bonds.potentials import Harmonic, LennardJones
from chaincor.workflows.engines.reference.compile import LoopCompiler, scalar_force
from chaincor.workflows.engines.reference.line_traits import KernelSpec
from chaincor.workflows.engines.reference.bookkeeping import RUN_STATE
from chaincor.workflows.engines.reference.motion import build_coarse_steps
from chaincor.workflows.engines.reference.stages import State, looped_stages
for bond in (Harmonic(), LennardJones()):
    force = scalar_force(bond)
    compiler = LoopCompiler.for_force(force.function, force.keep)
    source = KernelSpec(compiler.register(force.function), compiler.register)
    take_coarse_steps = compiler.compile(build_coarse_steps(source, looped_stages(source)))
    run_state = np.zeros(1, RUN_STATE).view(np.recarray)[0]
    run_state.position, run_state.strain_min, run_state.strain_max = 1.0, -0.5, 0.5
    state = State(np.full(4, -0.1), np.zeros(5))
    asked = 3, 0.1, 0.0, True, True
    assert take_coarse_steps(run_state, state, asked, force.parameters) == 3
    print(state.velocity.tobytes().hex(), take_coarse_steps.compiled)
"""


@pytest.mark.slow
def test_loops_kept_on_disk_are_found_again_and_do_not_mix_potentials(tmp_path):
    # The first process also compiles the modules, which the second loads as bytecode. Once, the
    # second process mistook loops for others, and with shared symbols it once used the harmonic
    # force for lj.
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "loops")}
    first, second = (
        subprocess.run(
            [sys.executable, "-c", TWO_COARSE_STEPS, str(tmp_path / "bytecode")],
            env=environment, capture_output=True, text=True, check=True,
        ).stdout.split()
        for _ in range(2)
    )  # fmt: skip
    assert first[::2] == second[::2]
    assert first[0] != first[2]
    assert (first[1::2], second[1::2]) == (["1", "1"], ["0", "0"])
    kept = [path.name for path in tmp_path.rglob("*.loop")]
    assert sorted("lj_force" in name for name in kept) == [False, True]


def new_run_state():
    return np.zeros(1, np.dtype(SEARCH_FIELDS)).view(np.recarray)[0]


def search_for(path):
    """Return the result of the contact search on a path given as a polynomial."""
    slope, gap_acceleration = path.deriv(), path.deriv(2)

    def state_after(time, *_):
        return path(time), slope(time), gap_acceleration(time)

    find = build_contact_search(state_after=state_after, register=unregistered)
    ends = [(path(t), slope(t), gap_acceleration(t)) for t in (0.0, 1.0)]
    return find(1.0, *ends, new_run_state(), None)


@pytest.mark.parametrize(
    ("roots", "first"),
    [
        ((0.3,), 0.3),
        ((0.3, 0.6), 0.3),
        ((0.45, 0.46), 0.45),
        ((0.2, 0.5, 0.9), 0.2),
        ((0.7, 0.71, 0.72), 0.7),
        ((-0.1, 1.2), -1.0),
        ((1.0001,), -1.0),
    ],
)
@pytest.mark.parametrize("departs", [False, True])
def test_first_contact_of_a_path(roots, first, departs):
    path = np.polynomial.Polynomial.fromroots(((0.0, *roots)) if departs else roots)
    start = path.deriv()(0.0) if departs else path(0.0)
    path = path * np.sign(start)
    assert search_for(path) == pytest.approx(first, abs=1e-12)


def test_random_paths_lose_no_contact():
    rng = np.random.default_rng(8)
    found = 0
    for _ in range(300):
        roots = rng.uniform(-1.0, 2.0, 4)
        path = np.polynomial.Polynomial.fromroots(roots)
        path = path * np.sign(path(0.0))
        inside = roots[(roots > 0.0) & (roots < 1.0)]
        expected = inside.min() if len(inside) else -1.0
        assert search_for(path) == pytest.approx(expected, abs=1e-9)
        found += len(inside) > 0
    assert found > 150


@pytest.mark.parametrize("frequency", [2.0, 4.0, 6.0, 8.0])
@pytest.mark.parametrize("offset", [-0.2, 0.0, 0.3, 0.9])
def test_path_that_no_quintic_fits(frequency, offset):
    # Particle 1 oscillates up to three times in one step, which no quintic fits.
    def state_after(time, *_):
        phase = frequency * time
        gap_acceleration = -(frequency**2) * np.sin(phase)
        return (
            np.sin(phase) + offset * phase,
            frequency * (np.cos(phase) + offset),
            gap_acceleration,
        )

    find = build_contact_search(state_after=state_after, register=unregistered)
    time = find(1.0, state_after(0.0), state_after(1.0), new_run_state(), None)
    times = np.linspace(1e-4, 1.0, 100_000)
    below = np.flatnonzero(state_after(times)[0] < 0.0)
    expected = times[below[0]] if len(below) else -1.0
    assert time == pytest.approx(expected, abs=2e-5)


def test_quintic_fit():
    path = np.polynomial.Polynomial([0.3, -0.7, 0.2, 1.1, -0.4, 0.9])
    step = 0.8
    ends = [(path(t), path.deriv()(t), path.deriv(2)(t)) for t in (0.0, step)]
    fitted = fit_path(*ends, step)
    assert fitted == pytest.approx(path.coef * step ** np.arange(6), abs=1e-13)
    assert count_sign_changes((0.0, 1.0, 0.0), (1.0, 1.0, 0.0), 1.0) == 0
    assert count_sign_changes((0.0, 1.0, 0.0), (-1.0, -3.0, 0.0), 1.0) == 1
