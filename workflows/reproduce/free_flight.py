"""
Follow a chain after its last contact to find its fragments and the forms of its energy.

Two figures beyond the paper use the results; no claim of the paper does.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.modes import kinetic_mode_energies
from chaincor.analysis.pair_theory import compressed_strain
from chaincor.lammps_inputs.arrays import Array
from chaincor.workflows.engines.fragments import Fragments
from chaincor.workflows.engines.reference import bookkeeping
from chaincor.workflows.engines.reference.coarse_run import highest_frequency
from chaincor.workflows.engines.reference.look_ahead import STEP
from chaincor.workflows.engines.reference.moving import Motion, Stepper
from chaincor.workflows.reproduce.measurements import Answer, MeasuredPoint, Measurements

# The unit of times since the last contact is the sound crossing, n - 1 time units. Kinetic energies
# are averaged over this many crossings.
AVERAGED_OVER = 10.0
LAST = 40.0
# Fragments are counted at these times, for the map and for the curves against speed.
MOMENTS = (0.0, 1.0, 10.0, LAST)
SAMPLED = tuple(sorted({*MOMENTS, *(float(f"{t:.3g}") for t in np.geomspace(0.1, LAST, 12))}))


@dataclass(frozen=True)
class FreeFlight:
    """Results for the flight of one chain after its last contact."""

    point: MeasuredPoint  #: Collision of the chain.
    #: Number of fragments at the times `SAMPLED`, of shape (motions, times); -1 after another
    #: contact with the wall. Each motion starts from the final state of one engine. Both states are
    #: right within the error bar, so if the motions differ, the number is undecided.
    pieces: NDArray[np.int64]
    #: Mean kinetic energy of each mode over the first `AVERAGED_OVER` crossings, as a fraction of
    #: the energy at impact, of shape (n,). For any bond, the sum over j >= 1 is the kinetic energy
    #: of all internal motion.
    kinetic: Array
    #: Mean energy of the bonds over the same time. The sum of this energy and of the kinetic
    #: energies with j >= 1 is 1 - eta.
    bonds: float
    separation: float  #: Energy of the relative motion between the fragments at the end.

    @property
    def speed(self) -> float:
        """Impact speed in units of v*."""
        return self.point.speed

    @property
    def vibration(self) -> float:
        """Mean kinetic energy of all internal motion, as a fraction of the energy at impact."""
        return float(np.sum(self.kinetic[1:]))

    @property
    def harmonic(self) -> float:
        """Harmonic energy of the modes j >= 1 at the last contact, over the energy at impact."""
        energies = self.point.answer.arrays["mode_energies"]
        return float(np.sum(energies[1:])) / self.point.energy

    @property
    def is_whole(self) -> bool:
        """Whether the chain stays whole in all motions."""
        return bool(np.max(self.pieces) == 1)

    def pieces_at(self, time: float) -> tuple[int, int]:
        """Return the smallest and the largest number of fragments at a time in valid motions."""
        counts = self.pieces[:, SAMPLED.index(time)]
        known = counts[counts > 0]
        return (int(known.min()), int(known.max())) if known.size else (0, 0)


def free_flights(measured: Measurements) -> tuple[FreeFlight, ...]:
    """Return the flights of the lj chains in the curve of eta against speed, sorted by speed."""
    return tuple(map(fly, measured.select("curves", "lj")))


def fly(point: MeasuredPoint) -> FreeFlight:
    """Follow a chain of at least two particles for `LAST` crossings after its collision."""
    crossing, energy, bond = point.particles - 1.0, point.energy, point.scene.bond
    kinetic, bonds = [], []
    # Energies are sampled about once per time unit, which is three times per period of the fastest
    # mode.
    duration = AVERAGED_OVER * crossing
    for chain in _flight(point, point.answer, np.linspace(0.0, duration, math.ceil(duration) + 1)):
        kinetic.append(kinetic_mode_energies(chain.velocity))
        bonds.append(float(np.sum(bond.energy(chain.strain))))
    # The state of the engine whose result is shown comes first.
    answers = sorted(point.answers, key=lambda answer: answer is not point.answer)
    counts, separation = [[1] * len(SAMPLED) for _ in answers], 0.0
    # A chain stays whole if its energy is too small to break a bond.
    if (point.dissipation + point.error) * energy > bond.dissociation:
        flights = [_break(point, answer) for answer in answers]
        counts = [count for count, _ in flights]
        weights, speeds = flights[0][1].weights, flights[0][1].speeds
        mean = float(weights @ speeds) / float(np.sum(weights))
        separation = float(0.5 * weights @ (speeds - mean) ** 2)
    return FreeFlight(
        point=point,
        pieces=np.array(counts),
        kinetic=np.mean(kinetic, axis=0) / energy,
        bonds=float(np.mean(bonds)) / energy,
        separation=separation / energy,
    )


def _break(point: MeasuredPoint, answer: Answer) -> tuple[list[int], Fragments]:
    """Return the fragment counts at all times, -1 after another contact, and the last fragments."""
    crossing, counts = point.particles - 1.0, []
    for chain in _flight(point, answer, [time * crossing for time in SAMPLED]):
        counts.append(len(_pieces(chain).sizes))
    return counts + [-1] * (len(SAMPLED) - len(counts)), _pieces(chain)


def _pieces(chain: Motion) -> Fragments:
    return chain.bodies()[0].pieces(chain.stepper.bond)


def _flight(point: MeasuredPoint, answer: Answer, times: Iterable[float]) -> Iterator[Motion]:
    """
    Integrate a chain after its last contact with the reference scheme of order 8.

    The generator yields the same chain object at the end of the step that reaches each time. It
    stops early at a contact with the wall or at the limit of a bond.
    """
    bond, arrays = point.scene.bond, answer.arrays
    velocities, strains = arrays["velocities"], np.diff(arrays["displacements"])
    inner = 0.5 * float(np.sum((velocities - np.mean(velocities)) ** 2))
    inner += float(np.sum(bond.energy(strains)))
    # The energy of internal motion limits the compression of bonds. After a fast collision, no bond
    # becomes as short as it was when the chain was at the wall.
    shortest = max(answer.result["bond_min"] - 1.0, compressed_strain(bond, inner))
    line, speed = point.scene.line, point.scene.impact_velocity
    stepper = Stepper.of(line, bond, "order8", STEP / highest_frequency(bond, shortest))
    state = np.append(0.0, strains), np.append(0.0, velocities)
    chain = Motion.in_state(stepper, *state, speed)
    bookkeeping.never_argue(chain.run_state)
    for time in times:
        target_steps = math.ceil(time / stepper.step)
        if target_steps > 0:
            status = chain.advance(target_steps)
            if status != bookkeeping.DONE or chain.run_state["contacts"] > 0:
                return
        yield chain
