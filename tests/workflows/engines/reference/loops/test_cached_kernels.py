"""Test that cached object code of compiled loops is found, trusted and kept apart."""

import ctypes
import math
import subprocess
import sys
from types import ModuleType
from typing import NamedTuple

import numba
import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference import stepping
from chaincor.workflows.engines.reference.compile import LoopCompiler
from chaincor.workflows.engines.reference.kernels import kernels_for
from chaincor.workflows.engines.reference.loops import processes
from chaincor.workflows.engines.reference.loops.cached_kernels import (
    CachedKernel,
    set_symbol_address,
)
from chaincor.workflows.engines.reference.loops.fingerprint import fingerprint, has_print
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from tests.programs import ROOT, python

SHARE = 0.5


class Pair(NamedTuple):
    first: np.ndarray
    second: np.ndarray


ONES = np.ones(1)


def doubled(x):
    return 2.0 * x


def build(scale):
    def add(pair, weights, table, count, is_on, record):
        first, second = pair
        total = 0.0
        for i in range(count):
            first[i] += scale(second[i]) * weights[0][0] + table[1, i]
            total += math.exp(first[i])
        record.times += 1
        return total if is_on else -1.0

    return add


def arguments():
    record = np.zeros(1, [("size", "f8"), ("times", "i8")]).view(np.recarray)[0]
    pair = Pair(np.arange(3.0), np.ones(3))
    return pair, (np.full(2, 0.5), 7), np.full((2, 3), 0.25), 3, True, record


def loop(folder, monkeypatch, scale=doubled, name="a"):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(folder))
    compiler = LoopCompiler(name, keep=True)
    return compiler.compile(build(compiler.register(scale)))


def test_arguments_of_every_kind_arrive_and_what_was_kept_gives_the_same(tmp_path, monkeypatch):
    results = []
    for compiled in (1, 0):
        kernel = loop(tmp_path, monkeypatch)
        given = arguments()
        results.append((kernel(*given), given[0].first.tobytes(), int(given[-1].times)))
        assert kernel.compiled == compiled
    plain = arguments()
    expected = build(doubled)(*plain)
    # The result is the sum of three exponentials, each with a few rounding errors.
    assert results[0][0] == pytest.approx(expected, rel=1e-14)
    assert np.array_equal(np.frombuffer(results[0][1]), plain[0].first)
    assert results[0] == results[1]
    assert results[0][2] == 1
    off = arguments()
    assert kernel(*off[:4], False, off[5]) == -1.0


@pytest.mark.parametrize("damage", ["cut", "changed", "other", "empty", "symbol"])
@pytest.mark.slow_cases
def test_what_is_damaged_is_compiled_again(tmp_path, monkeypatch, damage):
    expected = loop(tmp_path, monkeypatch)(*arguments())
    (path,) = tmp_path.glob("*.loop")
    whole = path.read_bytes()
    changed = bytearray(whole)
    changed[-100] ^= 1
    path.write_bytes(
        {
            "cut": whole[:-50],
            "changed": bytes(changed),
            "other": b"[1]\n" + whole,
            "empty": b"",
            # No function has this name: a call would crash the process.
            "symbol": whole.replace(b'"symbol": "', b'"symbol": "x'),
        }[damage]
    )
    again = loop(tmp_path, monkeypatch)
    assert again(*arguments()) == expected
    assert again.compiled == 1
    mended = loop(tmp_path, monkeypatch)
    assert mended(*arguments()) == expected
    assert mended.compiled == 0


def test_of_other_code_nothing_is_taken(tmp_path, monkeypatch):
    first = loop(tmp_path, monkeypatch)(*arguments())

    def tripled(x):
        return 3.0 * x

    tripled.__qualname__ = doubled.__qualname__
    other = loop(tmp_path, monkeypatch, tripled)
    assert other(*arguments()) > first
    assert other.compiled == 1
    assert len(list(tmp_path.glob("*.loop"))) == 1  # The outdated file is overwritten.


