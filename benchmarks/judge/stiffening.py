"""
Judge bonds that stiffen like powers of the strain, by SciPy's DOP853 in scaled units.

    python -m benchmarks.judge.stiffening [--count 500] [--seed 1] [--most-seconds 120]

The unit of strain is the compression at which two particles stop each other, and the unit of
velocity is v0. In these units, strains and velocities are near 1 for any stiffness. The judge
shares no code with the engines. A run ends if the particles fly apart and no bond has a force, or
after five times the time of the last contact.
"""

import argparse
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor import UserBond
from chaincor.lammps_inputs.errors import ChaincorError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide

Array = NDArray[np.float64]
# Tolerances of pairs of runs. The first pair that agrees within a tenth of the error bar is used.
_TOLERANCES = ((1e-8, 1e-10), (1e-11, 1e-13))
# A run ends at `_MULTIPLE` times the time of the last contact, but not before `_LEAST` times n.
_MULTIPLE, _LEAST = 5.0, 30.0
_MOST_SECONDS = 120.0


@dataclass(frozen=True)
class Case:
    """Chain whose bonds push with k |s| + p c |s|^(p - 1); two-sided bonds also pull."""

    kind: str  #: ``power``, ``formula``, ``two-sided`` or ``one-sided``.
    exponent: float  #: Exponent p of the energy c |s|^p.
    c: float
    rest: float  #: Stiffness k at s = 0.
    particles: int
    velocity: float
    tolerance: float = 1e-6

    def energy(self, strain: Array) -> Array:
        """Return U at some strains."""
        size = self._size(strain)
        return 0.5 * self.rest * size**2 + self.c * size**self.exponent

    def force(self, strain: Array) -> Array:
        """Return -dU/ds at some strains."""
        size = self._size(strain)
        push = self.rest * size + self.exponent * self.c * size ** (self.exponent - 1.0)
        return -np.sign(strain) * push

    def _size(self, strain: Array) -> Array:
        return np.maximum(-strain, 0.0) if self.kind == "one-sided" else np.abs(strain)

    def scene(self) -> Scene:
        """Return the scene; the kind ``power`` has even exponents."""
        fields: dict[str, Any] = {"potential": UserBond(self.energy, self.force)}
        if self.kind == "power":
            fields = {"potential": "power", "power_order": int(self.exponent), "power_c": self.c}
        if self.kind == "formula":
            parameters = {"k": self.rest, "c": self.c}
            energy = f"k*s^2/2+c*s^{int(self.exponent)}"
            fields = {"potential": "formula", "energy": energy, "parameters": parameters}
        return Scene(
            particles=self.particles,
            velocity=self.velocity,
            engine="reference",
            tolerance=self.tolerance,
            **fields,
        )

    def compression(self) -> float:
        """Return the strain at which two particles, each of speed v0, stop each other."""
        low, high = -60.0, 3.0
        for _ in range(200):
            middle = 0.5 * (low + high)
            held = float(self.energy(np.array(-(10.0**middle))))
            low, high = (middle, high) if held < self.velocity**2 else (low, middle)
        return 10.0**low


def judge(case: Case, wanted: float = 0.0) -> tuple[float, float]:
    """
    Return the restitution, and the difference between runs with two tolerances.

    Runs with looser tolerances are sufficient if they agree within `wanted`.
    """
    unit, n = case.compression(), case.particles

    def push(strains: Array) -> Array:
        return case.force(unit * strains) * unit / case.velocity**2

    fine = difference = np.inf
    for pair in _TOLERANCES:
        coarse, fine = (_restitution(push, n, tolerance) for tolerance in pair)
        difference = abs(fine - coarse)
        if difference <= wanted:
            break
    return fine, difference


