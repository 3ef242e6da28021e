"""Looking ahead with the stepping engine: a copy of the bodies flies on with coarse steps."""

import math
from collections.abc import Callable

import numpy as np

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.end_watch import Body
from chaincor.workflows.engines.ending import Ending, evaporation, quiet_time
from chaincor.workflows.engines.in_house.blocks.running import LEAST_ACTIVE
from chaincor.workflows.engines.in_house.motion import Glide
from chaincor.workflows.engines.in_house.moving import Motion, Stepper
from chaincor.workflows.engines.interrupts import steps_at_once
from chaincor.workflows.engines.look_ahead import coarse_step, find_end, required_clearance
from chaincor.workflows.engines.outcome import Outcome
from chaincor.workflows.engines.pieces import find_pieces


class MotionCoast:
    """
    A copy of bodies in motion that flies ahead with coarse steps.

    Parameters
    ----------
    moving : Motion
        In flight; not changed.
    bond : Potential
        Its bonds.
    stepper : Stepper
        Has the loops.
    now : float
        Time since the first contact.
    step : float
        The Verlet step.
    clearance : float
        How small the gap may get.
    ceiling : float
        How far bonds may stretch.

    Attributes
    ----------
    moving : Motion
        The copy.
    time : float
        Time since the first contact.
    """

    def __init__(
        self,
        moving: Motion,
        bond: Potential,
        stepper: Stepper,
        now: float,
        step: float,
        clearance: float,
        ceiling: float,
    ) -> None:
        self.moving, self.time = moving.copy(), now
        ledger = self.moving.ledger
        ledger["strain_ceiling"] = ceiling
        # What has stretched before is looked at again.
        ledger["strain_max"] = longest_strain(moving)
        self._bond, self._stepper = bond, stepper
        self._step, self._clearance = step, clearance

    def fly(self, duration: float) -> bool:
        """
        Fly on for at least a duration.

        False where the gap gets smaller than allowed, or a bond longer: the bodies are there then.
        """
        steps = max(1, math.ceil(duration / self._step))
        done, most = 0, steps_at_once(len(self.moving.strain))
        for begin in range(0, steps, most):
            part = min(most, steps - begin)
            glide = Glide(part, self._step, self._clearance, begin == 0, begin + part == steps)
            taken = self._stepper.kernels.coast(
                self.moving.ledger,
                tuple(self.moving.arrays.now),
                tuple(glide),
                self._stepper.parameters,
            )
            done += taken
            if taken < part:
                break
        self.time += done * self._step
        return bool(done == steps)

    def bodies(self) -> list[Body]:
        """Return the bodies as the end of a collision looks at them."""
        return self.moving.bodies(self._bond)


def longest_strain(moving: Motion) -> float:
    """Return the largest strain of all bonds, the gap left out."""
    strain = moving.strain
    if not moving.at_wall:
        strain = np.delete(strain, moving.line.gap)
    return float(np.max(strain, initial=-1.0))


