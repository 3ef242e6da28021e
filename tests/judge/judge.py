"""
Judge collisions by an independent integrator that continues long after the last contact.

The judge shares no code with the engines and uses no argument for the end. It integrates until 20
times the time of the last contact; each new contact extends this time. It has its own force laws,
integrator, search for contacts and error estimate. The integrator uses Taylor series, or
collocation if a bond is given by functions. The judge runs each motion twice, with different orders
and tolerances. If the two results differ by more than the requested accuracy, it refuses.

    from tests.judge.judge import Law, judge_collision
    judge_collision(Law("lj"), particles=28, velocity=1.47 * 0.128489059895)
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.judge import collocation, steps
from tests.judge.laws import KINDS, Law, UserLaw

Array = NDArray[np.float64]
AnyLaw = Law | UserLaw

# The two runs have these orders and tolerances. The last terms are this small relative to the
# speeds, and the omitted terms are smaller by the ratio of step to radius of convergence, about
# 0.15.
_COARSE = (16, 1e-15)
_FINE = (22, 1e-17)
# These are tolerances of the last terms of collocation. Errors are far smaller if the force is
# smooth.
_COARSE_USER, _FINE_USER = 1e-12, 1e-14
# A bond this close to its dissociation energy holds no pieces together; for lj, this begins at
# length 11.
_UNBOUND = 1e-6
_HITS_AT_ONCE = 4096
_STEPS_AT_ONCE = 20000


class JudgeRefusal(RuntimeError):
    """
    The reason why the judge gives no result.

    Attributes
    ----------
    contacts : tuple of int
        Numbers of contacts of the two runs, if both were completed. An engine with fewer contacts
        than either run has too few.
    """

    def __init__(self, message: str, contacts: tuple[int, ...] = ()):
        super().__init__(message)
        self.contacts = contacts


@dataclass(frozen=True)
class FirstPiece:
    """The piece of the chain next to the wall when the judge stopped."""

    #: Number of particles before the first bond that is too long to hold two pieces together (lj:
    #: length 11).
    particles: int
    velocity: float  #: Mean velocity; if negative, towards the wall, a contact follows.


@dataclass(frozen=True)
class Judgement:
    """Result of the judge."""

    restitution: float  #: (final momentum / initial momentum)^2; nan if the initial momentum is 0.
    #: Differences between the two runs: in restitution, and the largest in a contact time.
    restitution_error: float
    time_error: float  #: See ``restitution_error``.
    contacts: int  #: Number of contacts, including one at the start.
    #: Times of the contacts and incoming speeds of particle 1, of shape (contacts,).
    contact_times: Array
    contact_speeds: Array  #: See ``contact_times``.
    last_contact_time: float  #: nan without a contact.
    horizon: float  #: Time up to which the chain was followed.
    #: Relative change of the energy. The change of the momentum, less the impulse of the wall, is
    #: relative to the momentum of all particles at the root-mean-square speed.
    energy_drift: float
    momentum_drift: float  #: See ``energy_drift``.
    first_piece: FirstPiece  #: Piece of the chain that could still return to the wall.
    steps: int  #: Number of steps of the finer run.
    #: The last state.
    distance: float
    strains: Array  #: See ``distance``.
    velocities: Array  #: See ``distance``.


@dataclass(frozen=True)
class _Run:
    momentum: float
    hits: Array
    time: float
    steps: int
    distance: float
    strains: Array
    lengths: Array
    velocities: Array


def judge_collision(law: AnyLaw, particles: int, velocity: float, **settings) -> Judgement:
    """Judge an unstrained chain that hits the wall at t = 0 with `velocity` > 0."""
    return judge(law, 0.0, np.zeros(particles - 1), np.full(particles, -velocity), **settings)


def judge(
    law: AnyLaw,
    distance: float,
    strains: Array,
    velocities: Array,
    *,
    accuracy: float = 1e-9,
    multiple: float = 20.0,
    least_time: float | None = None,
    most_steps: int = 50_000_000,
) -> Judgement:
    """
    Integrate a chain from any state in two runs, and compare them.

    Parameters
    ----------
    law : Law or UserLaw
        Force law of the bonds.
    distance : float
        Distance of particle 1 from the wall, not negative. Velocities are positive away from the
        wall.
    strains, velocities : array_like of shape (n - 1,) and (n,)
        Strains and velocities of the initial state.
    accuracy : float
        Largest difference allowed in restitution between the two runs; inf if only contacts count.
    multiple : float
        The chain is followed up to this multiple of the time of the last contact.
    least_time : float, optional
        Least time for which the chain is followed; 40 (n + 5) by default.
    most_steps : int
        Largest number of steps of a run.

    Returns
    -------
    Judgement
        Judgement of the finer run.

    Raises
    ------
    JudgeRefusal
        If the runs differ by more than `accuracy` in restitution, or in the number of contacts, or
        if a motion cannot be followed.
    """
    s, v = np.array(strains, dtype=float), np.array(velocities, dtype=float)
    if v.ndim != 1 or s.shape != (v.size - 1,):
        raise ValueError(f"{s.shape} strains, {v.shape} velocities: expected n - 1 and n")
    if not (distance >= 0.0 and np.isfinite(s).all() and np.isfinite(v).all()):
        raise ValueError("expected a finite state in front of the wall")
    least = 40.0 * (v.size + 5.0) if least_time is None else least_time
    start = (law, float(distance), s, v)
    user = isinstance(law, UserLaw)
    coarse = _run(*start, *(0, _COARSE_USER) if user else _COARSE, (multiple, least), most_steps)
    fine = _run(*start, *(0, _FINE_USER) if user else _FINE, (multiple, least), most_steps)
    before = float(v.sum())
    values = [(run.momentum / before) ** 2 if before else np.nan for run in (coarse, fine)]
    counts = (len(coarse.hits), len(fine.hits))
    if counts[0] != counts[1]:
        raise JudgeRefusal(f"{counts[0]} contacts in one run, {counts[1]} in the other", counts)
    difference = abs(values[1] - values[0])
    if accuracy < np.inf and not difference <= accuracy:
        raise JudgeRefusal(
            f"the two runs differ by {difference:.2g}, {accuracy:.2g} was asked", counts
        )
    times, speeds = fine.hits[:, 0].copy(), fine.hits[:, 1].copy()
    energy = _energy(law, s, 1.0 + s, v)
    rest = fine.momentum - before - 2.0 * float(speeds.sum())
    return Judgement(
        restitution=values[1],
        restitution_error=difference,
        time_error=float(np.max(np.abs(fine.hits - coarse.hits)[:, 0], initial=0.0)),
        contacts=len(times),
        contact_times=times,
        contact_speeds=speeds,
        last_contact_time=float(times[-1]) if times.size else np.nan,
        horizon=fine.time,
        energy_drift=_energy(law, fine.strains, fine.lengths, fine.velocities) / energy - 1.0,
        momentum_drift=rest / (2.0 * energy * v.size) ** 0.5,
        first_piece=_first_piece(law, fine),
        steps=fine.steps,
        distance=fine.distance,
        strains=fine.strains,
        velocities=fine.velocities,
    )


def _energy(law: AnyLaw, strains: Array, lengths: Array, velocities: Array) -> float:
    return 0.5 * float(velocities @ velocities) + float(np.sum(law.energy(strains, lengths)))


def _run(law, distance, strains, velocities, order, tolerance, horizon, most_steps) -> _Run:
    s, v = strains.copy(), velocities.copy()
    lengths = 1.0 + s
    if law.name in ("lj", "log") and np.any(lengths <= 0.0):
        raise ValueError(f"{law.name}: expected strains above -1")
    speed = (2.0 * _energy(law, s, lengths, v) / v.size) ** 0.5
    if not speed > 0.0:
        raise ValueError("expected a chain that moves")
    state = np.array([distance, 0.0, 0.1, 0.0, 0.0])
    basis = np.zeros((2, order + 1, order + 1))
    basis[0] = steps.bernstein_basis(order)
    basis[1, :order, :order] = steps.bernstein_basis(order - 1)
    hits, pieces = np.zeros((_HITS_AT_ONCE, 2)), []
    ended = steps.MORE
    while ended == steps.MORE:
        if isinstance(law, UserLaw):
            ended, found = collocation.advance(
                law.force, tolerance, speed, state, s, v, np.array(horizon), hits, _STEPS_AT_ONCE
            )
        else:
            ended, found = steps.advance(
                KINDS[law.name], law.parameter, law.order, order, tolerance, speed, state, lengths,
                s, v, basis, np.array(horizon), hits, _STEPS_AT_ONCE,
            )  # fmt: skip
        pieces.append(hits[:found].copy())
        if float(np.min(law.energy(s, lengths), initial=0.0)) < -0.5 * speed**2 * v.size:
            raise JudgeRefusal(f"a bond runs away over its barrier before t = {state[1]:g}")
        if state[4] > most_steps:
            raise JudgeRefusal(f"not at the horizon after {most_steps} steps, at t = {state[1]:g}")
    if ended == steps.RESTING:
        raise JudgeRefusal(f"particle 1 rests at the wall at t = {state[1]:g}")
    if ended == steps.BROKEN:
        raise JudgeRefusal(f"the motion cannot be followed beyond t = {state[1]:g}")
    return _Run(
        momentum=float(v.sum()),
        hits=np.concatenate(pieces),
        time=float(state[1]),
        steps=int(state[4]),
        distance=float(state[0]),
        strains=s,
        lengths=lengths,
        velocities=v,
    )


def _first_piece(law: AnyLaw, run: _Run) -> FirstPiece:
    energies = law.energy(run.strains, run.lengths)
    broken = energies >= (1.0 - _UNBOUND) * law.dissociation
    size = int(np.argmax(broken)) + 1 if broken.any() else run.velocities.size
    return FirstPiece(size, float(run.velocities[:size].mean()))
