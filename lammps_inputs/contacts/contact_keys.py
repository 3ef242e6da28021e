"""Keys of a scene for the contact between its bodies, generated from the contact laws."""

from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, Field, create_model

from chaincor.lammps_inputs.contacts.contact_laws import (
    CONTACT_LAWS,
    CONTACT_PARAMETERS,
    ContactName,
    ContactParameter,
)
from chaincor.lammps_inputs.number_types import IsNumber, PositiveNumber


class _ContactKey(BaseModel):
    """Field of a scene for the name of the contact law."""

    contact: ContactName | None = Field(
        default=None,
        description=", or ".join(law.summary for law in CONTACT_LAWS.values())
        + " [default: hard; for beads, their own force]",
    )


def _field(parameter: ContactParameter) -> tuple[Any, Any]:
    kind: Any = PositiveNumber
    if parameter.least is not None:
        kind = Annotated[float, Field(ge=parameter.least, le=parameter.most), IsNumber]
    return kind | None, Field(default=None, description=parameter.description)


if TYPE_CHECKING:
    ContactKeys = _ContactKey
else:
    ContactKeys = create_model(
        "ContactKeys",
        __base__=_ContactKey,
        **{key: _field(parameter) for key, parameter in CONTACT_PARAMETERS.items()},
    )
    ContactKeys.__doc__ = "Fields of a scene for the contact between its bodies."
