"""Stop LAMMPS when particle 1 reaches the wall, by a wall fix that exerts no force."""

import numpy as np

from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.script import number
from chaincor.workflows.engines.contact_search import PathPoint
from chaincor.workflows.engines.lammps.contact import time_to_zero
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH
from chaincor.workflows.errors import RunError

# Verlet steps run without checks for this fraction of the time to the wall, which is predicted from
# the acceleration of particle 1. The fraction affects only the cost.
_BLIND_SHARE = 0.9
# The tension is evaluated at these strains, in units of the strain that holds all energy in a bond
# of stiffness 1. The tension differs little between neighbouring strains, and twice the largest
# value is used.
_STRAINS = np.geomspace(1e-3, 1e3, 601)


def largest_tension(problem: Problem) -> float:
    """
    Return the largest tension with which bond 1 can pull particle 1 off the wall.

    It is twice the largest U'(s) of a stretched bond with at most twice the energy of the
    collision. It bounds the acceleration of particle 1 for any motion of the chain.
    """
    energy = MOST_ENERGY_GROWTH * 0.5 * problem.particles * problem.impact_velocity**2
    strains = np.sqrt(2.0 * energy) * _STRAINS
    strains = strains[strains < problem.bond.strain_max]
    with np.errstate(all="ignore"):
        held = np.asarray(problem.bond.energy(strains)) <= energy
        tension = -np.asarray(problem.bond.force(strains))
    return 2.0 * float(np.max(tension, where=held & np.isfinite(tension), initial=0.0))


class WallGuard:
    """
    Guard of Verlet steps without checks; LAMMPS itself stops when particle 1 reaches the guard.

    LAMMPS's wall potentials end the run with an error if a particle is behind their wall. A wall
    potential of depth zero and no reach does nothing else. It acts on particle 1 only while its
    group contains the particle. During this time the stock wall, if there is one, does not act on
    the particle, because it would reflect it first.

    The guard stands so far in front of the wall that no step can pass it and touch the wall between
    its ends. On the parabola of a step with an acceleration up to a, one end of such a step is
    within a h^2/8 of the wall. Steps with the stock wall are not examined between their ends.
    """

    def __init__(self, chain: LammpsChain, problem: Problem, reflect: bool) -> None:
        self._chain, h = chain, chain.timestep
        reach = 0.0 if reflect else largest_tension(problem) / 8.0
        self.position = reach * h * h  #: Position at which particle 1 is stopped.
        #: Time over which the present acceleration is a prediction: 1/frequency of the bonds.
        self.longest = 1.0 / problem.slow_stiffness**0.5
        # Fraction of the predicted time that is used. The present acceleration does not predict
        # collisions of sharp bonds; without this fraction, long windows would often have to be
        # undone.
        self._share = 1.0
        # Groups of particle 1, one bit each, as LAMMPS stores them; the first bit is the group of
        # all.
        self._mask = chain.lammps.numpy.extract_atom("mask", nelem=1)
        self._watched = self._groups("group guarded id 1")
        self._unwatched = 1
        if reflect:
            self._unwatched = self._groups(f"group mirrored id 1:{problem.particles}")
            chain.commands("unfix wall\nfix wall mirrored wall/reflect xlo 0.0")
        self._mask[0] = self._unwatched
        chain.commands(
            f"fix guard guarded wall/harmonic xlo {number(self.position)} 0.0 1.0 1e-300\n"
            "run 0 post no"
        )

    def _groups(self, command: str) -> int:
        """Return two groups of particle 1: of all particles, and from a command."""
        self._mask[0] = 1
        self._chain.commands(command)
        return int(self._mask[0])

    def run(self, steps: int) -> bool:
        """
        Take full Verlet steps; return whether all of them ended clear of the wall.

        The result is False if a step failed, or ended at or behind the wall; the state is then
        invalid.
        """
        self._mask[0] = self._watched
        try:
            self._chain.run(steps)
        except RunError:
            return False
        finally:
            self._mask[0] = self._unwatched
        return True

    def run_blind(self, now: PathPoint, most: int) -> int:
        """Take the steps that are predicted to be safe, or undo them; return their number."""
        chain = self._chain
        safe = min(self.longest, _BLIND_SHARE * self._time_left(now))
        steps = min(int(self._share * safe / chain.timestep), most)
        if steps < 2:
            if safe >= 2.0 * chain.timestep:
                self._share = min(1.0, 2.0 * self._share)
            return 0
        state = chain.snapshot()
        if self.run(steps):
            self._share = min(1.0, 2.0 * self._share)
            return steps
        self._share *= 0.25
        chain.restore(state)
        return 0

    def _time_left(self, now: PathPoint) -> float:
        """Return the time until particle 1 reaches the guard with constant acceleration."""
        x, v, a = now
        x -= self.position
        if x > 0.0:
            return time_to_zero(x, v, a)
        # The particle leaves the wall, and the end of its first step is known exactly.
        h = self._chain.timestep
        x += h * (v + 0.5 * h * a)
        return h + time_to_zero(x, v + h * a, a) if v > 0.0 and x > 0.0 else 0.0
