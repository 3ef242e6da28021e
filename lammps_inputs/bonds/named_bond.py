"""Define the base class of named bonds: titles, keys in scenes, and parameters."""

from typing import Any, ClassVar, TypeVar

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import NoParameters, Potential

# Range of parameters, in which their squares and inverse squares do not overflow.
SMALLEST, LARGEST = 1e-100, 1e100
# Argument of a kernel: one number in compiled loops, an array otherwise.
Strain = TypeVar("Strain", float, Array)


class NamedBond(Potential):
    """Bond that scenes can name."""

    smooth = True
    rounds_alike = True
    title: ClassVar[str]  #: Title of the bond in output.
    #: Keys of the parameters in scenes, with the names of the attributes. Scenes must give the keys
    #: that have no default.
    keys: ClassVar[dict[str, str]] = {}
    #: Example values of the parameters without defaults, by attribute.
    example: ClassVar[dict[str, Any]] = {}
    #: NamedTuple of the parameters that are passed to the kernels.
    parameters_type: ClassVar[Any] = NoParameters
    #: Names in the closure of the kernel, with their formulas as functions of the parameters.
    constants: ClassVar[dict[str, str]] = {}

    @property
    def parameters(self) -> tuple[Any, ...]:  # type: ignore[override]
        """Parameters of the kernels."""
        return self.parameters_type._make(
            float(getattr(self, name)) for name in self.parameters_type._fields
        )

    def as_keys(self) -> dict[str, Any]:
        """Return the parameters."""
        return {key: getattr(self, name) for key, name in self.keys.items()}

    @classmethod
    def needed_keys(cls) -> list[str]:
        """Return the keys of parameters that have no default."""
        return [key for key, name in cls.keys.items() if not hasattr(cls, name)]
