"""Build compiled loops over the modes of harmonic bodies."""

import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.contact_search import first_root
from chaincor.workflows.engines.reference.compile import LoopCompiler

# The Taylor series of ``mode_flight`` has this many terms.
TERMS = 26
# `bounce` returns PROVED if it is proved that no further contact comes, and MORE if it must be
# called again because it has done its share of the work.
PROVED, MORE = range(2)

# Largest remainder of the Taylor series of the gap, relative to the sum of the speeds of all modes.
_REST = 1e-19
_FACTORIAL = float(math.factorial(TERMS))
# The proof uses this factor to cover the rounding error of a sum over all modes.
_PROOF_MARGIN = 1.0 + 1e-9
# A contact takes as much time as this number of windows.
_CONTACT_WORK = 2.0

# With _EXACT, the compiler may not change any rounding. With _SUMS, it may sum in any order, so
# that sums can be vectorised.
_EXACT: frozenset[str] = frozenset()
_SUMS = frozenset({"contract", "reassoc"})

# The four arrays are the amplitudes e_j and p_j, the frequencies, and the share of each mode in the
# gap; each is of shape (n,). The first mode is the translation.
Modes = tuple[Array, Array, Array, Array]

# The run state contains the gap, the time since the last contact, and the number of recorded
# contacts.
RUN_STATE: Any = np.dtype(
    (np.record, [("gap", "f8"), ("flown", "f8"), ("contacts", "i8")]),
)


class ModeLoops(NamedTuple):
    """Compiled loops."""

    bounce: Callable  #: Loop from contact to contact, see `build_bounce`.
    rotate: Callable  #: ``rotate(modes, time)`` moves all modes without contacts, in place.
    #: ``taylor_window(modes, gap)``: time for which the series is exact to rounding.
    taylor_window: Callable


@lru_cache(maxsize=1)
def mode_loops() -> ModeLoops:
    """Compile or load the loops, and return them."""
    compiler = LoopCompiler("modes", keep=True)
    bounce = compiler.compile(build_bounce(partial(compiler.register, inline=False)), _EXACT)
    window = compiler.compile(taylor_window, _EXACT)
    loops = ModeLoops(bounce, compiler.compile(rotate), window)
    one, many, path = np.ones(1), np.ones((1, 1)), np.ones(TERMS)
    modes, run_state = (one, one, one, one), np.zeros(1, RUN_STATE)[0]
    loops.bounce(run_state, modes, 1.0, 0.0, (one, one, many, many), (path, np.ones((2, 1))))
    loops.rotate(modes, 0.0)
    loops.taylor_window(modes, 1.0)
    return loops


def expand_path(modes: Modes, gap: float, path: Array, moving: Array) -> None:
    """Write the Taylor coefficients of the gap to `path`; `moving` is scratch of shape (2, n)."""
    strain_modes, velocity_modes, omega, shape = modes
    path[0] = gap
    for j in range(omega.shape[0]):
        moving[0, j] = shape[j] * velocity_modes[j]
        moving[1, j] = -shape[j] * omega[j] * strain_modes[j]
    factorial = 1.0
    for m in range(1, TERMS):
        factorial *= m
        row = (m - 1) % 2
        total = 0.0
        for j in range(omega.shape[0]):
            total += moving[row, j]
            moving[row, j] *= -omega[j] * omega[j]
        path[m] = total / factorial


def rotate(modes: Modes, time: float) -> None:
    """Move all modes without contacts, in place."""
    strain_modes, velocity_modes, omega, _ = modes
    for j in range(omega.shape[0]):
        cosine = np.cos(omega[j] * time)
        sine = np.sin(omega[j] * time)
        strain = strain_modes[j]
        strain_modes[j] = strain * cosine + velocity_modes[j] * sine
        velocity_modes[j] = velocity_modes[j] * cosine - strain * sine


