"""Two bodies that leave each other, each seen from a plane between them."""

import math
from typing import NamedTuple

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.line import Line
from chaincor.workflows.engines.end_watch import Body
from chaincor.workflows.engines.pieces import find_pieces

# Each body has this part at least of the way, and of the speed, between both.
_LEAST_SHARE = 0.05


def bodies_of(line: Line, bond: Potential, strains: Array, velocities: Array) -> list[Body]:
    """
    Return the bodies of a line as :class:`EndWatch` looks at them, one or two.

    A wall, and a single particle, only stand before the other body. Two chains are divided by a
    plane in uniform motion that leaves each the more of the way and of the speed the hotter it is.
    `strains` are those of the N - 1 bonds along x, with the gap, `velocities` the N ones along x.
    """
    gap = float(strains[line.gap])
    chain = Body(0.0, strains[line.first :], velocities[line.first :], line.chain_masses)
    target = Body(
        0.0, strains[: line.gap][::-1], -velocities[: line.first][::-1], line.target_masses
    )
    if line.first == 1:
        return [_seen_from(chain, gap, float(target.velocities[0]))]
    if len(chain.velocities) == 1:
        return [_seen_from(target, gap, float(chain.velocities[0]))]
    first, second = (_first_piece(body, bond) for body in (chain, target))
    way = gap + first.displacement + second.displacement
    near = _share(first.width, second.width) * way
    plane = first.speed - _share(first.heat, second.heat) * (first.speed + second.speed)
    return [
        _seen_from(chain, near - first.displacement, -plane),
        _seen_from(target, way - near - second.displacement, plane),
    ]


class _FirstPiece(NamedTuple):
    """What is asked of a body's piece at the contact: where it is, and how it moves inside."""

    displacement: float
    speed: float
    heat: float
    width: float


def _first_piece(body: Body, bond: Potential) -> _FirstPiece:
    pieces = find_pieces(*body[:3], bond, body.masses)
    size, mass = int(pieces.sizes[0]), float(pieces.weights[0])
    energy = max(float(pieces.energies[0]), 0.0) if size > 1 else 0.0
    displacement, speed = float(pieces.displacements[0]), float(pieces.speeds[0])
    return _FirstPiece(displacement, speed, math.sqrt(energy / mass), math.sqrt(energy * size))


def _seen_from(body: Body, distance: float, receding: float) -> Body:
    """Return a body whose first particle is so far from a plane that recedes from it."""
    return body._replace(first_displacement=distance, velocities=body.velocities + receding)


def _share(first: float, second: float) -> float:
    total = first + second
    share = first / total if total > 0.0 else 0.5
    return min(max(share, _LEAST_SHARE), 1.0 - _LEAST_SHARE)
