"""Test that compiled loops return to Python for signals and continue without a change."""

import signal
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest
from numba.core import event

from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines import time_limit
from chaincor.workflows.engines.lammps import engine as lammps
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.reference import adaptive, modal, stepping
from chaincor.workflows.engines.reference import moving as chain_module
from chaincor.workflows.engines.reference.moving import Motion, Stepper
from chaincor.workflows.errors import CostError
from tests.waiting import HANGS
from tests.workflows.engines.reference.loops.test_cached_kernels import arguments, loop

LJ = Scene(potential="lj", particles=24, speed=0.9)
# Each run ends with a look ahead in coarse steps, if its engine has one.
RUNS = {
    "composed": lambda: stepping.run(LJ.problem, Numerics(scheme="order8", timestep=0.2)),
    "extrapolated": lambda: stepping.run(
        LJ.problem, Numerics(scheme="extrapolated14", timestep=0.5)
    ),
    "modal": lambda: modal.run(
        Scene(potential="harmonic", particles=40, velocity=0.1).problem, 0.7
    ),
    "adaptive": lambda: adaptive.run(
        Scene(potential="log", particles=8, speed=2.0).problem, 1e-8, 0.5
    ),
    "lammps": lambda: lammps.run(LJ.problem, Numerics(scheme="verlet", timestep=0.01)),
}


@pytest.mark.parametrize("run", RUNS.values(), ids=RUNS.keys())
def test_pauses_change_no_bit(run, monkeypatch):
    whole = run()
    monkeypatch.setattr(time_limit, "WORK_AT_ONCE", 300)  # a few steps, or windows
    parts = run()
    for name in ("contact_times", "contact_speeds", "velocities", "displacements"):
        assert np.array_equal(getattr(whole, name), getattr(parts, name)), name
    for name in ("duration", "ending", "bond_min", "bond_max", "force_evaluations"):
        assert getattr(whole, name) == getattr(parts, name), name
    if whole.frames is not None:
        assert np.array_equal(whole.frames.displacements, parts.frames.displacements)


@pytest.mark.parametrize("run", RUNS.values(), ids=RUNS.keys())
def test_a_run_whose_time_is_up_is_stopped(run):
    with time_limit.limited_to(1.0):
        time_limit.time_limit().end = time.monotonic()
        with pytest.raises(CostError, match="was stopped after about 1 s"):
            run()


@pytest.mark.parametrize("passes", [0, 1, 20, 40])
def test_compilation_is_stopped_and_done_again_later(tmp_path, monkeypatch, passes):
    kernel = loop(tmp_path, monkeypatch)
    left = passes

    class Countdown(event.Listener):
        def on_start(self, _event):
            nonlocal left
            left -= 1
            if left < 0:
                time_limit.time_limit().end = time.monotonic() - 1.0

        def on_end(self, _event):
            pass

    # The limit ends at the beginning of a pass of the compiler. The loop has about 50 passes.
    with (
        time_limit.limited_to(1e4),
        event.install_listener("numba:run_pass", Countdown()),
        pytest.raises(CostError, match=r"was stopped after about 2\.8 h"),
    ):
        kernel(*arguments())
    with time_limit.limited_to(3600.0):
        assert kernel(*arguments()) == loop(tmp_path, monkeypatch)(*arguments())


class Counted:
    """Loops that record their calls."""

    def __init__(self, kernels):
        self.steps, self._advance = [], kernels.advance

    def advance(self, run_state, *others):
        before = int(run_state.steps)
        status = self._advance(run_state, *others)
        self.steps.append(int(run_state.steps) - before)
        return status


def test_no_call_does_more_work_than_it_may(monkeypatch):
    monkeypatch.setattr(chain_module, "cores", lambda: 1)
    scene = Scene(potential="lj", particles=200_001, speed=0.4)
    stepper = Stepper.of(scene.line, scene.bond, "order4", 1e-3)
    kernels, evaluations = Counted(stepper.kernels), stepper.scheme.evaluations
    chain = Motion.at_start(scene.problem, replace(stepper, kernels=kernels))
    target_steps = 4 * time_limit.WORK_AT_ONCE // (evaluations * 200_000)
    chain.advance(target_steps)
    assert sum(kernels.steps) == target_steps
    assert max(kernels.steps) * evaluations * 200_000 <= time_limit.WORK_AT_ONCE
    assert len(kernels.steps) == 4


def test_lammps_comes_back_too(tmp_path, monkeypatch):
    monkeypatch.setattr(time_limit, "WORK_AT_ONCE", 10 * 24 * 5)
    sent = []
    with LammpsChain(
        LJ.replace(potential="harmonic", speed=None, velocity=0.1).problem,
        Numerics(scheme="verlet", timestep=0.01),
        None,
        tmp_path,
    ) as chain:
        send = chain._send
        chain._send = lambda handle, command: (sent.append(command), send(handle, command))
        chain.run(13)
    assert [int(command.split()[1]) for command in sent] == [5, 5, 3]


# The program prints a line when it enters a compiled loop over a million particles.
LARGE = """
import sys
from chaincor.workflows.engines import time_limit

steps_at_once, reported = time_limit.steps_at_once, []

def tell(work):
    if work > 900_000 and not reported:
        reported.append(work)
        print("COMPUTES", flush=True)
    return steps_at_once(work)

time_limit.steps_at_once = tell
from chaincor.workflows.cli import main

main(["run", "--particles", "1000000", "--engine", sys.argv[1], "--most-hours", "1e9"])
"""


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["reference", "lammps"])
def test_a_million_particles_can_be_stopped(engine):
    with subprocess.Popen(
        [sys.executable, "-c", LARGE, engine],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout.readline() == "COMPUTES\n"  # for days, on any machine
        time.sleep(1.0)  # any time within the loop serves
        process.send_signal(signal.SIGTERM)
        # This takes a second or two. A loop that does not return would take far longer.
        try:
            _, err = process.communicate(timeout=HANGS)
        finally:
            process.kill()
    assert process.returncode == 143, err
    assert err.strip().endswith("before the end. Finished results are kept")