def taylor_window(modes: Modes, gap: float) -> float:
    r"""
    Return the time for which a Taylor series of the gap is exact to rounding.

    With m terms, the remainder is below :math:`\sum_j |c_j| r_j (\omega_j t)^{m - 1} t/m!`. A fast
    mode with a small share in the gap therefore hardly shortens this time.
    """
    strain_modes, velocity_modes, omega, shape = modes
    fastest, total, share = 0.0, 0.0, 0.0
    for j in range(omega.shape[0]):
        fastest = max(fastest, omega[j])
    for j in range(omega.shape[0]):
        speed = abs(shape[j]) * np.hypot(strain_modes[j], velocity_modes[j])
        total += speed
        if omega[j] > 0.0:
            share += speed * (omega[j] / fastest) ** (TERMS - 1)
    if share > 0.0:
        return (_REST * _FACTORIAL * (total / share)) ** (1.0 / (TERMS - 1)) / fastest
    # Bodies that do not vibrate have at most one contact, whose time is known.
    mean_velocity = shape[0] * velocity_modes[0]
    return 2.0 * gap / -mean_velocity if mean_velocity < 0.0 < gap else 1.0


def proof_time(modes: Modes, gap: float) -> float:
    """Return the time after which no contact can come; inf if the bodies do not part."""
    strain_modes, velocity_modes, omega, shape = modes
    mean_velocity = shape[0] * velocity_modes[0]
    if not mean_velocity > 0.0:
        return np.inf
    reach, mean_distance = 0.0, gap
    for j in range(1, omega.shape[0]):
        reach += abs(shape[j]) * np.hypot(strain_modes[j], velocity_modes[j]) / omega[j]
        mean_distance -= shape[j] * strain_modes[j] / omega[j]
    return max((_PROOF_MARGIN * reach - mean_distance) / mean_velocity, 0.0)


def build_bounce(register: Callable) -> Callable:
    """
    Return the loop that moves from contact to contact.

    ``bounce(run_state, modes, exchange, work, record, scratch)`` transfers the momentum `exchange`
    times the closing speed at each contact. It stops after the amount `work` of windows times
    modes, or when the record is full. The record has four arrays: the closing speed of each contact
    and the time since the previous contact, of shape (most,), and e_j and p_j right after each
    contact, of shape (most, n). The scratch arrays are described in `expand_path`. Returns
    ``PROVED`` or ``MORE``.
    """
    exact = partial(register, fastmath=_EXACT)
    expand, turn = register(expand_path, fastmath=_SUMS), register(rotate)
    root_of, window_of, proof_of = map(exact, (first_root, taylor_window, proof_time))

    @exact
    def fly(
        run_state: Any, modes: Modes, window: float, longest: float, scratch: tuple[Array, Array]
    ) -> tuple[float, float]:
        # Move the modes to the next contact, without applying the contact, or by whole windows
        # until `longest`. Return the duration and the rate of the gap; a positive rate means that
        # there was no contact.
        path, moving = scratch
        flown = 0.0
        while flown < longest:
            expand(modes, run_state.gap, path, moving)
            root = root_of(path, window)
            if root >= 0.0:
                turn(modes, root)
                incoming = 0.0
                for j in range(modes[2].shape[0]):
                    incoming += modes[3][j] * modes[1][j]
                run_state.gap = 0.0
                return flown + root, -abs(incoming)
            gap = 0.0
            for m in range(TERMS - 1, -1, -1):
                gap = gap * window + path[m]
            run_state.gap = gap
            turn(modes, window)
            flown += window
        return flown, 1.0

    def bounce(
        run_state: Any,
        modes: Modes,
        exchange: float,
        work: float,
        record: tuple[Array, Array, Array, Array],
        scratch: tuple[Array, Array],
    ) -> int:
        speeds, flights, strain_record, velocity_record = record
        strain_modes, velocity_modes, _, shape = modes
        count = shape.shape[0]
        run_state.contacts = 0
        while run_state.contacts < speeds.shape[0] and work > 0.0:
            window = window_of(modes, run_state.gap)
            proof = proof_of(modes, run_state.gap)
            if proof <= 0.0:
                return PROVED
            longest = min(proof, window * max(work / count, 1.0))
            time, velocity = fly(run_state, modes, window, longest, scratch)
            run_state.flown += time
            work -= count * (time / window + _CONTACT_WORK)
            if velocity > 0.0:
                if time >= proof:
                    return PROVED
                continue
            met = run_state.contacts
            for j in range(count):
                velocity_modes[j] -= exchange * velocity * shape[j]
                strain_record[met, j] = strain_modes[j]
                velocity_record[met, j] = velocity_modes[j]
            speeds[met], flights[met] = -velocity, run_state.flown
            run_state.contacts, run_state.flown = met + 1, 0.0
        return MORE

    return bounce
