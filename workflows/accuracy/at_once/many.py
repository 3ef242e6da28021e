"""A tolerance for many collisions of one chain at once, which differ in their initial states."""

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import StepSchemeName
from chaincor.workflows.accuracy.answer import Answer, answer, spread_of
from chaincor.workflows.accuracy.by_in_house import SHARPEST_FIXED
from chaincor.workflows.accuracy.fixed_steps import usual_scheme
from chaincor.workflows.accuracy.goals import decade_within
from chaincor.workflows.accuracy.in_house_runs import relative_velocity, run_in_house
from chaincor.workflows.accuracy.step_guess import STEP_SHARE, usual_step
from chaincor.workflows.accuracy.step_proof import COARSER, proved_error, usual_share
from chaincor.workflows.engines.ending import quiet_time
from chaincor.workflows.engines.in_house.batch.runner import Batch, serves
from chaincor.workflows.engines.in_house.batch.states import (
    ManyRuns,
    StartStates,
    chain_energies,
)
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.rounding import arithmetic_error
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.errors import CostError, RunError

# Sharper goals are met one by one: there what rounding becomes has to be looked at.
SHARPEST_GOAL = 1e-8
# Energy for the most compressed bond of a warm chain, in units of T: decides the first step only.
_HOTTEST_BOND = 5.0
# Steps are those of a ladder of this ratio, so that many are the same.
_STEP_LADDER = 0.8
# First steps are guessed for energies on a ladder of this ratio.
_ENERGY_LADDER = math.log(1.1)
# At twice this step, in units of 1/frequency, orders begin to hold; it decides costs only.
_LARGEST_STEP = 0.33
# Of those that need more, most never converge.
_MOST_REFINEMENTS = 7
# Steps with this error miss less than rounding does: finer ones gain nothing.
_SMALLEST_ERROR = 1e-16
# Rounding may take this part of a goal.
_ROUNDING_SHARE = 0.1


@dataclass(frozen=True)
class MetMany:
    """Many collisions with their error bars."""

    #: Whether the tolerance is met; where it is not, nothing else counts; of shape (samples,).
    met: NDArray[np.bool_]
    #: eta, and the parts of its error bar; of shape (samples,).
    restitution: Array
    step_error: Array  #: See ``restitution``.
    rounding: Array  #: See ``restitution``.
    timesteps: Array  #: H; of shape (samples,).
    contacts: NDArray[np.int64]  #: How many there were; of shape (samples,).
    last_contact_times: Array  #: From the first contact; of shape (samples,).
    proved: NDArray[np.bool_]  #: Whether the end is proved; argued otherwise; of shape (samples,).