def test_arguments_of_other_types_are_another_loop(tmp_path, monkeypatch):
    kernel = loop(tmp_path, monkeypatch)
    pair, weights, table, *rest = arguments()
    kernel(pair, weights, table, *rest)
    # The argument is every second column, which only strides describe.
    wide = np.zeros((2, 6))
    wide[:, ::2], wide[:, 1::2] = table, 99.0
    pair = arguments()[0]
    kernel(pair, weights, wide[:, ::2], *rest)
    assert np.array_equal(pair.first, np.arange(3.0) + 1.25)
    assert kernel.compiled == 2
    with pytest.raises(TypeError, match="Give numbers, arrays or records"):
        kernel(pair, weights, table, "3", *rest[1:])


OTHER = """
import sys
from pathlib import Path
from tests.workflows.engines.reference.loops import test_cached_kernels as tests
compiler = tests.LoopCompiler("a", keep=True)
kernel = compiler.compile(tests.build(compiler.register(tests.doubled)))
print("up", flush=True)
kernel(*tests.arguments())
print(kernel.compiled)
"""


@pytest.mark.slow
def test_what_one_process_compiles_another_waits_for(tmp_path, monkeypatch):
    pytest.importorskip("fcntl")
    others = []
    compile_here = CachedKernel._compile

    def compile_late(kept, given):
        # The other process finds nothing in the cache and would compile first.
        other = subprocess.Popen(
            [sys.executable, "-c", OTHER], cwd=ROOT, stdout=subprocess.PIPE, text=True
        )
        others.append(other)
        assert other.stdout.readline() == "up\n"
        with pytest.raises(subprocess.TimeoutExpired):
            other.wait(1.0)
        return compile_here(kept, given)

    monkeypatch.setattr(CachedKernel, "_compile", compile_late)
    kernel = loop(tmp_path, monkeypatch)
    kernel(*arguments())
    assert kernel.compiled == 1
    assert others[0].communicate()[0] == "0\n"


def test_who_holds_a_name_for_too_long_is_waited_for_no_more(tmp_path, monkeypatch):
    fcntl = pytest.importorskip("fcntl")
    asked = []

    def taken(*given):
        asked.append(given)
        raise BlockingIOError

    monkeypatch.setattr(fcntl, "lockf", taken)
    monkeypatch.setattr(processes, "_LOCK_TIMEOUT", 0.1)
    with processes.one_process(tmp_path / "new", "a loop"):
        pass
    assert len(asked) >= 2


def test_functions_of_other_libraries_are_called_by_address(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    reported = []
    listener = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64)(
        lambda first, second: reported.append((first, second))
    )
    set_symbol_address("chaincor_test_listener", listener)

    def build_tale(listen):
        def tale(numbers):
            for i in range(len(numbers)):
                listen(numbers[i], 10 * numbers[i])

        return tale

    numbers = np.array([2, 3])
    for compiled in (1, 0):
        compiler = LoopCompiler("listening", keep=True)
        kernel = compiler.compile(build_tale(compiler.register_foreign("chaincor_test_listener")))
        run = kernel.bound(numbers)
        assert kernel.compiled == compiled
        run()
        run()
    assert reported == 4 * [(2, 20), (3, 30)]


def test_what_is_bound_keeps_its_arguments(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))

    def add_up(numbers, total):
        for i in range(len(numbers)):
            total[0] += numbers[i]

    total = np.zeros(1)
    run = LoopCompiler("bound", keep=False).compile(add_up).bound(np.ones(1_000_000), total)
    run()
    run()
    assert total[0] == 2e6


def test_without_compilation_one_line_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    with pytest.raises(InputError, match="NUMBA_DISABLE_JIT is set"):
        loop(tmp_path, monkeypatch)(*arguments())


def test_what_allocates_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))

    def allocate(x):
        return np.zeros(3)[0] + x

    with pytest.raises(Exception, match="zeros"):
        LoopCompiler("b", keep=True).compile(allocate)(1.0)


