"""Define the result of one collision, which can be printed, stored and plotted."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chaincor.analysis.atomic_write import write_arrays, written_aside
from chaincor.analysis.observables import OF_RUNS, attributes_section
from chaincor.workflows.json_output import finite
from chaincor.workflows.motion import ResultMotion
from chaincor.workflows.showing.plots import Plots
from chaincor.workflows.showing.table import html_table
from chaincor.workflows.showing.text import describe_shortly

# Arrays are written to NPZ files, not to the JSON object.
ARRAY_FIELDS = tuple(each.name for each in OF_RUNS if each.is_array and not each.rare)
TARGET_ARRAYS = tuple(each.name for each in OF_RUNS if each.is_array and each.rare)
_USUAL = tuple(each.name for each in OF_RUNS if not each.is_array and not each.rare)
_RARE = tuple(each.name for each in OF_RUNS if not each.is_array and each.rare)


@dataclass(frozen=True, repr=False, kw_only=True)
class Collision(ResultMotion):
    r"""
    Result of one collision.

    Lengths, masses and stiffnesses are in units of the natural bond length, the particle mass and
    the bond stiffness. Times count from the first contact. Velocities are positive away from the
    wall; a free target therefore leaves with a negative velocity. The final state and the energies
    are those right after the last contact. Attributes that a scene does not need are None; the JSON
    object omits these attributes. A notebook shows the result as a table, and ``result.plot`` draws
    pictures.

    Examples
    --------
    >>> from chaincor import Scene, collide
    >>> result = collide(Scene(potential="harmonic", particles=3, engine="reference"))
    >>> result.contact_times.round(2), result.scheme, result.to_dict()["tolerance_met"]
    (array([0.  , 2.16, 4.75]), 'modal', True)
    """

    def __repr__(self) -> str:
        return describe_shortly(self)

    def _repr_html_(self) -> str:
        return html_table(self)

    @property
    def plot(self) -> Plots:
        """Pictures of the result: ``world_lines()``, ``spectrum()``, ``energy()`` and others."""
        return Plots(self)

    def to_dict(self) -> dict[str, Any]:
        """Return all fields except arrays, for JSON; None replaces numbers that are not finite."""
        return finite(self.plain())

    def plain(self) -> dict[str, Any]:
        """Return all fields except arrays, including numbers that are not finite."""
        values = vars(self)
        plain = {name: values[name] for name in _USUAL}
        plain |= {name: values[name] for name in _RARE if values[name] is not None}
        plain["error_parts"] = dict(vars(self.error_parts))
        return plain

    def arrays(self) -> dict[str, NDArray[np.float64]]:
        """Return the arrays by field name, including the arrays of a free target."""
        names = ARRAY_FIELDS if self.target_particles is None else (*ARRAY_FIELDS, *TARGET_ARRAYS)
        return {name: getattr(self, name) for name in names}

    def save_arrays(self, path: Path) -> None:
        """Write the arrays to an NPZ file; only a complete file replaces an existing one."""
        with written_aside(Path(path), "arrays") as aside:
            write_arrays(aside, self.arrays())


if Collision.__doc__ is not None:  # python -OO removes docstrings.
    Collision.__doc__ = Collision.__doc__.replace(
        "    Examples\n", attributes_section(OF_RUNS) + "\n    Examples\n", 1
    )
