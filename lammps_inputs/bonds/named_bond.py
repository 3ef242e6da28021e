"""Define the base class of named bonds: their titles, keys in scenes and parameters."""

from typing import Any, ClassVar, TypeVar

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.bonds.potential import NoParameters, Potential

# Parameters lie between these values, so that their squares and inverse squares do not overflow.
SMALLEST, LARGEST = 1e-100, 1e100
# The argument of a kernel is one number in compiled loops, and an array otherwise.
Strain = TypeVar("Strain", float, Array)


class NamedBond(Potential):
    """Bond that scenes can name."""

    smooth = True
    rounds_alike = True
    title: ClassVar[str]  #: Title of the bond in texts.
    #: Keys in scenes, and the names of these parameters in the class. A scene must give keys
    #: without default.
    keys: ClassVar[dict[str, str]] = {}
    #: Example values of the parameters without defaults, by their names in the class.
    example: ClassVar[dict[str, Any]] = {}
    #: NamedTuple of the parameters that the kernels take.
    parameters_type: ClassVar[Any] = NoParameters
    #: Names in the closure of the kernel, with their formulas in the parameters.
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
