"""Write an analysis as text for ``chaincor analyze``."""

from chaincor.analysis.observables import rows_of
from chaincor.analysis.results import CollisionAnalysis
from chaincor.analysis.showing.numbers import named_lines
from chaincor.lammps_inputs.units.unit_system import UnitSystem


def describe_analysis(analysis: CollisionAnalysis) -> str:
    """Describe the results in a few lines of text, with caveats at the end."""
    notes = [f"note: {caveat}" for caveat in analysis.caveats]
    rows = named_lines(rows_of(analysis, dump=True))
    return "\n".join([analysis.heading, "", *rows, "", *notes])


def describe_in_units(analysis: CollisionAnalysis, units: UnitSystem) -> str:
    """Describe the main results in the user's units."""
    last = analysis.contact_statistics.last_time
    text = f"in units {units.style}: v0 = {analysis.velocity * units.speed:.6g}"
    if last is not None:
        text += f", the last contact at t = {last * units.time:.6g}"
    return f"{text}; lengths x {units.length:g}, times x {units.time:.6g}"
