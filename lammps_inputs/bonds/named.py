"""Bonds by the names and keys of a scene."""

from functools import cache

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import (
    Harmonic,
    LennardJones,
    Logarithmic,
    Morse,
    Power,
    Toda,
)


@cache
def named_bond(
    name: str,
    toda_b: float | None,
    morse_a: float | None,
    power_order: int | None,
    power_c: float | None,
) -> Potential:
    """Return a shared bond: finding v* takes longer than the rest of making a scene."""
    if name == "toda":
        return Toda() if toda_b is None else Toda(toda_b)
    if name == "morse":
        return Morse() if morse_a is None else Morse(morse_a)
    if name == "power":
        assert power_order is not None
        assert power_c is not None
        return Power(power_order, power_c)
    plain = {"harmonic": Harmonic(), "lj": LennardJones(), "log": Logarithmic()}
    return plain[name]