# A chain that broke is followed again and again, with so many times the step of the run; more often
# where these motions come to different ends; a long one, which costs the square of its length,
# once, and from its last contact on: it is not known then what it hinges on, and two motions of one
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
    moving : Motion
        The bodies, which are not changed but for their count of force evaluations.
    stepper : Stepper
        Their steps: where coarse ones are no cheaper, they are not taken.
    first : callable
        Returns the bodies as they were at step zero.
    start : float
        Time of that, since the first contact, where that was before.

    Attributes
    ----------
    doubt : float
        Largest momentum of contacts that some motions have and others have not, or may have.
    """

    def __init__(
        self,
        scene: Scene,
        moving: Motion,
        stepper: Stepper,
        first: Callable[[], Motion],
        start: float = 0.0,
    ) -> None:
        self._scene, self._moving, self._start = scene, moving, start
        self._bond, self._stepper = scene.bond, stepper
        self._long = scene.span > _MOST_SAMPLED
        self._quiet = quiet_time(scene.span, scene.slow_stiffness)
        self.not_before = 0.0
        self.doubt = 0.0
        self._first = first
        # Contacts so far, and the momentum of the next that all other motions came to.
        self._awaited = (0, 0.0)

    def _times(self) -> tuple[float, float]:
        """Return the time, and that of the last contact, since the first."""
        ledger = self._moving.ledger
        begun = self._start - float(ledger["first_contact"])
        now = begun + float(ledger["steps"] * self._stepper.step)
        return now, begun + float(ledger["last_contact"])

    def _coarse_step(self) -> float:
        shortest = float(self._moving.ledger["strain_min"])
        return coarse_step(self._bond, shortest, self._scene.line.lightest)

    def _coast(self, now: float, step: float, clearance: float, ceiling: float) -> MotionCoast:
        moving, bond, stepper = self._moving, self._bond, self._stepper
        return MotionCoast(moving, bond, stepper, now, step, clearance, ceiling)

    def warm_up(self) -> None:
        """Load or compile the loop, which is not integration."""
        self._coast(0.0, 1.0, -math.inf, math.inf).fly(0.0)

    def doubt_about(self, ending: Ending) -> Ending:
        """Return the end of the run as what other motions did leaves it."""
        contacts, momentum = self._awaited
        missed = contacts == self._moving.ledger["contacts"]
        return ending.doubted(max(self.doubt, momentum if missed else 0.0))

    def settle(self) -> tuple[MotionCoast, Ending] | None:
        """
        Look ahead from where the chain is.

        Returns the coarse motion at the end of the collision, and that end; None where another
        contact may come, or a bond may break.
        """
        ledger, scene = self._moving.ledger, self._scene
        now, last = self._times()
        if now < self.not_before:
            return None
        # What has fallen apart and flown for so long hardly depends on how it is followed.
        if now - last > self._quiet:
            # A longer one takes its own steps on all cores, coarse ones on one.
            longest = scene.span > LEAST_ACTIVE
            return None if longest else self._sample(now, last)
        clearance = required_clearance(scene, self._moving.gap)
        ceiling = coarse_ceiling(scene.bond)
        coarse = self._coarse_step()
        if clearance is None or longest_strain(self._moving) >= ceiling:
            return None
        if 1.0 / coarse >= self._stepper.scheme.evaluations / self._stepper.step:
            return None
        coast = self._coast(now, coarse, clearance, ceiling)
        ending = find_end(scene, coast, last)
        if ending is not None:
            return coast, ending
        ledger["evaluations"] = coast.moving.ledger["evaluations"]
        self.not_before = coast.time
        return None

    def keeps_off(self, until: float) -> tuple[bool, float, int]:
        """
        Say whether the chain keeps off the wall until a time from which on that is certain.

        Returns whether; when that was seen, or until when nothing more is known; and the force
        evaluations so far. For the time see ``whole_end``.
        """
        ledger, scene = self._moving.ledger, self._scene
        now, _ = self._times()
        evaluations = int(ledger["evaluations"])
        if until <= now:
            return True, now, evaluations
        clearance = required_clearance(scene, self._moving.gap)
        if clearance is None:
            return False, now, evaluations
        coarse = self._coarse_step()
        ceiling = coarse_ceiling(scene.bond)
        coast = self._coast(now, coarse, clearance, ceiling)
        return coast.fly(until - now), coast.time, int(coast.moving.ledger["evaluations"])

    def _sample(self, now: float, last: float) -> tuple[MotionCoast, Ending] | None:
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
        if settled and (met or differ):
            # Where they do not agree, the run itself is one motion among many.
            self._doubt(met + [ending.momentum_at_stake for _, ending in settled])
        if met:
            self._awaited = int(self._moving.ledger["contacts"]), max(met)
            self.not_before = math.inf
            return None
        return settled[0]

    def _doubt(self, momenta: list[float]) -> None:
        """
        Take what contacts may bring that some motions have, or may have, and others have not.

        Which of them have it is chance, and how hard: so what the bodies can throw out as they are
        now, before the motions part, counts as well.
        """
        if max(momenta) > 0.0:
            parted = [
                find_pieces(*b[:3], self._bond, b.masses) for b in self._moving.bodies(self._bond)
            ]
            at_stake = sum(evaporation(pieces, self._bond) for pieces in parted)
            self.doubt = max(self.doubt, at_stake, *momenta)

    def _alike(self, coasts: list[MotionCoast]) -> bool:
        """Return whether motions have come to the same end, by their first pieces."""
        bond, v0 = self._scene.bond, self._scene.impact_velocity

        def agree(bodies: tuple[Body, ...]) -> bool:
            ends = [find_pieces(*body[:3], bond, body.masses) for body in bodies]
            sizes = {int(pieces.sizes[0]) for pieces in ends}
            speeds = [float(pieces.speeds[0]) for pieces in ends]
            energies = [float(pieces.energies[0]) for pieces in ends]
            return (
                len(sizes) == 1
                and max(speeds) - min(speeds) <= _ALIKE * v0
                and max(energies) - min(energies) <= _ALIKE * max(energies)
            )

        return all(map(agree, zip(*(coast.bodies() for coast in coasts), strict=True)))

    def _follow_again(
        self, share: float, now: float, last: float
    ) -> tuple[MotionCoast, Ending] | float:
        """Return the end of one more motion, or the momentum of the contact that it comes to."""
        whole = self._moving
        since = whole.ledger["steps"] * self._stepper.step
        if self._long and whole.ledger["last_contact"] > 0.0:
            moving, contacts, since = whole.after_last_contact(), 1, now - last
        else:
            moving = self._first().copy(room=whole.arrays.contacts.shape[1])
            contacts = int(whole.ledger["contacts"])
        stepper = self._stepper.of_size(share * self._stepper.step)
        moving.ledger["argue_after"] = moving.ledger["argue_first"] = math.inf
        moving.ledger["patience"] = math.inf
        moving.advance(stepper, math.ceil(since / stepper.step))
        if moving.ledger["contacts"] != contacts:
            return 2.0 * self._scene.line.contact_mass * float(moving.contact_speeds[-1])
        coast = MotionCoast(
            moving, self._bond, stepper, now, share * self._coarse_step(), 0.0, math.inf
        )
        ending = find_end(self._scene, coast, last)
        if ending is None:
            return 2.0 * self._scene.line.contact_mass * abs(coast.moving.closing)
        return coast, ending


def coarse_ceiling(bond: Potential) -> float:
    """Strain below which coarse steps tell what exact ones do: no bond comes near to breaking."""
    return bond.convex_strain if math.isfinite(bond.dissociation) else bond.barrier_strain


def bonds_in_flight(scene: Scene, outcome: Outcome, duration: float) -> tuple[float, float]:
    """
    Return how short and long bonds get in free flight for a time after the last contact.

    The `outcome` has the state right after that; there are two particles at least. Good to some
    parts in 1e3 of their strains; flight ends early where a bond is as no bond may be.
    """
    line, bond = scene.line, scene.bond
    target = np.zeros(line.first), np.zeros(line.first)
    if line.targets:
        target = outcome.target_displacements[::-1], outcome.target_velocities[::-1]
    strains = np.diff(np.concatenate((target[0], outcome.displacements)))
    strains[line.gap] = 0.0
    velocities = np.concatenate((target[1], outcome.velocities))
    step = coarse_step(bond, outcome.bond_min - 1.0, line.lightest)
    stepper = Stepper.of(line, bond, "verlet", step)
    moving = Motion.in_state(line, bond, stepper.scheme, strains, velocities, scene.impact_velocity)
    ceiling = float(moving.ledger["strain_ceiling"])
    coast = MotionCoast(moving, bond, stepper, 0.0, step, -math.inf, ceiling)
    coast.fly(duration)
    ledger = coast.moving.ledger
    return 1.0 + float(ledger["strain_min"]), 1.0 + float(ledger["strain_max"])
