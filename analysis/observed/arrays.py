"""Observables of a collision that are arrays: contacts, energies of modes, and final states."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.observed.observable import observable
from chaincor.analysis.observed.of_dumps import of_target

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, repr=False, kw_only=True)
class MeasuredArrays:
    """Observables of a collision that are arrays."""

    contact_times: FloatArray = observable(
        "times of the contacts",
        unit="time",
        shape="(contacts,)",
        run=lambda r: r.outcome.contact_times,
        dump=lambda a: a.contact_times,
    )
    contact_speeds: FloatArray = observable(
        "speeds of particle 1 just before its contacts, relative to a free target's first particle",
        unit="speed",
        shape="(contacts,)",
        run=lambda r: r.outcome.contact_speeds,
        dump=lambda a: a.contact_speeds,
    )
    mode_energies: FloatArray = observable(
        "harmonic energies E_j of the free chain's modes after the last contact; j = 0 is the "
        "translation",
        unit="energy",
        shape="(n,)",
        run=lambda r: r.outcome.mode_energies,
        dump=lambda a: a.mode_energies,
        in_dumps="energies E_j of the modes in the last frame; modes whose frequencies agree to "
        "rounding share their energy equally",
    )
    velocities: FloatArray = observable(
        "velocities after the last contact, positive away from the wall",
        unit="speed",
        shape="(n,)",
        run=lambda r: r.outcome.velocities,
    )
    displacements: FloatArray = observable(
        "displacements u_i = x_i - (i - 1) after the last contact",
        unit="length",
        shape="(n,)",
        run=lambda r: r.outcome.displacements,
    )
    target_mode_energies: FloatArray | None = observable(
        "energies of the free target's modes",
        unit="energy",
        shape="(M,)",
        rare=True,
        shared=True,
        run=lambda r: r.target_mode_energies(),
        dump=of_target("mode_energies", ()),
    )
    target_velocities: FloatArray | None = observable(
        "velocities of the free target from the contact outward",
        unit="speed",
        shape="(M,)",
        rare=True,
        shared=True,
        run=lambda r: r.of_target("velocities"),
    )
    target_displacements: FloatArray | None = observable(
        "displacements of the free target: its particle k is at 1 - k + u_k",
        unit="length",
        shape="(M,)",
        rare=True,
        shared=True,
        run=lambda r: r.of_target("displacements"),
    )