class ManyMeetings:
    """
    Meets the tolerance of a scene for many initial states.

    Parameters
    ----------
    scene : Scene
        One of them, which :meth:`serve` takes; bonds, masses and tolerance are those of all.
    alone : bool
        Whether it is the only one, which the stepping engine runs.
    """

    def __init__(self, scene: Scene, alone: bool = False) -> None:
        line, asked = scene.line, scene.asked_tolerance
        assert asked is not None
        self._scene, self._line = scene, line
        self._goal = decade_within(asked)
        self.scheme = usual_scheme(self._goal)
        self._runs = _Alone(scene, self.scheme) if alone else Batch(line, scene.bond, self.scheme)
        self._rungs: dict[int, tuple[int, int]] = {}

    @staticmethod
    def serve(scene: Scene) -> bool:
        """Return whether scenes of this kind are met here; others are met one by one."""
        if scene.engine != "reference" or scene.explicit or scene.temperature is None:
            return False
        asked = scene.asked_tolerance
        assert asked is not None
        return decade_within(asked) >= SHARPEST_GOAL and serves(scene.line, scene.bond)

    def share(self, velocity: float) -> int:
        """Return how many to meet at once, so that progress is seen."""
        return self._runs.share(self._step(max(self._rungs_of(velocity)[0], 0)))

    def stop(self) -> None:
        """Let whoever is in :meth:`meet`, in another thread, leave it at once."""
        self._runs.stopped = True

    def meet(self, starts: StartStates, velocities: Array) -> MetMany:
        """
        Carry collisions out.

        Each is run at H, 2 H and 1.3 H, which prove its error (``step_proof``). It holds what the
        collision makes of rounding, too, which is another one in every run.

        Parameters
        ----------
        starts : StartStates
            Where they begin.
        velocities : ndarray of shape (samples,)
            Impact velocity of each.

        Returns
        -------
        MetMany
            What comes of one does not depend on which others there are.

        Raises
        ------
        RunError
            If it was stopped.
        """
        rungs, last_rungs = np.array([self._rungs_of(v) for v in velocities.tolist()]).T
        floor = self._rounding(starts, velocities)
        found = _nothing(len(starts), floor)
        left = (rungs >= 0) & (floor <= _ROUNDING_SHARE * self._goal)
        tries = np.zeros(len(starts), np.int64)
        order = STEP_SCHEMES[self.scheme].order
        while np.any(left):
            rung = int(np.min(rungs[left]))
            now = np.flatnonzero(left & (rungs == rung))
            step = self._step(rung)
            runs, errors = self._compare(starts.chosen(now), step, velocities[now], floor[now])
            met = errors + floor[now] <= self._goal
            done = now[met]
            found.met[done] = True
            found.restitution[done] = (runs.speeds[met] / velocities[done]) ** 2
            found.step_error[done] = errors[met]
            found.timesteps[done] = step
            found.contacts[done], found.proved[done] = runs.counts[met], runs.proved[met]
            found.last_contact_times[done] = runs.last_contact_times[met]
            tries[now] += 1
            left[now] = ~met & (tries[now] < _MOST_REFINEMENTS) & (rung < last_rungs[now])
            # Late contacts of chains that broke have more to them than a step, and late ends.
            left[now[runs.settled & self._may_come_late(runs) | runs.endless]] = False
            with np.errstate(divide="ignore"):
                wanted = (STEP_SHARE * self._goal / errors) ** (1.0 / order)
            shrink = np.log(np.where(np.isfinite(errors), wanted, 0.5)) / math.log(_STEP_LADDER)
            # What converges late, as it amplifies what steps miss, needs larger strides.
            rungs[now] += np.clip(np.ceil(shrink).astype(np.int64), tries[now], 5 + tries[now])
            rungs = np.minimum(rungs, last_rungs)
        return found

    def _step(self, rung: int) -> float:
        return _LARGEST_STEP / self._scene.fast_stiffness**0.5 * _STEP_LADDER**rung

    def _rungs_of(self, velocity: float) -> tuple[int, int]:
        """Return the first and the last step to try; -1 where bonds are too sharp for any."""
        energy = velocity**2 + _HOTTEST_BOND * (self._scene.temperature or 0.0)
        place = math.ceil(math.log(energy) / _ENERGY_LADDER)
        if place not in self._rungs:
            energy = math.exp(place * _ENERGY_LADDER)
            goals = (STEP_SHARE * self._goal, _SMALLEST_ERROR)
            first, last = (self._rung_at(energy, goal) for goal in goals)
            self._rungs[place] = first, max(first, last)
        return self._rungs[place]

    def _rung_at(self, energy: float, goal: float) -> int:
        scene, bond = self._scene, self._scene.bond
        strain = bond.compressed_strain(energy)
        sharpness = math.sqrt(max(1.0, float(bond.curvature(strain)) / bond.stiffness))
        if sharpness > SHARPEST_FIXED:
            return -1
        step = 0.5 * usual_step(self.scheme, goal / usual_share(self.scheme), scene.fast_stiffness)
        smaller = math.log(step / sharpness / self._step(0)) / math.log(_STEP_LADDER)
        return max(math.ceil(smaller), 0)

    def _rounding(self, starts: StartStates, velocities: Array) -> Array:
        """Return the error of eta due to rounding, as ``engines.rounding`` does."""
        translation = 0.5 * float(np.sum(self._line.chain_masses)) * velocities**2
        heat = np.maximum(chain_energies(self._line, self._scene.bond, starts) / translation, 1.0)
        return np.asarray(arithmetic_error(self._scene.particles, heat))

    def _compare(
        self, starts: StartStates, step: float, velocities: Array, floor: Array
    ) -> tuple[ManyRuns, Array]:
        """Run at three steps; return what the finest gave and what it errs by."""
        fine = self._runs.follow(starts, np.full(len(starts), step))
        errors = np.where(fine.settled & ~self._may_come_late(fine), 0.0, np.inf)
        sound = np.flatnonzero(np.isfinite(errors))
        chosen, of = starts.chosen(sound), fine.chosen(sound)
        if len(sound) == 0:
            return fine, errors
        apart, alike = [], np.ones(len(sound), bool)
        for times in COARSER:
            steps = np.full(len(sound), times * step)
            coarse = self._runs.compare(chosen, steps, of.last_contact_times)
            differences = np.abs(coarse.speeds**2 - of.speeds**2) / velocities[sound] ** 2
            apart.append(np.where(coarse.settled, differences, np.inf))
            alike &= coarse.counts == of.counts
        far, near = apart
        steps = of.lasted / step
        errors[sound], _ = proved_error(self.scheme, steps, far, near, floor[sound], alike)
        return fine, errors

    def _may_come_late(self, runs: ManyRuns) -> NDArray[np.bool_]:
        """Return where no proof speaks against a late contact: one has been waited for longer."""
        # Two contacts were farther apart than the quiet time of an argued end.
        quiet = quiet_time(self._scene.particles, self._scene.slow_stiffness)
        return np.asarray((runs.longest_silences > quiet) & ~runs.proved)


