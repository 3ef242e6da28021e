"""Power contact: bodies that overlap by d repel each other with the force K d^q."""

from dataclasses import dataclass
from typing import NamedTuple

from chaincor.lammps_inputs.contacts.contact_law import ContactLaw, is_whole, lammps_number


class PowerContactParameters(NamedTuple):
    """Parameters K and q of the force K d^q."""

    stiffness: float
    exponent: float


def power_force(gap: float, law: PowerContactParameters) -> float:
    """Return the force K d^q of the overlap d = -gap; 0 without overlap."""
    return law.stiffness * (-gap) ** law.exponent if gap < 0.0 else 0.0


def power_curvature(gap: float, law: PowerContactParameters) -> float:
    """Return the stiffness K q d^(q - 1) of the overlap d = -gap; 0 without overlap."""
    return law.stiffness * law.exponent * (-gap) ** (law.exponent - 1.0) if gap < 0.0 else 0.0


@dataclass(frozen=True)
class PowerContact(ContactLaw):
    """Contact with the force K d^q of the overlap d; Hertz's law has q = 3/2."""

    stiffness: float = 1.0  #: K.
    exponent: float = 1.5  #: q.

    name = "power"
    summary = "soft bodies that repel each other with the force K d^q if they overlap by d"
    keys = {"contact_stiffness": "stiffness", "contact_exponent": "exponent"}  # noqa: RUF012
    strength_key = "contact_stiffness"
    named_in_identity = False
    force_kernel = staticmethod(power_force)
    curvature_kernel = staticmethod(power_curvature)

    @property
    def parameters(self) -> PowerContactParameters:
        """Parameters of the kernels."""
        return PowerContactParameters(self.stiffness, self.exponent)

    @property
    def onset(self) -> float | None:  # type: ignore[override]
        """Return q if it is not a whole number, else None."""
        return None if is_whole(self.exponent) else self.exponent

    @property
    def is_hertzian(self) -> bool:
        """Whether q is 3/2."""
        return self.exponent == 1.5

    def energy(self, overlap: float) -> float:
        """Return K d^(q + 1)/(q + 1)."""
        power = self.exponent + 1.0
        return self.stiffness * overlap**power / power

    def overlap(self, energy: float) -> float:
        """Return ((q + 1) E/K)^(1/(q + 1))."""
        power = self.exponent + 1.0
        return float((power * energy / self.stiffness) ** (1.0 / power))

    def lammps_force(self, overlap: str, force: float = 1.0, length: float = 1.0) -> str:
        """Return K d^q; for a negative overlap, the result is 0 unless q is a whole number."""
        power = f"{overlap}^{lammps_number(self.exponent)}"
        if not is_whole(self.exponent):
            power = f"({overlap}>0.0)*abs{power}"
        return f"{lammps_number(force * self.stiffness / length**self.exponent)}*{power}"

    @property
    def description(self) -> str:
        """Description of the law in one line."""
        return (
            f"soft contact: force K d^q of the overlap d, K = {self.stiffness:.6g}, "
            f"q = {self.exponent:.6g}"
        )
