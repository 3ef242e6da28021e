"""The loops over the modes of harmonic bodies."""

import math
from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.contact_search import first_root
from chaincor.workflows.engines.reference.compile import LoopCompiler

# Terms of the Taylor series, see ``mode_flight``.
TERMS = 26
# Why `bounce` came back: no contact can come, or it has done its share of work.
PROVED, MORE = range(2)

# What the Taylor series of the gap leaves out, relative to the speeds of all modes together.
_REST = 1e-19
_FACTORIAL = float(math.factorial(TERMS))
# More than roundings of the sum over all modes.
_PROOF_MARGIN = 1.0 + 1e-9
# A contact is as much work as so many windows.
_CONTACT_WORK = 2.0

# How roundings may differ from what is written: not at all; sums in any order, which have vectors.
_EXACT: frozenset[str] = frozenset()
_SUMS = frozenset({"contract", "reassoc"})

# e_j and p_j, frequencies, and what each mode has of the gap, each of shape (n,); the first is the
# translation.
Modes = tuple[Array, Array, Array, Array]

# The gap, the time since the last contact, and how many contacts are in the record.
LEDGER: Any = np.dtype(
    (np.record, [("wall_distance", "f8"), ("flown", "f8"), ("contacts", "i8")]),
)


class ModeLoops(NamedTuple):
    """The loops, compiled."""

    bounce: Callable  #: See `build_bounce`.
    rotate: Callable  #: ``rotate(modes, time)``: lets all modes move freely, in place.
    taylor_window: Callable  #: ``taylor_window(modes, wall_distance)``: how long a series holds.


@lru_cache(maxsize=1)
def mode_loops() -> ModeLoops:
    """Return the loops, each compiled or loaded."""
    compiler = LoopCompiler("modes", keep=True)
    bounce = compiler.compile(build_bounce(partial(compiler.register, inline=False)), _EXACT)
    window = compiler.compile(taylor_window, _EXACT)
    loops = ModeLoops(bounce, compiler.compile(rotate), window)
    one, many, path = np.ones(1), np.ones((1, 1)), np.ones(TERMS)
    modes, ledger = (one, one, one, one), np.zeros(1, LEDGER)[0]
    loops.bounce(ledger, modes, 1.0, 0.0, (one, one, many, many), (path, np.ones((2, 1))))
    loops.rotate(modes, 0.0)
    loops.taylor_window(modes, 1.0)
    return loops


def expand_path(modes: Modes, wall_distance: float, path: Array, moving: Array) -> None:
    """Write the Taylor coefficients of the gap; `moving` is scratch of shape (2, n)."""
    strain_modes, velocity_modes, omega, shape = modes
    path[0] = wall_distance
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
    """Let all modes move freely, in place."""
    strain_modes, velocity_modes, omega, _ = modes
    for j in range(omega.shape[0]):
        cosine = np.cos(omega[j] * time)
        sine = np.sin(omega[j] * time)
        strain = strain_modes[j]
        strain_modes[j] = strain * cosine + velocity_modes[j] * sine
        velocity_modes[j] = velocity_modes[j] * cosine - strain * sine


def taylor_window(modes: Modes, wall_distance: float) -> float:
    r"""
    Return how long a Taylor series of the gap holds.

    Its rest is below :math:`\sum_j |c_j| r_j (\omega_j t)^{m - 1} t/m!`, m terms being kept, where
    fast modes count as little as they move the gap.
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
    # Bodies that do not vibrate meet once, at a time that is plain.
    gap_derivatives = shape[0] * velocity_modes[0]
    return 2.0 * wall_distance / -gap_derivatives if gap_derivatives < 0.0 < wall_distance else 1.0


def proof_time(modes: Modes, wall_distance: float) -> float:
    """Return the time from when on no contact can come; inf where the bodies do not part."""
    strain_modes, velocity_modes, omega, shape = modes
    gap_derivatives = shape[0] * velocity_modes[0]
    if not gap_derivatives > 0.0:
        return np.inf
    reach, mean_distance = 0.0, wall_distance
    for j in range(1, omega.shape[0]):
        reach += abs(shape[j]) * np.hypot(strain_modes[j], velocity_modes[j]) / omega[j]
        mean_distance -= shape[j] * strain_modes[j] / omega[j]
    return max((_PROOF_MARGIN * reach - mean_distance) / gap_derivatives, 0.0)


def build_bounce(register: Callable) -> Callable:
    """
    Return the loop that flies from contact to contact.

    ``bounce(ledger, modes, exchange, work, record, scratch)`` exchanges a momentum per speed of
    approach. It stops after so much work, in windows times modes, or where the record is full: of
    how fast each contact closes and the time since the one before, both of shape (most,), and of
    e_j and p_j right after each, of shape (most, n). The scratch is that of `expand_path`. Returns
    ``PROVED`` or ``MORE``.
    """
    exact = partial(register, fastmath=_EXACT)
    expand, turn = register(expand_path, fastmath=_SUMS), register(rotate)
    root_of, window_of, proof_of = map(exact, (first_root, taylor_window, proof_time))

    @exact
    def fly(
        ledger: Any, modes: Modes, window: float, longest: float, scratch: tuple[Array, Array]
    ) -> tuple[float, float]:
        # To the next contact, without what that does to the modes, or for whole windows until
        # `longest`: the time, and the velocity with which the gap opens, positive without contact.
        path, moving = scratch
        flown = 0.0
        while flown < longest:
            expand(modes, ledger.wall_distance, path, moving)
            root = root_of(path, window)
            if root >= 0.0:
                turn(modes, root)
                incoming = 0.0
                for j in range(modes[2].shape[0]):
                    incoming += modes[3][j] * modes[1][j]
                ledger.wall_distance = 0.0
                return flown + root, -abs(incoming)
            wall_distance = 0.0
            for m in range(TERMS - 1, -1, -1):
                wall_distance = wall_distance * window + path[m]
            ledger.wall_distance = wall_distance
            turn(modes, window)
            flown += window
        return flown, 1.0

    def bounce(
        ledger: Any,
        modes: Modes,
        exchange: float,
        work: float,
        record: tuple[Array, Array, Array, Array],
        scratch: tuple[Array, Array],
    ) -> int:
        speeds, flights, strain_record, velocity_record = record
        strain_modes, velocity_modes, _, shape = modes
        count = shape.shape[0]
        ledger.contacts = 0
        while ledger.contacts < speeds.shape[0] and work > 0.0:
            window = window_of(modes, ledger.wall_distance)
            proof = proof_of(modes, ledger.wall_distance)
            if proof <= 0.0:
                return PROVED
            longest = min(proof, window * max(work / count, 1.0))
            time, velocity = fly(ledger, modes, window, longest, scratch)
            ledger.flown += time
            work -= count * (time / window + _CONTACT_WORK)
            if velocity > 0.0:
                if time >= proof:
                    return PROVED
                continue
            met = ledger.contacts
            for j in range(count):
                velocity_modes[j] -= exchange * velocity * shape[j]
                strain_record[met, j] = strain_modes[j]
                velocity_record[met, j] = velocity_modes[j]
            speeds[met], flights[met] = -velocity, ledger.flown
            ledger.contacts, ledger.flown = met + 1, 0.0
        return MORE

    return bounce
