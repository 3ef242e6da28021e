"""Run many collisions of one chain with a hard wall, each with its own initial state and step."""

import math
import time
from collections.abc import Sequence

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.lammps_inputs.problem import Problem
from chaincor.workflows.engines.end_watch import EndWatch, longest_collision
from chaincor.workflows.engines.ending import Ending
from chaincor.workflows.engines.fragment_bounds import breaking_energy
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.batch.chains import Chains, ManyRuns, StartStates
from chaincor.workflows.engines.reference.batch.lanes import ENDLESS, LANES, MOVING, PROVED, Places
from chaincor.workflows.engines.reference.batch.loop import build_carry
from chaincor.workflows.engines.reference.coarse_run import (
    coarse_ceiling,
    coarse_step,
    required_clearance,
)
from chaincor.workflows.engines.reference.compile import scalar_force
from chaincor.workflows.engines.reference.finish import KNOWN_MARGIN
from chaincor.workflows.engines.reference.motion import build_look_ahead
from chaincor.workflows.engines.reference.moving import Stepper
from chaincor.workflows.engines.reference.stepping import follow_on
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.engines.time_limit import WORK_AT_ONCE, steps_at_once
from chaincor.workflows.engines.whole_end import EndBounds, certain_at, next_look
from chaincor.workflows.errors import RunError

# Chains up to this length run side by side in SIMD lanes. A longer chain fills the vector units
# alone. The limit affects only the cost.
LONGEST_IN_LANES = 90
# A collision usually lasts this many sound crossings.
_USUAL_CROSSINGS = 5.0


def supports(line: Line, bond: Potential) -> bool:
    """Return whether a batch supports the bodies and the bond; it needs a hard, rigid wall."""
    compiled = scalar_force(bond) is not None and len(line.chain_masses) > 1
    return line.at_wall and line.first == 1 and bond.smooth and compiled


