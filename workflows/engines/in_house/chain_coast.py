"""Looking ahead with the stepping engine: a copy of the chain flies on with coarse steps."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.ending import Ending, quiet_time
from chaincor.workflows.engines.in_house.blocks.running import LEAST_ACTIVE
from chaincor.workflows.engines.in_house.chain import Chain, Stepper
from chaincor.workflows.engines.in_house.kernels import Kernels, kernels_for
from chaincor.workflows.engines.in_house.motion import Glide
from chaincor.workflows.engines.interrupts import steps_at_once
from chaincor.workflows.engines.look_ahead import coarse_step, find_end, required_clearance
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.pieces import find_pieces
from chaincor.workflows.engines.schemes import STEP_SCHEMES


class ChainCoast:
    """
    A copy of a chain that flies ahead with coarse steps.

    Parameters
    ----------
    chain : Chain
        In flight; not changed.
    kernels : Kernels
        The loops.
    now : float
        Time since the first contact.
    step : float
        The Verlet step.
    clearance : float
        How near to the wall particle 1 may come.
    ceiling : float
        How far bonds may stretch.

    Attributes
    ----------
    chain : Chain
        The copy.
    time : float
        Time since the first contact.
    """

    def __init__(
        self,
        chain: Chain,
        kernels: Kernels,
        now: float,
        step: float,
        clearance: float,
        ceiling: float,
    ) -> None:
        self.chain, self.time = chain.copy(), now
        self.chain.ledger["strain_ceiling"] = ceiling
        # What has stretched before is looked at again.
        self.chain.ledger["strain_max"] = float(np.max(chain.strain))
        self._kernels, self._step, self._clearance = kernels, step, clearance

    def fly(self, duration: float) -> bool:
        """
        Fly on.

        Parameters
        ----------
        duration : float
            At least so long.

        Returns
        -------
        bool
            False where particle 1 comes nearer to the wall than allowed, or a bond gets longer
            than allowed: the chain is there then.
        """
        steps = max(1, math.ceil(duration / self._step))
        done, most = 0, steps_at_once(len(self.chain.strain))
        for begin in range(0, steps, most):
            part = min(most, steps - begin)
            glide = Glide(part, self._step, self._clearance, begin == 0, begin + part == steps)
            taken = self._kernels.coast(
                self.chain.ledger,
                tuple(self.chain.arrays.now),
                tuple(glide),
                self._kernels.parameters,
            )
            done += taken
            if taken < part:
                break
        self.time += done * self._step
        return bool(done == steps)

    def state(self) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
        """
        Return where the chain is.

        Returns
        -------
        tuple
            Distance of particle 1 from the wall, strains and velocities.
        """
        return float(self.chain.ledger["wall_distance"]), self.chain.strain, self.chain.velocity


# A chain that broke is followed again and again, with so many times the step of the run; more often
# where these motions come to different ends; a long one, which costs the square of its length,
# once, and from its last contact on: nobody knows then what it hinges on, and two motions of one
# that forgets its roundings have not the same contacts before.
_SAMPLES = (0.97, 0.91, 0.83, 0.77)
_MORE_SAMPLES = (0.95, 0.88, 0.8, 0.74)
_MOST_SAMPLED = 400
# A contact that one of a few motions comes to may be harder by this factor in the true one. Like
# the numbers of motions a choice, whose bars `benchmarks.judge.plain` counts.
_HARDER = 1.5
# Motions have come to the same end where the first pieces are alike to this part of v0, and of
# their energy.
_ALIKE = 0.01


class LookAhead:
    """
    Finds out, ahead of an exact run, that no further contact comes.

    A hot chain that broke forgets its initial state within some hundred units of time. Several
    motions from the start, with errors as the run has them, then tell whether these decide on a
    late contact: whether some have one, or come to ends that differ, of which one could bring it.

    Parameters
    ----------
    scene : Scene
        The collision.
    chain : Chain
        The chain, which is not changed but for its count of force evaluations.
    stepper : Stepper
        Its steps: where coarse ones are no cheaper, they are not taken.
    first : callable
        Returns the chain as it was at step zero.
    start : float
        Time of that, since the first contact.

    Attributes
    ----------
    doubt : float
        Largest momentum of contacts that some motions have and others have not, or may have.
    """

    def __init__(
        self,
        scene: Scene,
        chain: Chain,
        stepper: Stepper,
        first: Callable[[], Chain],
        start: float = 0.0,
    ) -> None:
        self._scene, self._chain, self._start = scene, chain, start
        self._stepper, self._kernels = stepper, stepper.kernels
        self._long = scene.particles > _MOST_SAMPLED
        self._quiet = quiet_time(scene.particles, scene.bond.stiffness)
        self.not_before = 0.0
        self.doubt = 0.0
        self._first = first
        # Contacts so far, and the momentum of the next that all other motions came to.
        self._awaited = (0, 0.0)

    def warm_up(self) -> None:
        """Load or compile the loop, which is not integration."""
        ChainCoast(self._chain, self._kernels, 0.0, 1.0, -math.inf, math.inf).fly(0.0)

    def doubt_about(self, ending: Ending) -> Ending:
        """Return the end of the run as what other motions did leaves it."""
        contacts, momentum = self._awaited
        missed = contacts == self._chain.ledger["contacts"]
        return ending.doubted(max(self.doubt, momentum if missed else 0.0))

    def settle(self) -> tuple[ChainCoast, Ending] | None:
        """
        Look ahead from where the chain is.

        Returns
        -------
        tuple of ChainCoast and Ending, or None
            The coarse motion at the end of the collision, and that end; None where another
            contact may come, or a bond may break.
        """
        ledger, scene = self._chain.ledger, self._scene
        now = self._start + float(ledger["steps"] * self._stepper.step)
        last = self._start + float(ledger["last_contact"])
        if now < self.not_before:
            return None
        # What has fallen apart and flown for so long hardly depends on how it is followed.
        if now - last > self._quiet:
            # A longer one takes its own steps on all cores, coarse ones on one.
            longest = scene.particles > LEAST_ACTIVE
            return None if longest else self._sample(now, last)
        clearance = required_clearance(scene, float(ledger["wall_distance"]))
        ceiling = coarse_ceiling(scene.bond)
        coarse = coarse_step(scene.bond, float(ledger["strain_min"]))
        if clearance is None or np.max(self._chain.strain) >= ceiling:
            return None
        if 1.0 / coarse >= self._stepper.scheme.evaluations / self._stepper.step:
            return None
        coast = ChainCoast(self._chain, self._kernels, now, coarse, clearance, ceiling)
        ending = find_end(scene, coast, last)
        if ending is not None:
            return coast, ending
        ledger["evaluations"] = coast.chain.ledger["evaluations"]
        self.not_before = coast.time
        return None

    def keeps_off(self, until: float) -> tuple[bool, float, int]:
        """
        Say whether the chain keeps off the wall until a time from which on that is certain.

        Parameters
        ----------
        until : float
            See ``whole_end``.

        Returns
        -------
        bool, float, int
            Whether; when that was seen, or until when nothing more is known; and the force
            evaluations so far.
        """
        ledger, scene = self._chain.ledger, self._scene
        now = self._start + float(ledger["steps"] * self._stepper.step)
        evaluations = int(ledger["evaluations"])
        if until <= now:
            return True, now, evaluations
        clearance = required_clearance(scene, float(ledger["wall_distance"]))
        if clearance is None:
            return False, now, evaluations
        coarse = coarse_step(scene.bond, float(ledger["strain_min"]))
        ceiling = coarse_ceiling(scene.bond)
        coast = ChainCoast(self._chain, self._kernels, now, coarse, clearance, ceiling)
        return coast.fly(until - now), coast.time, int(coast.chain.ledger["evaluations"])

    def _sample(self, now: float, last: float) -> tuple[ChainCoast, Ending] | None:
        """Follow the chain to its end, first with steps as those of the run, then coarsely."""
        shares = _SAMPLES[:1] if self._long else _SAMPLES
        ends = [self._follow_again(share, now, last) for share in shares]
        settled = [end for end in ends if isinstance(end, tuple)]
        differ = len(settled) == len(ends) and (
            self._long or not self._alike([end for end, _ in settled])
        )
        if differ and not self._long:
            ends += [self._follow_again(share, now, last) for share in _MORE_SAMPLES]
            settled = [end for end in ends if isinstance(end, tuple)]
        met = [_HARDER * end for end in ends if not isinstance(end, tuple)]
        if met and settled:
            # Where they do not agree, the run itself is one motion among many.
            self.doubt = max(self.doubt, *met)
        if met:
            self._awaited = int(self._chain.ledger["contacts"]), max(met)
            self.not_before = math.inf
            return None
        if differ:
            self.doubt = max(self.doubt, *(ending.momentum_at_stake for _, ending in settled))
        return settled[0]

    def _alike(self, coasts: list[ChainCoast]) -> bool:
        """Return whether motions have come to the same end, by their first pieces."""
        bond, v0 = self._scene.bond, self._scene.impact_velocity
        ends = [find_pieces(*coast.state(), bond) for coast in coasts]
        sizes = {int(pieces.sizes[0]) for pieces in ends}
        speeds = [float(pieces.speeds[0]) for pieces in ends]
        energies = [float(pieces.energies[0]) for pieces in ends]
        return (
            len(sizes) == 1
            and max(speeds) - min(speeds) <= _ALIKE * v0
            and max(energies) - min(energies) <= _ALIKE * max(energies)
        )

    def _follow_again(
        self, share: float, now: float, last: float
    ) -> tuple[ChainCoast, Ending] | float:
        """Return the end of one more motion, or the momentum of the contact that it comes to."""
        whole = self._chain
        if self._long and last > self._start:
            chain, begin, contacts = whole.after_last_contact(), last, 1
        else:
            chain = self._first().copy(room=whole.arrays.contacts.shape[1])
            begin, contacts = self._start, int(whole.ledger["contacts"])
        stepper = self._stepper.of_size(share * self._stepper.step)
        chain.ledger["argue_after"] = chain.ledger["patience"] = math.inf
        chain.advance(stepper, math.ceil((now - begin) / stepper.step))
        if chain.ledger["contacts"] != contacts:
            return 2.0 * float(chain.contact_speeds[-1])
        coarse = share * coarse_step(self._scene.bond, float(whole.ledger["strain_min"]))
        coast = ChainCoast(chain, self._kernels, now, coarse, 0.0, math.inf)
        ending = find_end(self._scene, coast, last)
        if ending is None:
            return 2.0 * abs(float(coast.chain.velocity[0]))
        return coast, ending


def coarse_ceiling(bond: Potential) -> float:
    """Strain below which coarse steps tell what exact ones do: no bond comes near to breaking."""
    return bond.convex_strain if math.isfinite(bond.dissociation) else bond.barrier_strain


def bonds_in_flight(scene: Scene, outcome: Outcome, duration: float) -> tuple[float, float]:
    """
    Return how short and long bonds get in free flight after the last contact.

    Parameters
    ----------
    scene : Scene
        At least two particles.
    outcome : Outcome
        Its collision, with the state right after the last contact.
    duration : float
        How long the flight is.

    Returns
    -------
    tuple of float
        Shortest and longest bond, good to some parts in 1e3 of their strains; flight ends early
        where a bond is as no bond may be.
    """
    scheme = STEP_SCHEMES["verlet"]
    chain = Chain.in_flight(scene, scheme, outcome.displacements, outcome.velocities)
    step = coarse_step(scene.bond, outcome.bond_min - 1.0)
    ceiling = float(chain.ledger["strain_ceiling"])
    coast = ChainCoast(chain, kernels_for(scene.bond, scheme), 0.0, step, -math.inf, ceiling)
    coast.fly(duration)
    ledger = coast.chain.ledger
    return 1.0 + float(ledger["strain_min"]), 1.0 + float(ledger["strain_max"])
