"""Integrators of other authors for the same collision, and functions to compare them."""

import time
from collections.abc import Callable, Iterable

import numpy as np

from chaincor.lammps_inputs.bonds.potentials import LennardJones, lj_force
from chaincor.lammps_inputs.scene import Scene


def timed(function: Callable[[], object]) -> float:
    """Return the processor time of a call, in seconds."""
    started = time.thread_time()
    function()
    return time.thread_time() - started


def coarsest(
    settings: Iterable[float], error_of: Callable[[float], float], wanted: float
) -> tuple[float, float]:
    """Return the coarsest setting after which all finer settings have at most the wanted error."""
    chosen: tuple[float, float] | None = None
    for setting in settings:
        error = error_of(setting)
        if error > wanted:
            chosen = None
        elif chosen is None:
            chosen = (setting, error)
    if chosen is None:
        raise RuntimeError(f"no setting is within {wanted:g}")
    return chosen


def start_state(scene: Scene) -> np.ndarray:
    """Return displacements and velocities right after the first contact."""
    n, v0 = scene.particles, scene.impact_velocity
    state = np.concatenate((np.zeros(n), np.full(n, -v0)))
    state[n] = v0
    return state


def lj_powers(strain):
    """Return the lj force as two powers, which is the fastest form in heyoka."""
    length = 1.0 + strain
    return (length**-13.0 - length**-7.0) / 6.0


def lj_products(strain):
    """Return the lj force as products of 1/r, as in our loops and in C."""
    return lj_force(strain, LennardJones().parameters)


class HeyokaChain:
    """heyoka's adaptive Taylor integrator in compact mode, with a terminal event at the wall."""

    def __init__(self, scene: Scene, tolerance: float, force_of: Callable = lj_powers) -> None:
        import heyoka as hy

        n = scene.particles
        u = hy.make_vars(*(f"u{i}" for i in range(n)))
        v = hy.make_vars(*(f"v{i}" for i in range(n)))
        force = [force_of(u[i + 1] - u[i]) for i in range(n - 1)]
        zero = hy.expression(0.0)
        push = [(force[i - 1] if i else zero) - (force[i] if i < n - 1 else zero) for i in range(n)]

        def reflect(integrator, _direction):
            integrator.state[n] = abs(integrator.state[n])
            return True

        wall = hy.t_event(u[0], callback=reflect, direction=hy.event_direction.negative)
        self.start = start_state(scene)
        equations = [*zip(u, v, strict=True), *zip(v, push, strict=True)]
        self._integrator = hy.taylor_adaptive(
            equations, self.start, t_events=[wall], tol=tolerance, compact_mode=True
        )

    def run(self, state: np.ndarray, begin: float, end: float) -> np.ndarray:
        """Return the state at the end."""
        self._integrator.time = begin
        self._integrator.state[:] = state
        self._integrator.reset_cooldowns()
        self._integrator.propagate_until(end)
        return self._integrator.state.copy()


class Dop853Chain:
    """SciPy's DOP853 with a terminal event at the wall."""

    def __init__(self, scene: Scene, tolerance: float) -> None:
        self.start = start_state(scene)
        self._tolerance, self._scene = tolerance, scene

    def run(self, state: np.ndarray, begin: float, end: float) -> np.ndarray:
        """Return the state at the end."""
        from scipy.integrate import solve_ivp

        n, tolerance = self._scene.particles, self._tolerance
        rates = np.empty(2 * n)

        def motion(_time, y):
            force = lj_force(np.diff(y[:n]), LennardJones().parameters)
            rates[:n] = y[n:]
            rates[n:] = 0.0
            rates[n:-1] -= force
            rates[n + 1 :] += force
            return rates.copy()

        def wall(_time, y):
            return y[0]

        wall.terminal, wall.direction = True, -1
        now = begin
        while now < end:
            flight = solve_ivp(
                motion, (now, end), state, "DOP853", events=wall, rtol=tolerance,
                atol=tolerance * self._scene.impact_velocity,
            )  # fmt: skip
            now, state = flight.t[-1], flight.y[:, -1]
            if flight.status == 1:
                state[0], state[n] = 0.0, abs(state[n])
        return state