class Batch:
    """
    Many collisions of one chain with a hard wall.

    The collisions differ in initial state and time step. :func:`supports` must accept `line`, which
    contains the masses and whether the chains are cold. `scheme` is one of ``schemes``.
    """

    def __init__(self, line: Line, bond: Potential, scheme: str) -> None:
        self._line, self._bond = line, bond
        self._scheme = STEP_SCHEMES[scheme]
        self._stepper = Stepper.of(line, bond, scheme, math.nan)
        loop = self._stepper.kernels.loop
        assert loop is not None, "the bond's force compiles"
        n = self.particles = len(line.chain_masses)
        self._stiffness = bond.stiffness / line.mean_mass
        self._most = steps_at_once(self._scheme.evaluations * n)
        # Chains that are not standard always run in SIMD lanes, because only the loop over lanes
        # can prove their ends.
        self._in_lanes = n <= LONGEST_IN_LANES or not line.is_standard
        if self._in_lanes:
            self._carry_lanes = loop(build_carry, not self._scheme.extrapolated)
        self._many_ahead = loop(build_look_ahead)
        self._bounds: dict[int, EndBounds] = {}
        self.stopped = False  # set by another thread to stop the loop

    def share(self, step: float) -> int:
        """Return a number of collisions to compute together, small enough to show progress."""
        n = self.particles
        duration = _USUAL_CROSSINGS * 2.0 * (n + 10.0) / self._stiffness**0.5
        work = duration / step * self._scheme.evaluations * n
        # With at least 4 * LANES collisions, few lanes are empty towards the end.
        return int(min(max(WORK_AT_ONCE / work, 4 * LANES), 1024))

    def follow(self, starts: StartStates, steps: Array) -> ManyRuns:
        """
        Run collisions to their ends.

        A run is settled if its end is proved, by energy or by separating fragments, or argued;
        other runs stay unsettled. `steps` contains the step H of each collision. The result of a
        collision does not depend on the other collisions. Raises RunError if the batch was stopped.
        """
        group = Chains(self._stepper, starts, steps)
        started = time.perf_counter()
        n, bond, interval = self.particles, self._bond, 1.0 / self._stiffness**0.5
        bounds = self._bounds_of(float(np.max(group.rows.energies)))
        # The centre of mass approaches the wall; therefore a contact must come. The search for the
        # end begins only after the time `approach`.
        approach = 1.5 * group.arrival() + 2.0 * interval
        group.follow_until(approach)
        watches: dict[int, EndWatch] = {}
        # If bonds may break, energy alone proves few ends; therefore the fragments are examined.
        may_break = group.rows.energies >= breaking_energy(bond)
        while np.any(group.rows.statuses == MOVING):
            self._carry(group, bounds)
            times = group.times()
            for s in np.flatnonzero(group.rows.statuses == PROVED).tolist():
                group.end(
                    s, Ending("proved"), float(times[s] - group.rows.run_states["first_contact"][s])
                )
            for s in np.flatnonzero(group.rows.statuses == bookkeeping.DONE).tolist():
                run_state = group.rows.run_states[s]
                now, last = float(times[s]), float(run_state["last_contact"])
                if run_state["contacts"] == 0:
                    group.follow_on(s, now + float(approach[s]))
                    continue
                watch = watches.setdefault(s, EndWatch(n, bond, self._stiffness))
                longest = watch.followed_until(last)
                group.rows.statuses[s] = ENDLESS
                if not may_break[s]:
                    # If no bond can break, either energy alone will prove the end, or there is no
                    # end.
                    if now < longest:
                        group.follow_on(s, longest + 2.0 * interval)
                    continue
                ending = watch.look_at(now, last, group.chain(s).bodies())
                if ending is None:
                    if now <= longest:
                        later = max(watch.next_look(now, last), now + 2.0 * interval)
                        group.follow_on(s, later)
                elif ending.kind == "proved" or (
                    ending.kind == "argued" and ending.momentum_at_stake == 0.0
                ):
                    group.end(s, ending, now - float(run_state["first_contact"]))
        return group.outcomes(time.perf_counter() - started)

    def follow_cold(self, scenes: Sequence[Problem], steps: Array) -> ManyRuns:
        """Run collisions of standard chains; their ends are the same as in single runs."""
        speeds = np.array([problem.impact_velocity for problem in scenes])
        starts = StartStates.cold(speeds, self.particles)
        group = Chains(self._stepper, starts, steps, speeds)
        started = time.perf_counter()
        n, stiffness, run_states = self.particles, self._bond.stiffness, group.rows.run_states
        group.rows.target_steps[:] = np.ceil(longest_collision(n, stiffness, 0.0) / steps) + 1
        while np.any(group.rows.statuses == MOVING):
            self._carry(group, EndBounds.none())
            argued = np.flatnonzero(group.rows.statuses == bookkeeping.ARGUE).tolist()
            seen, times = self._stay_clear(scenes, group, argued), group.times()
            for s in argued:
                if s not in seen:
                    group.rows.statuses[s] = bookkeeping.DONE
                    group.endings[s] = self._follow_alone(scenes[s], group, s)
                    continue
                off, until = seen[s]
                if off:
                    group.end(s, Ending("proved"), until)
                else:
                    now, last = float(times[s]), float(run_states["last_contact"][s])
                    run_states["argue_after"][s] = next_look(now, last, until) - last
                    longest = longest_collision(n, stiffness, last)
                    group.rows.target_steps[s] = math.ceil(longest / steps[s]) + 1
                    group.rows.statuses[s] = MOVING
        return group.outcomes(time.perf_counter() - started)

    def compare(
        self, starts: StartStates, steps: Array, lasts: Array, speeds: Array | None = None
    ) -> ManyRuns:
        """Run collisions until shortly after the times `lasts`, counted from the first contacts."""
        group = Chains(self._stepper, starts, steps, speeds)
        started = time.perf_counter()
        run_states, margin = group.rows.run_states, KNOWN_MARGIN / self._stiffness**0.5
        bookkeeping.never_argue(run_states)
        while np.any(group.rows.statuses == MOVING):
            met = run_states["contacts"] > 0
            untils = np.where(met, run_states["first_contact"] + lasts, group.times()) + margin
            group.rows.target_steps[:] = np.ceil(untils / group.rows.steps) + 1
            self._carry(group, EndBounds.none())
            # Times count from the first contact; therefore a collision continues until its first
            # contact.
            group.rows.statuses[(group.rows.statuses == bookkeeping.DONE) & ~met] = MOVING
        group.durations[:] = group.times() - run_states["first_contact"]
        return group.outcomes(
            time.perf_counter() - started, group.rows.statuses == bookkeeping.DONE
        )

    def _bounds_of(self, largest_energy: float) -> EndBounds:
        """Return the bounds that prove ends of chains with at most this energy."""
        top = EndBounds.rung_above(self._bond, largest_energy)
        if top not in self._bounds:
            self._bounds[top] = EndBounds.of(self._line, self._bond, top)
        return self._bounds[top]

    def _follow_alone(self, problem: Problem, group: Chains, s: int) -> Ending | None:
        """Follow a chain that may break to its end; return None if it needs a single run."""
        chain = group.chain(s)
        # move all bonds, as SIMD lanes do, so that the result is the same
        chain.run_state["active"] = self.particles - 1
        try:
            ending, group.durations[s], evaluations = follow_on(problem, chain)
        except RunError:
            return None  # a single run of this scene will report the error
        chain.run_state["evaluations"] = evaluations
        # If the record of contacts was enlarged, a row has no room for it.
        return ending if chain.arrays.contacts.base is group.rows.contacts else None

    def _carry(self, group: Chains, bounds: EndBounds) -> None:
        """Take steps until the caller must act, or until Python must regain control."""
        if self.stopped:
            raise RunError("the collisions were stopped")
        if self._in_lanes:
            places = Places.of(len(group.rows.steps))
            carried = group.rows, group.lanes, group.near, self._stepper.rule, bounds, places
            self._carry_lanes(*carried, self._most)
            group.make_room()
            return
        for s in np.flatnonzero(group.rows.statuses == MOVING).tolist():
            group.rows.statuses[s] = group.chain(s).advance(int(group.rows.target_steps[s]))

    def _stay_clear(
        self, scenes: Sequence[Problem], group: Chains, argued: Sequence[int]
    ) -> dict[int, tuple[bool, float]]:
        """
        Take look-ahead runs of many chains, as ``LookAhead.stays_clear`` does for one chain.

        Return, for each chain that cannot break, whether it stays off the wall, and the time up to
        which its motion was followed.
        """
        bond, rows, times = self._bond, group.rows, group.times()
        seen: dict[int, tuple[bool, float]] = {}
        ahead: list[tuple[int, float, int, float, float]] = []
        for s in argued:
            run_state, now = rows.run_states[s], float(times[s])
            last, distance = float(run_state["last_contact"]), float(run_state["position"])
            speed, momentum = float(run_state["impact_velocity"]), float(run_state["momentum"])
            certain = certain_at(bond, speed, momentum, distance, rows.strains[s], now, last)
            if certain == math.inf:
                continue
            seen[s] = certain <= now, now
            clearance = required_clearance(scenes[s], distance)
            if certain > now and clearance is not None:
                step = coarse_step(bond, float(run_state["strain_min"]))
                ahead.append((s, now, max(1, math.ceil((certain - now) / step)), step, clearance))
        if ahead:
            chosen, since, counts, steps, clearances = map(np.array, zip(*ahead, strict=True))
            arrays = rows.run_states, rows.strains, rows.velocities
            run_states, strains, velocities = (each[chosen] for each in arrays)
            run_states["strain_ceiling"] = coarse_ceiling(bond)
            run_states["strain_max"] = np.max(strains, axis=1)
            done, parameters = np.zeros(len(chosen), np.int64), self._stepper.rule.parameters
            self._many_ahead(
                run_states, strains, velocities, counts, steps, clearances, done, parameters
            )
            found = zip((done == counts).tolist(), (since + done * steps).tolist(), strict=True)
            seen.update(zip(chosen.tolist(), found, strict=True))
            rows.run_states["evaluations"][chosen] = run_states["evaluations"]
        return seen
