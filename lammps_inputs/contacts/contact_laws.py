"""Contact laws that scenes can name, and their keys in scenes."""

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

from chaincor.lammps_inputs.contacts.contact_law import ContactLaw
from chaincor.lammps_inputs.contacts.hard import Hard
from chaincor.lammps_inputs.contacts.power import PowerContact

ContactName = Literal["hard", "power"]
CONTACT_LAWS: dict[str, type[ContactLaw]] = {law.name: law for law in (Hard, PowerContact)}


class ContactParameter(NamedTuple):
    """Key in scenes for a parameter of contact laws."""

    description: str  #: Help text of the key.
    least: float | None = None  #: Smallest value; None for any positive number.
    most: float | None = None  #: Largest value; used only if `least` is given.


def laws_with(key: str) -> tuple[str, ...]:
    """Return the names of the laws that have a key."""
    return tuple(name for name, law in CONTACT_LAWS.items() if key in law.keys)


CONTACT_PARAMETERS = {
    key: ContactParameter(f"{symbol} of contact {' and '.join(laws_with(key))}{rest}", *limits)
    for key, symbol, rest, *limits in (
        ("contact_stiffness", "K", " [default: 1]"),
        ("contact_exponent", "q", ", 1 to 9; 1.5 is Hertz's [default: 1.5]", 1.0, 9.0),
    )
}
CONTACT_KEYS = tuple(CONTACT_PARAMETERS)


def contact_of(name: str | None, given: Mapping[str, Any]) -> ContactLaw:
    """Return the named law, or hard for None, with parameters from the keys of a scene."""
    law = CONTACT_LAWS[name or Hard.name]
    known = {law.keys[key]: given[key] for key in law.keys if given.get(key) is not None}
    return law(**known)
