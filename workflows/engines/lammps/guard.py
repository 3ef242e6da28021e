"""LAMMPS itself stops where particle 1 comes to the wall: a wall fix that exerts no force."""

from typing import TYPE_CHECKING

import numpy as np

from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script import number
from chaincor.workflows.engines.outcome import MOST_ENERGY_GROWTH

if TYPE_CHECKING:
    from chaincor.workflows.engines.lammps.instance import LammpsChain

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
    Stops a run of LAMMPS at the first step that ends near the wall.

    LAMMPS's wall potentials know no particle behind their wall: they end the run with an error.
    One without depth, of no reach, does nothing else. It sees particle 1 only while its group
    does; meanwhile the stock wall, where it is at work, does not: it would mirror before.

    The guard stands so far in front of the wall that no step can pass by it and come to the wall
    between its ends either: on its parabola, of an acceleration up to a, one of both ends of such
    a step is within a h^2/8 of the wall. Nothing is looked for within steps of the stock wall.
    """

    def __init__(self, chain: "LammpsChain", scene: Scene, reflect: bool, timestep: float) -> None:
        self._chain = chain
        self._reach = 0.0 if reflect else largest_tension(scene) / 8.0
        self.position = 0.0  #: Where particle 1 is stopped.
        # The groups of particle 1, a bit each, as LAMMPS keeps them.
        self._mask = chain.lammps.numpy.extract_atom("mask", nelem=1)
        alone = int(self._mask[0])
        chain.commands(f"group guarded id 1\n{self._fix()}")
        self._on = int(self._mask[0])
        if reflect:
            chain.commands(
                f"group mirrored id 1:{scene.particles}\n"
                "unfix wall\n"
                "fix wall mirrored wall/reflect xlo 0.0"
            )
        self._off = int(self._mask[0]) & ~self._on | alone
        self.watch(False)
        self.stand(timestep)

    def _fix(self) -> str:
        return f"fix guard guarded wall/harmonic xlo {number(self.position)} 0.0 1.0 1e-300"

    def stand(self, timestep: float) -> None:
        """Take the stand that Verlet steps of some length need; LAMMPS is set up anew for it."""
        self.position = self._reach * timestep * timestep
        self._chain.commands(f"unfix guard\n{self._fix()}\nrun 0 post no")

    def watch(self, on: bool) -> None:
        """Begin or cease to watch particle 1."""
        self._mask[0] = self._on if on else self._off
