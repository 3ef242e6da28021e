"""Stop LAMMPS near the wall, with a wall fix that exerts no force."""

import numpy as np

from chaincor.lammps_inputs.problem import Problem
from chaincor.lammps_inputs.script import number
from chaincor.workflows.engines.contact_search import PathPoint
from chaincor.workflows.engines.lammps.contact import time_to_zero
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH
from chaincor.workflows.errors import RunError

# The time until particle 1 reaches the wall is predicted from its acceleration. Verlet steps run
# without checks for this fraction of the predicted time. The fraction affects only the cost.
_BLIND_SHARE = 0.9
# The tension is evaluated at these strains. Their unit is the strain at which a bond of stiffness 1
# has all the energy. Between neighbouring strains the tension changes little; `largest_tension`
# doubles the largest tension to cover this change.
_STRAINS = np.geomspace(1e-3, 1e3, 601)


def largest_tension(problem: Problem) -> float:
    """
    Return an upper bound on the tension with which bond 1 pulls particle 1 off the wall.

    The bound is twice the largest U'(s) among stretched bonds that have at most twice the energy of
    the collision. For any motion of the chain, the acceleration of particle 1 stays below this
    bound.
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
    Position near the wall at which LAMMPS stops, if the engine does not check each Verlet step.

    A wall potential ends the run of LAMMPS with an error if a particle is behind its wall. The
    guard is a wall potential with zero depth and nearly zero range, which has no other effect. The
    guard acts on particle 1 only while its group contains the particle. During this time LAMMPS's
    stock wall, if there is one, does not act on the particle, because this wall would reflect
    the particle first.

    The guard stands far enough in front of the wall to catch steps that touch the wall only between
    their ends. If the acceleration is at most a, one end of such a step lies within a h^2/8 of the
    wall. With the stock wall, steps are not examined between their ends.
    """

    def __init__(self, chain: LammpsChain, problem: Problem, reflect: bool) -> None:
        self._chain, h = chain, chain.timestep
        reach = 0.0 if reflect else largest_tension(problem) / 8.0
        self.position = reach * h * h  #: Position at which particle 1 is stopped.
        #: Longest time for which the present acceleration may predict the motion: 1/frequency of
        #: the bonds.
        self.longest = 1.0 / problem.slow_stiffness**0.5
        # Unchecked steps take this fraction of the predicted time. The fraction falls when steps
        # must be undone, and rises again afterwards, because the present acceleration does not
        # predict collisions between stiff particles.
        self._share = 1.0
        # LAMMPS stores the groups of particle 1 as bits; the first bit is the group ``all``.
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
        """Put particle 1 into the group ``all`` and the group of a command; return the bits."""
        self._mask[0] = 1
        self._chain.commands(command)
        return int(self._mask[0])

    def run(self, steps: int) -> bool:
        """
        Take full Verlet steps; return whether all steps ended in front of the guard.

        The result is False if LAMMPS stopped with an error; the state is then invalid.
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
        """Take unchecked steps for the predicted time; return their number, 0 if undone."""
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
        """Return the time until particle 1 reaches the guard at constant acceleration."""
        x, v, a = now
        x -= self.position
        if x > 0.0:
            return time_to_zero(x, v, a)
        # The particle leaves the wall; the position after its first step is known exactly.
        h = self._chain.timestep
        x += h * (v + 0.5 * h * a)
        return h + time_to_zero(x, v + h * a, a) if v > 0.0 and x > 0.0 else 0.0