def _restitution(push: Callable[[Array], Array], n: int, tolerance: float) -> float:
    from scipy.integrate import DOP853
    from scipy.optimize import brentq

    def rates(_time: float, state: Array) -> Array:
        forces, slopes = push(np.diff(state[:n])), np.zeros(2 * n)
        slopes[:n] = state[n:]
        slopes[n : 2 * n - 1] -= forces
        slopes[n + 1 :] += forces
        return slopes

    def solver(start: float, state: Array, end: float) -> Any:
        return DOP853(rates, start, state, end, rtol=tolerance, atol=tolerance)

    now = last = 0.0
    state = np.append(np.zeros(n), np.full(n, -1.0))
    state[n] = 1.0
    motion = solver(now, state, np.inf)
    while True:
        motion.step()
        if motion.status == "failed":
            raise ArithmeticError("the judge cannot follow this motion")
        state, leaving = motion.y, motion.y[n:]
        if state[0] < 0.0:
            begun, path = motion.t_old, motion.dense_output()
            # After a contact the motion begins at the wall. The search therefore begins slightly
            # later.
            first = begun + 1e-9 * (motion.t - begun)
            now = last = brentq(lambda time, path=path: path(time)[0], first, motion.t, xtol=1e-15)
            part = solver(begun, path(begun), now)
            while part.status == "running":
                part.step()
            state = part.y.copy()
            state[0], state[n] = 0.0, abs(state[n])
            motion = solver(now, state, np.inf)
            continue
        free = np.all(push(np.diff(state[:n])) == 0.0)
        apart = free and leaving[0] > 0.0 and np.all(np.diff(leaving) >= 0.0)
        late = motion.t > max(_LEAST * n, _MULTIPLE * last) and leaving.sum() > 0.0
        if apart or late:
            return float(np.mean(leaving) ** 2)


def draw(random: np.random.Generator) -> Case:
    """Draw a bond with an exponent of 1.2 to 12 and any stiffness, and a speed."""
    kinds = ["power", "formula", "two-sided", "one-sided"]
    kind = str(random.choice(kinds, p=[0.4, 0.1, 0.25, 0.25]))
    exponent = float(random.uniform(1.2, 12.0))
    if kind == "power":
        exponent = float(random.choice([4, 6, 8, 10, 12]))
    if kind == "formula":
        exponent = 4.0  # each new formula would be compiled
    velocity = float(10.0 ** random.uniform(-9.0, 1.0))
    compression = float(10.0 ** random.uniform(-6.0, -0.5))
    c = velocity**2 / compression**exponent
    rest = 1.0 if kind == "power" else 0.0
    stiffness = (velocity / compression) ** 2
    if kind == "formula":  # formulas must have a stiffness of at least 1e-8
        rest = max(stiffness * 10.0 ** random.uniform(-6.0, 0.0), 1e-8)
    elif kind != "power" and random.uniform() < 0.5:
        rest = stiffness * 10.0 ** random.uniform(-16.0, 0.0)
    particles = int(random.integers(2, 16))
    return Case(kind, exponent, c, rest, particles, velocity, 10.0 ** random.uniform(-8.0, -4.0))


@contextmanager
def _limit(seconds: float) -> Iterator[None]:
    """Raise ArithmeticError after a time, if the system supports alarms."""
    if not hasattr(signal, "SIGALRM"):
        yield
        return

    def stop(*_: object) -> None:
        raise ArithmeticError(f"no result within {seconds:g} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def try_case(case: Case, most_seconds: float = _MOST_SECONDS) -> tuple[str, str]:
    """Return the verdict on a case, and a line with the results."""
    begun = time.process_time()
    try:
        found = collide(case.scene(), most_seconds=most_seconds)
    except ChaincorError as error:
        return f"refused: {type(error).__name__}", f"{error} {case}"
    seconds = time.process_time() - begun
    try:
        with _limit(2.0 * most_seconds):
            right, error = judge(case, 0.1 * found.restitution_error)
    except ArithmeticError as unsure:
        return "judge unsure", f"{unsure}: {case}"
    off = abs(found.restitution - right)
    text = f"{found.restitution:.10f} +- {found.restitution_error:.1e}, judge {right:.10f} +- "
    text += f"{error:.0e}, {found.scheme}, {found.ending}, {seconds:.1f} s: {case}"
    if error > 1e-4:
        return "judge unsure", text
    held = off <= found.restitution_error + 3.0 * error + 1e-12
    return "inside" if held else "outside", text


def main() -> None:
    """Run the study from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument("--count", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--most-seconds", type=float, default=_MOST_SECONDS)
    given = parser.parse_args()
    random = np.random.default_rng(given.seed)
    verdicts: Counter[str] = Counter()
    for index in range(given.count):
        verdict, text = try_case(draw(random), given.most_seconds)
        verdicts[verdict] += 1
        print(f"{index} {verdict}: {text}", flush=True)
    print(dict(verdicts))
    raise SystemExit(1 if verdicts["outside"] else 0)


if __name__ == "__main__":
    main()
