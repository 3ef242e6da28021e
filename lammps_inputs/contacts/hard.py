"""Hard contact: touching bodies exchange momentum instantaneously."""

from dataclasses import dataclass

from chaincor.lammps_inputs.contacts.contact_law import ContactLaw, NoParameters


def no_force(_gap: float, _parameters: NoParameters) -> float:
    """Return 0."""
    return 0.0


@dataclass(frozen=True)
class Hard(ContactLaw):
    """Contact without overlap; velocities change instantaneously when the gap closes."""

    name = "hard"
    summary = "hard bodies"
    soft = False
    force_kernel = staticmethod(no_force)
    curvature_kernel = staticmethod(no_force)

    def energy(self, overlap: float) -> float:
        """Return 0."""
        return 0.0

    def overlap(self, energy: float) -> float:
        """Return 0."""
        return 0.0

    def lammps_force(self, overlap: str, force: float = 1.0, length: float = 1.0) -> str:
        """Return 0."""
        return "0.0"


HARD = Hard()