def test_a_folder_that_cannot_be_written_costs_time_alone(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    expected = loop(tmp_path, monkeypatch)(*arguments())
    kernel = loop(tmp_path / "file", monkeypatch)
    assert kernel(*arguments()) == expected


def test_prints_change_with_what_a_function_uses(monkeypatch):
    def uses_share(x):
        return SHARE * x

    def shifted(by):
        return lambda x: x + by

    def nested(x):
        return shifted(2)(x)

    before = fingerprint(uses_share)
    assert fingerprint(uses_share) == before
    monkeypatch.setitem(globals(), "SHARE", 0.25)
    assert fingerprint(uses_share) != before
    assert fingerprint(shifted(1)) != fingerprint(shifted(2))
    assert fingerprint(shifted(1)) == fingerprint(shifted(1))
    before = fingerprint(nested)
    shifted.__code__ = (lambda by: lambda x: x - by).__code__
    assert fingerprint(nested) != before
    assert fingerprint(shifted(np.exp)) != fingerprint(shifted(np.expm1))
    assert fingerprint(shifted(math.exp)) != fingerprint(shifted(math.sin))
    with pytest.raises(TypeError, match="Use functions, numbers or classes"):
        fingerprint(shifted([1]))


def test_every_bond_has_a_print():
    # Loops of bonds whose code changes are compiled again, and two formulas are never confused.
    fields = [{"potential": name} for name in ("harmonic", "lj", "toda", "log", "morse")]
    fields += [{"potential": "power", "power_order": order, "power_c": 1.0} for order in (4, 6)]
    energies = ("exp(-3*(r-1))+3*r", "log(r)^2+tanh(r-1)^2+0.2*(r-1)^4", "sinh(r-1)^2+(r-1)^2")
    fields += [{"potential": "formula", "energy": energy} for energy in energies]
    scenes = [Scene(particles=3, velocity=0.01, **each) for each in fields]
    prints = [fingerprint(scene.bond.force_kernel) for scene in scenes]
    assert len(set(prints)) == len(prints)


@pytest.mark.slow
def test_a_run_with_loops_that_are_kept_loads_neither_numba_nor_scipy():
    program = (
        "import sys; from chaincor import Scene, collide\n"
        "collide(Scene(particles=5, tolerance=1e-4, engine='reference'))\n"
        "print('numba' in sys.modules, 'scipy' in sys.modules)"
    )
    for _ in range(2):  # the first process may have to compile
        printed = python(program)
    assert printed.split() == ["False", "False"]


def spring(stiffer):
    """Return a user's bond whose force is a closure over a number."""

    def force(s):
        return -s - stiffer * s**3

    return UserBond(lambda s: 0.5 * s**2 + 0.25 * stiffer * s**4, force)


def carried(bond):
    """Return eta at one step size, and the number of compilations of its loop."""
    scene = Scene(potential=bond, particles=3, velocity=0.3, engine="reference")
    numerics = Numerics(scheme="verlet", timestep=0.05)
    eta = stepping.run(scene.problem, numerics).velocities.tobytes()
    return eta, kernels_for(bond, STEP_SCHEMES["verlet"]).advance.compiled


@pytest.mark.slow
def test_the_loops_of_a_users_force_are_kept_until_it_changes(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    (first, compiled), (again, not_again) = carried(spring(4.0)), carried(spring(4.0))
    assert (compiled, not_again) == (1, 0)
    assert again == first
    # In one process, the two functions have the same name.
    other, compiled = carried(spring(5.0))
    assert compiled == 1
    assert other != first
    assert carried(spring(4.0))[0] == first


def test_what_may_change_unseen_is_not_kept():
    def of_an_array(s):
        return -s * ONES[0]

    def of_numbers(s, exponent=3):
        return -s - np.exp(0.0) * math.exp(0.0) * s**exponent

    assert not has_print(of_an_array)
    assert has_print(of_numbers)


def test_what_a_module_holds_is_seen_to_change(monkeypatch):
    module = ModuleType("constants")
    module.stiffness, module.other = 1.0, 1.0
    monkeypatch.setitem(globals(), "constants", module)

    def force(s):
        return -constants.stiffness * s  # noqa: F821

    def twice(s):
        return constants.other * force(s)  # noqa: F821

    one, both = fingerprint(force), fingerprint(twice)
    module.other = 2.0
    assert fingerprint(force) == one
    assert fingerprint(twice) != both
    module.other, module.stiffness = 1.0, 2.0
    assert fingerprint(force) != one
    assert fingerprint(twice) != both
