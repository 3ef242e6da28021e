"""The three bonds whose chains are compared, with their speed scale."""

from dataclasses import dataclass

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.reproduce.studies import CURVE_POTENTIALS

_FORMULAS = {
    "lj": "U = (x^(−12) − 2 x^(−6) + 1)/72",
    "toda": "U = (e^(−bs) − 1)/b² + s/b, b = 10",
    "log": "U = s − ln x",
}


@dataclass(frozen=True)
class BondUsed:
    """
    A bond: its name, its energy as a function of its length x = 1 + s, and its scales.

    Attributes
    ----------
    name, formula : str
        Name, and U(x) with U(1) = 0.
    length : float
        x*, the compressed length at which U is twice its harmonic part.
    speed : float
        v* = sqrt(2 U(x*)), in speeds of sound.
    """

    name: str
    formula: str
    length: float
    speed: float


def bonds_used() -> tuple[BondUsed, ...]:
    """Return the bonds in the order of the paper."""
    found = []
    for name in CURVE_POTENTIALS:
        bond = Scene(potential=name, speed=1.0).bond
        assert bond.compressed_root is not None
        assert bond.natural_speed is not None
        found.append(BondUsed(name, _FORMULAS[name], bond.compressed_root, bond.natural_speed))
    return tuple(found)
