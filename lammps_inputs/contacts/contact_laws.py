"""Contact laws that scenes can name, and their keys in scenes."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.lammps_inputs.contacts.hard import Hard
from chaincor.lammps_inputs.contacts.power import PowerContact
from chaincor.lammps_inputs.number_types import IsNumber, PositiveNumber

ContactName = Literal["hard", "power"]
CONTACT_LAWS: dict[str, type[ContactLaw]] = {law.name: law for law in (Hard, PowerContact)}


class ContactKeys(BaseModel):
    """Fields of a scene for the contact between its bodies."""

    contact: ContactName | None = Field(
        default=None,
        description="hard bodies, or soft ones, which repel with the force K d^q where they "
        "overlap by d [default: hard]",
    )
    contact_stiffness: PositiveNumber | None = Field(
        default=None, description="K of contact power [default: 1]"
    )
    contact_exponent: Annotated[float, Field(ge=1, le=9), IsNumber] | None = Field(
        default=None, description="q of contact power, 1 to 9; 1.5 is Hertz's [default: 1.5]"
    )


CONTACT_KEYS = tuple(key for key in ContactKeys.model_fields if key != "contact")


def laws_with(key: str) -> tuple[str, ...]:
    """Return the names of the laws that have a key."""
    return tuple(name for name, law in CONTACT_LAWS.items() if key in law.keys)


def contact_of(name: str | None, given: Mapping[str, Any]) -> ContactLaw:
    """Return the law with a name, hard for None, with parameters from the keys of a scene."""
    law = CONTACT_LAWS[name or Hard.name]
    known = {law.keys[key]: given[key] for key in law.keys if given.get(key) is not None}
    return law(**known)