class _Alone:
    """One collision by the stepping engine, told as the rows of a batch are."""

    def __init__(self, scene: Scene, scheme: StepSchemeName) -> None:
        self._scene, self._scheme = scene, scheme
        self.outcomes: dict[float, Outcome] = {}
        self._fine: Outcome | None = None
        self.stopped = False

    def share(self, _step: float) -> int:
        return 1

    def follow(self, _starts: StartStates, steps: Array) -> ManyRuns:
        """Run it to its end; steps that are too large settle nothing."""
        return self._run(float(steps[0]), None)

    def compare(self, _starts: StartStates, steps: Array, _lasts: Array) -> ManyRuns:
        """Run it a little beyond its last contact, known from the run that was followed."""
        return self._run(float(steps[0]), self._fine)

    def _run(self, step: float, known: Outcome | None) -> ManyRuns:
        scene, settled = self._scene, True
        try:
            outcome = run_in_house(scene, self._scheme, step, known)
        except CostError:
            raise
        except RunError:
            return _row(scene, None, settled=False)
        self.outcomes[step] = outcome
        if known is None:
            self._fine, settled = outcome, outcome.ending.kind != "open"
        return _row(scene, outcome, settled)


def _row(scene: Scene, outcome: Outcome | None, settled: bool) -> ManyRuns:
    """Return an outcome, where there is one, as the only row of a batch."""
    no = np.empty(0)
    times, speeds = (no, no) if outcome is None else (outcome.contact_times, outcome.contact_speeds)
    row = {
        "settled": settled,
        "endless": outcome is not None and outcome.ending.kind == "open",
        "endings": outcome and outcome.ending,
        "speeds": math.nan if outcome is None else relative_velocity(scene.line, outcome),
        "contacts": np.array([times, speeds]) if len(times) else np.zeros((2, 1)),
        "counts": len(times),
        "lasted": math.nan if outcome is None else outcome.lasted,
    }
    rest = {f.name: math.nan for f in fields(ManyRuns) if f.name not in row}
    return ManyRuns(**{name: np.array([value]) for name, value in (row | rest).items()})


def meet_alone(scene: Scene) -> Answer | None:
    """
    Meet the tolerance of one scene with the steps, and the bar, that it has among many.

    Parameters
    ----------
    scene : Scene
        Which :meth:`ManyMeetings.serve` takes.

    Returns
    -------
    Answer or None
        None where it is not met so, and more has to be looked at.
    """
    meetings = ManyMeetings(scene, alone=True)
    met = meetings.meet(StartStates.of([scene.line]), np.array([scene.impact_velocity]))
    if not met.met[0]:
        return None
    runs, step, error = meetings._runs, float(met.timesteps[0]), float(met.step_error[0])
    assert isinstance(runs, _Alone)
    fine, coarse = runs.outcomes[step], runs.outcomes[COARSER[0] * step]
    tries = [{"timestep": step, "step_error": error}]
    details = {"choice": {"tries": tries}, "spread": spread_of(scene, fine, coarse)}
    return answer(scene, fine, error, details)


def _nothing(count: int, rounding: Array) -> MetMany:
    """Return room for collisions, none of them met."""
    room = {
        f.name: np.full(count, np.nan)
        for f in fields(MetMany)
        if f.name not in ("met", "contacts", "proved", "rounding")
    }
    return MetMany(
        met=np.zeros(count, bool),
        contacts=np.zeros(count, np.int64),
        proved=np.zeros(count, bool),
        rounding=rounding,
        **room,
    )
