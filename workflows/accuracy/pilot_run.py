"""Run the reference engine before LAMMPS, for the data that the LAMMPS run needs."""

from dataclasses import dataclass
from typing import Any

from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.run_files import NO_FILES, RunFiles
from chaincor.lammps_inputs.script_plan import ExpectedEnd
from chaincor.workflows.accuracy.bond_range import bonds_from_start, bonds_to_contact
from chaincor.workflows.accuracy.by_reference import converge, exact_modes
from chaincor.workflows.accuracy.reference_runs import ConvergedRun
from chaincor.workflows.accuracy.solvers import EXACT_MODES
from chaincor.workflows.accuracy.step_guess import frequency_ratio
from chaincor.workflows.engines.end_watch import look_interval
from chaincor.workflows.engines.ending import sound_round_trip
from chaincor.workflows.engines.lammps.kept_script import expected_end
from chaincor.workflows.engines.lammps.lammps_collision import PATIENCE
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.reference.coarse_run import bonds_in_flight
from chaincor.workflows.errors import RunError

# Target error of eta if only the range of bond lengths is needed, which converges much earlier than
# eta.
_SCOUTING_GOAL = 1e-4
# Pilot runs are made only for frequency ratios up to this limit, at which a hundred particles take
# a second. Beyond it, LAMMPS itself reports if its much longer step cannot resolve the bonds.
_SHARPEST = 1e4
# LAMMPS stops some steps after the time of its check for the end. This factor on the time covers
# these steps.
_ASKED_WITHIN = 1.3


@dataclass(frozen=True)
class PilotRun:
    """Data on a collision, from the reference engine, for a later LAMMPS run."""

    reference: ConvergedRun  #: Converged run, with its eta and error, and whether bonds pass kinks.
    #: Length of the shortest bond from the initial state until LAMMPS stops.
    flight_min: float
    flight_max: float  #: Length of the longest bond during the same time.

    @property
    def outcome(self) -> Outcome:
        """Outcome of the run."""
        return self.reference.outcome

    @property
    def end(self) -> ExpectedEnd:
        """Data about the end of the collision, for a script."""
        return expected_end(self.outcome)

    def beside(self, run: Outcome) -> dict[str, Any]:
        """
        Return the data, as a dictionary, for the record of a LAMMPS run.

        The range of bond lengths ends with the last contact of the LAMMPS run, because the
        fragments of a broken chain may have further contacts only in the pilot run. The range is
        None if the contacts of both engines differ.
        """
        known, contacts = self.to_dict(), len(run.contact_times)
        if contacts == len(self.outcome.contact_times):
            return known
        last = float(run.contact_times[-1])
        found = bonds_to_contact(self.outcome, contacts, last)
        shortest, longest = found or (None, None)
        return known | {"bond_min": shortest, "bond_max": longest}

    def to_dict(self) -> dict[str, Any]:
        """Return the data as a dictionary for the record."""
        run, end = self.outcome, self.end
        return {
            "bond_min": run.bond_min,
            "bond_max": run.bond_max,
            "flight_min": self.flight_min,
            "flight_max": self.flight_max,
            "last_contact_time": end.last_contact_time,
            "duration": run.duration,
            "contacts": end.contacts,
            "ending": end.ending,
            "fragments": run.fragments,
            "seconds": self.reference.seconds,
            "timestep": run.timestep,
        }

    def table_range(self) -> tuple[float, float]:
        """
        Return the shortest and longest bond length that a bond table must cover.

        If bonds may have broken, fragments fly apart until LAMMPS checks for the end; the range
        covers this motion.
        """
        problem, longest = self.outcome.problem, self.flight_max
        nearly_broken = problem.bond.energy(longest - 1.0) >= 0.6 * problem.bond.dissociation
        if self.outcome.fragments > 1 or nearly_broken:
            flight = 2.0 * look_interval(problem.longest_body, problem.slow_stiffness)
            longest = 1.0 + 1.2 * (longest - 1.0) + 2.0 * problem.impact_velocity * flight
        return self.flight_min, longest


def pilot_run(
    problem: Problem,
    target_error: float,
    fly_on: float | None = None,
    files: RunFiles = NO_FILES,
) -> PilotRun:
    """
    Return the pilot run of a scene for a target error of eta.

    Bond lengths are examined for the time `fly_on` after the last contact. By default, this time
    ends when LAMMPS has checked for the end, or later if frames are taken for longer. Raises
    RunError as :func:`converge` does.
    """
    return pilot_from_run(converge(problem, target_error), fly_on, files)


def pilot_from_run(
    found: ConvergedRun,
    fly_on: float | None = None,
    files: RunFiles = NO_FILES,
) -> PilotRun:
    """Return the pilot run from a converged run; for `fly_on` see :func:`pilot_run`."""
    outcome, problem = found.outcome, found.outcome.problem
    shortest, longest = bonds_from_start(outcome)
    if problem.longest_body > 1 and problem.bond.is_tabulated:
        if fly_on is None:
            fly_on = _ASKED_WITHIN * PATIENCE / problem.slow_stiffness**0.5
            if files.dump is not None and files.frame_interval is not None:
                fly_on = max(fly_on, sound_round_trip(problem.longest_body, problem.slow_stiffness))
        low, high = bonds_in_flight(outcome, fly_on)
        shortest, longest = min(shortest, low), max(longest, high)
    return PilotRun(found, shortest, longest)


def usual_pilot_run(
    problem: Problem, fly_on: float | None = None, files: RunFiles = NO_FILES
) -> PilotRun | None:
    """Return a pilot run for the range of bond lengths; None if no run is possible."""
    if EXACT_MODES.supports(problem):
        return pilot_from_run(exact_modes(problem), fly_on, files)
    if frequency_ratio(problem) > _SHARPEST:
        return None
    try:
        found = converge(problem, _SCOUTING_GOAL)
    except RunError:
        return None
    return pilot_from_run(found, fly_on, files)
