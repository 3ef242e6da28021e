"""
Enclose a collision: restitution, number of contacts, and proof that no more follow.

Initial data are exact doubles or decimal numbers. The restitution is (V/v0)^2 with the final
velocity V of the centre of mass relative to the wall.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from flint import arb, ctx

from benchmarks.certified.bonds import BONDS, Bond
from benchmarks.certified.contacts import first_contact
from benchmarks.certified.flow import Chain, NotProvedError, State

# Bits of precision that each Taylor term adds with steps of 1/8 of the disc, and bits per decimal
# digit.
_BITS_A_TERM, _BITS_A_DIGIT = 3.0, 3.33


@dataclass(frozen=True)
class Certificate:
    """Proved statements about a collision."""

    restitution: arb  #: Ball that contains eta.
    contacts: int  #: Number of contacts of the first particle with the wall or the target.
    last_contact_time: arb  #: Time of the last contact, from the first contact.
    steps: int  #: Number of Taylor steps in the proof.


def certify(
    potential: str,
    velocity: float,
    masses: Sequence[float],
    *,
    wall_mass: float | None = None,
    digits: int = 100,
    longest: float = 1e4,
) -> Certificate:
    """
    Enclose the collision of a cold chain with a hard wall or a free particle.

    Parameters
    ----------
    potential : str
        "harmonic", "lj", "toda" (b = 10) or "log".
    velocity : float
        Impact speed, an exact double.
    masses : sequence of float
        Masses of the particles, from the wall outward; exact.
    wall_mass : float, optional
        Mass of a free particle in place of the wall; None for a rigid wall.
    digits : int
        Decimal digits of the arithmetic. Each step loses some of them.
    longest : float
        Time after which the proof is abandoned.

    Raises
    ------
    NotProvedError
        If contacts or the end cannot be decided with these digits, or if the chain may break.
    """
    before, ctx.dps = ctx.dps, digits
    try:
        return _certify(potential, velocity, masses, wall_mass, digits, longest)
    finally:
        ctx.dps = before


def _certify(
    potential: str,
    velocity: float,
    masses: Sequence[float],
    wall_mass: float | None,
    digits: int,
    longest: float,
) -> Certificate:
    bond = BONDS[potential]
    chain = Chain(bond, tuple(arb(mass) for mass in masses))
    n = len(masses)
    terms = int(_BITS_A_DIGIT * digits / _BITS_A_TERM) + 1
    # Let w be the relative velocity and mu the reduced mass. A contact changes the velocity of the
    # first particle by -2 mu w/m_1, and that of the wall by 2 mu w/m_w. The frame moves with the
    # wall. In it, the velocities of all other particles change by -2 mu w/m_w.
    reduced = chain.masses[0]
    frame = arb(0)
    if wall_mass is not None:
        reduced = chain.masses[0] * wall_mass / (chain.masses[0] + wall_mass)
        frame = reduced / wall_mass
    state = State(arb(0), (arb(0),) * (n - 1), (arb(-velocity),) * n)
    time = last = arb(0)
    contacts, steps = 0, 0
    leaves = False
    while True:
        if state.velocities[0] < 0 and state.gap == 0:
            meeting = state.velocities[0]
            seen = [speed - 2 * frame * meeting for speed in state.velocities]
            seen[0] = -meeting
            state = State(arb(0), state.strains, tuple(seen))
            contacts, last, leaves = contacts + 1, time, True
        if is_over(chain, state):
            break
        if float(time.mid()) > longest:
            raise NotProvedError(f"not over after a time of {longest:g}")
        step = chain.step(state, terms, longest)
        steps += 1
        contact = first_contact(step, n, leaves=leaves)
        passed = step.length if contact is None else contact
        state = step.state(passed)
        if contact is not None:
            state = State(arb(0), state.strains, state.velocities)
        time, leaves = time + passed, False
    mean = _mean(chain, state.velocities)
    ratio = mean / arb(velocity)
    return Certificate(ratio * ratio, contacts, last, steps)


def _mean(chain: Chain, values: Sequence[arb]) -> arb:
    total = sum(chain.masses, arb(0))
    pairs = zip(chain.masses, values, strict=True)
    return sum((mass * value for mass, value in pairs), arb(0)) / total


def is_over(chain: Chain, state: State) -> bool:
    """
    Return whether the energy excludes further contacts.

    At a contact the centre of mass would be at X = sum_j c_j (1 + s_j), where c_j is the fraction
    of the mass beyond bond j. Each strain is limited, because the energy of a bond cannot exceed
    the internal energy of the chain. Therefore X is limited, too. If the centre of mass is beyond
    the limit and moves away, no contact follows.
    """
    mean = _mean(chain, state.velocities)
    if not mean > 0:
        return False
    beyond = _shares_beyond(chain)
    place = state.gap + sum(
        (share * (1 + strain) for share, strain in zip(beyond, state.strains, strict=True)), arb(0)
    )
    # Squares are written as products, because the library's power of a ball around zero is not
    # finite.
    kinetic = sum(
        (
            mass * (speed - mean) * (speed - mean) / 2
            for mass, speed in zip(chain.masses, state.velocities, strict=True)
        ),
        arb(0),
    )
    energy = kinetic + sum((chain.bond.energy(strain) for strain in state.strains), arb(0))
    longest = _longest_strain(chain.bond, energy)
    return longest is not None and bool(place > sum(beyond, arb(0)) * (1 + longest))


def _shares_beyond(chain: Chain) -> list[arb]:
    total = sum(chain.masses, arb(0))
    return [sum(chain.masses[j:], arb(0)) / total for j in range(1, len(chain.masses))]


def _longest_strain(bond: Bond, energy: arb) -> arb | None:
    """Return a strain s > 0 with U(s) above an energy; None if the bond may break."""
    if bond.breaks_at is not None:
        limit = arb(bond.breaks_at.numerator) / bond.breaks_at.denominator
        if not energy < limit:
            return None
    strain = arb(2) ** -20
    for _ in range(2000):
        if bond.energy(strain) > energy:
            return strain
        strain = (strain * arb(1.02)).mid()
    return None
