"""LAMMPS itself stops where particle 1 comes to the wall: a wall fix that exerts no force."""

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script import number
from chaincor.workflows.engines.contact_search import PathPoint
from chaincor.workflows.engines.lammps.contact import time_to_zero
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH
from chaincor.workflows.errors import RunError

# Verlet steps are taken without asking for the wall for this part of the time in which particle 1
# would come to it with its present acceleration, which decides costs only.
_BLIND_SHARE = 0.9
# Strains at which the tension is looked at, in units of the one that holds all energy in a bond
# of stiffness 1; between two of them it differs by little, and twice the largest is reckoned with.
_STRAINS = np.geomspace(1e-3, 1e3, 601)


def largest_tension(scene: Scene) -> float:
    """
    Return how strongly bond 1 can pull particle 1 off the wall.

    It is twice the largest U'(s) of a stretched bond with no more than twice the energy of the
    collision: the acceleration of particle 1 at most, whatever the chain does.
    """
    energy = MOST_ENERGY_GROWTH * 0.5 * scene.particles * scene.impact_velocity**2
    strains = np.sqrt(2.0 * energy) * _STRAINS
    strains = strains[strains < scene.bond.strain_max]
    with np.errstate(all="ignore"):
        held = np.asarray(scene.bond.energy(strains)) <= energy
        tension = -np.asarray(scene.bond.force(strains))
    return 2.0 * float(np.max(tension, where=held & np.isfinite(tension), initial=0.0))


class WallGuard:
    """
    Takes Verlet steps without asking for the wall, while LAMMPS itself stops at it.

    LAMMPS's wall potentials know no particle behind their wall: they end the run with an error.
    One without depth, of no reach, does nothing else. It sees particle 1 only while its group
    does; meanwhile the stock wall, where it is at work, does not: it would mirror before.

    The guard stands so far in front of the wall that no step can pass by it and come to the wall
    between its ends either: on its parabola, of an acceleration up to a, one of both ends of such
    a step is within a h^2/8 of the wall. Nothing is looked for within steps of the stock wall.
    """

    def __init__(self, chain: LammpsChain, scene: Scene, reflect: bool) -> None:
        self._chain, h = chain, chain.timestep
        reach = 0.0 if reflect else largest_tension(scene) / 8.0
        self.position = reach * h * h  #: Where particle 1 is stopped.
        #: For how long a present acceleration foretells anything: 1/frequency of the bonds.
        self.longest = 1.0 / scene.slow_stiffness**0.5
        # Part of the time that is taken: collisions of sharp bonds, which a present acceleration
        # does not foretell, would otherwise spoil long windows again and again.
        self._share = 1.0
        # The groups of particle 1, a bit each, as LAMMPS keeps them; the first is that of all.
        self._mask = chain.lammps.numpy.extract_atom("mask", nelem=1)
        self._watched = self._groups("group guarded id 1")
        self._unwatched = 1
        if reflect:
            self._unwatched = self._groups(f"group mirrored id 1:{scene.particles}")
            chain.commands("unfix wall\nfix wall mirrored wall/reflect xlo 0.0")
        self._mask[0] = self._unwatched
        chain.commands(
            f"fix guard guarded wall/harmonic xlo {number(self.position)} 0.0 1.0 1e-300\n"
            "run 0 post no"
        )

    def _groups(self, command: str) -> int:
        """Return the groups of particle 1 where it is in that of all, and in one that is made."""
        self._mask[0] = 1
        self._chain.commands(command)
        return int(self._mask[0])

    def run(self, steps: int) -> bool:
        """
        Take full Verlet steps as long as they end clear of the wall.

        False where one ended at the wall or behind it, or failed: the state is then useless.
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
        """Take steps as far as is safe, and back if it was not; return how many, or 0."""
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
        """Return when particle 1 is stopped, were its acceleration to last."""
        x, v, a = now
        x -= self.position
        if x > 0.0:
            return time_to_zero(x, v, a)
        # It leaves the wall: the end of the first step is known exactly.
        h = self._chain.timestep
        x += h * (v + 0.5 * h * a)
        return h + time_to_zero(x, v + h * a, a) if v > 0.0 and x > 0.0 else 0.0
