"""Check a student's script for the chain: read its five parts, then run it with LAMMPS."""

import html
from dataclasses import dataclass
from pathlib import Path

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import shown
from chaincor.workflows.lessons.script_faults import faults_by_part
from chaincor.workflows.lessons.student_run import faults_of_run, run_script
from chaincor.workflows.lessons.student_script import StudentScript

_RUN = "run by LAMMPS"


@dataclass(frozen=True)
class ScriptReport:
    """Faults in each part of a script; the report is true if there is no fault."""

    #: Faults in each part, in the order of the script. The last part is the run with LAMMPS.
    parts: dict[str, tuple[str, ...]]

    def __bool__(self) -> bool:
        return not any(self.parts.values()) and _RUN in self.parts

    def __repr__(self) -> str:
        said = (
            (name, fault) for name, faults in self.parts.items() for fault in faults or ("right",)
        )
        return "\n".join(f"{name:19} {fault}" for name, fault in said)

    def _repr_html_(self) -> str:
        cells = ((name, "; ".join(faults) or "right") for name, faults in self.parts.items())
        rows = "".join(
            f'<tr><th scope="row">{html.escape(name)}</th><td>{html.escape(said)}</td></tr>'
            for name, said in cells
        )
        return f"<table>{rows}</table>"


def check_script(path: str | Path) -> ScriptReport:
    """
    Find faults in a LAMMPS script that should collide a harmonic chain with a wall.

    First the script is read part by part. If nothing is missing, LAMMPS runs the script in its
    folder, and the motion is compared with the exact collision.

    Parameters
    ----------
    path : str or pathlib.Path
        Path of the script.

    Returns
    -------
    ScriptReport
        Faults in each part as text. The report is true if there is no fault.

    Raises
    ------
    InputError
        If the script cannot be read.
    MissingLibraryError
        If LAMMPS is not installed.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not a text file"
        raise InputError(
            f"the script {shown(str(path))} cannot be read: {reason}. Give the path of a script"
        ) from None
    script = StudentScript.of(text, path.parent)
    parts = faults_by_part(script)
    if not any(parts.values()):
        parts[_RUN] = tuple(faults_of_run(run_script(path), script.data_file()))
    return ScriptReport(parts)
