"""Base class of bonds with a name: titles, keys in scenes and parameters."""

from typing import Any, ClassVar, TypeVar

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import NoParameters, Potential

# Parameters whose squares and inverse squares floating point can hold.
SMALLEST, LARGEST = 1e-100, 1e100
# Argument of a kernel: one number in compiled loops, otherwise an array.
Strain = TypeVar("Strain", float, Array)


class NamedBond(Potential):
    """Bond with a name."""

    smooth = True
    rounds_alike = True
    title: ClassVar[str]  #: Title of the bond in texts.
    #: Keys in scenes, and what its class calls these parameters; those without default must be
    #: given.
    keys: ClassVar[dict[str, str]] = {}
    #: Parameters for a bond of this kind, by the names of its class, where it has no defaults.
    example: ClassVar[dict[str, Any]] = {}
    #: NamedTuple of the parameters that the kernels take.
    told: ClassVar[Any] = NoParameters
    #: Names that its kernel closes over, as formulas of the parameters.
    constants: ClassVar[dict[str, str]] = {}

    @property
    def parameters(self) -> tuple[Any, ...]:  # type: ignore[override]
        """Parameters of the kernels."""
        return self.told._make(float(getattr(self, name)) for name in self.told._fields)

    def as_keys(self) -> dict[str, Any]:
        """Return the parameters."""
        return {key: getattr(self, name) for key, name in self.keys.items()}

    @classmethod
    def needed_keys(cls) -> list[str]:
        """Return the keys of parameters that have no default."""
        return [key for key, name in cls.keys.items() if not hasattr(cls, name)]
