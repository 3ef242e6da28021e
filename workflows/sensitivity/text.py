"""Write the derivatives of eta as text for ``chaincor run --sensitivity``."""

import math

import numpy as np

from chaincor.analysis.showing.numbers import named_lines
from chaincor.lammps_inputs.bonds.named_bond import NamedBond
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.sensitivity.sensitivity import Sensitivity


def describe_sensitivity(found: Sensitivity, scene: Scene) -> str:
    """Describe how much eta changes if one quantity increases by 1 % and all others stay fixed."""
    rows = [("speed", _of(found.velocity, scene.impact_velocity, "v0"))]
    bond = scene.bond
    values = bond.as_keys() if isinstance(bond, NamedBond) else dict(scene.parameters or {})
    for name, slope in found.parameters.items():
        rows.append((name, _of(slope, values[name], name)))
    for key, slope in found.contact.items():
        rows.append((key.replace("_", " "), _of(slope, scene.line.contact.strength, "K")))
    line = scene.line
    bodies = [("masses", found.masses, line.chain_masses)]
    if found.target_masses is not None:
        bodies.append(("target masses", found.target_masses, line.target_masses))
    for name, slopes, masses in bodies:
        i = int(np.argmax(np.abs(slopes * masses)))
        rows.append((name, f"most by particle {i + 1}: {_of(slopes[i], masses[i], 'm')}"))
    what = "the wall" if line.rigid else "the target"
    rows.append((f"place of {what}", f"d eta/d x = {_rounded(found.wall_place, found.error)}"))
    grown = found.amplification
    lost = max(0.0, math.log10(grown)) if grown > 0.0 else 0.0
    what_is_lost = (
        f"relative error of eta divided by relative error of the state: {lost:.1f} digits are lost"
    )
    rows.append((f"amplification {grown:.3g}", what_is_lost))
    rows.append(("rounding", f"gives eta a standard deviation of {found.rounding:.0e}"))
    rows.append(("error", f"at most {found.error:.0e} of the largest derivative"))
    return "\n".join(["what eta depends on", *named_lines(rows)])


def _of(slope: float, value: float, name: str) -> str:
    return f"d eta/d {name} = {slope:+.6g}, {0.01 * slope * value:+.2g} for 1 % more"


def _rounded(slope: float, error: float) -> str:
    return "0" if abs(slope) < max(error, 1e-6) else f"{slope:+.6g}"
