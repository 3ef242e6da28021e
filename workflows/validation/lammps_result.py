"""Read a user's LAMMPS result from the folder of a job, a dump, or a log with the restitution."""

import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

from chaincor.analysis.dumps.printed import (
    end_of,
    printed_numbers,
    printed_values,
    stopped_with,
)
from chaincor.analysis.dumps.run_commands import RunCommands
from chaincor.analysis.job_folder import find_job
from chaincor.analysis.modes import are_equal
from chaincor.analysis.results import CollisionAnalysis
from chaincor.analysis.step_error import analyze_folder
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import DEFAULT_TOLERANCE, NUMERICS_KEYS, Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.ending import argue_end
from chaincor.workflows.validation.comparison import Validation, compare_contacts, judge_for
from chaincor.workflows.validation.difference_causes import find_cause

_MOST_BYTES = 4_000_000
_HEADS = (b"LAMMPS (", b"Log of LAMMPS")
# A finished log ends with one of these lines.
_ENDED = re.compile(r"^(Total wall time: .*|quit|log\s.*)$", re.MULTILINE)
_ATOMS = re.compile(r"^\s*(?:Created )?(\d+) atoms$", re.MULTILINE)
# Jobs of chaincor print the error of the restitution last. A log without this error is unfinished.
_JOB = re.compile(r"^variable +(restitution|step_error) string ", re.MULTILINE)


@dataclass(frozen=True)
class LammpsResult:
    """Result of a LAMMPS run that was not started by chaincor."""

    source: str  #: File or folder of the result, for messages.
    #: Scene, from ``scene.toml`` beside the result or from other files of the run; None if unknown.
    scene: Scene | None
    restitution: float  #: Restitution eta.
    restitution_error: float | None  #: Error of eta; None if unknown.
    contacts: int | None  #: Number of contacts; None if unknown.
    data_error: float = 0.0  #: Error of eta due to the number of digits in a dump.
    particles: int | None = None  #: Number of particles in both bodies; None if unknown.
    stock_wall: bool = False  #: Whether the run had LAMMPS's ``fix wall/reflect``.
    timestep: float | None = None  #: Time step in units of the chain.


def is_lammps_result(against: str | None) -> bool:
    """
    Return whether ``--against`` names a LAMMPS result.

    A LAMMPS result is a folder, or a file that is neither CSV nor NPZ nor a module.
    """
    if against is None:
        return False
    path = Path(against)
    return path.suffix.lower() not in (".csv", ".npz", ".py") and (path.is_dir() or path.is_file())


def read_lammps_result(path: Path | str) -> LammpsResult:
    """
    Read a LAMMPS result from the folder of a job, a dump, or a log.

    A dump is analysed as by ``chaincor analyze``. If a folder has no dump, it must contain
    ``log.lammps``. A log must come from a single finished run, and have a line ``restitution =
    NUMBER``. Lines with ``restitution_error`` and ``contacts`` are optional. Raise InputError if
    there is no such result.
    """
    path = Path(path)
    folder = path if path.is_dir() else path.parent
    beside = folder / "scene.toml"
    scene = Scene.from_file(beside) if beside.is_file() else None
    if path.is_dir() and not _has_dump(path) and (path / "log.lammps").is_file():
        path = path / "log.lammps"
    if path.is_file():
        found = _read_log(path, scene)
        if found is not None:
            return found
    dump = None if path.is_dir() else path
    analysis = analyze_folder(folder, dump=dump, end_argument=argue_end)
    job = analysis.job
    assert job is not None
    return LammpsResult(
        str(path),
        scene or _scene_of_analysis(analysis),
        analysis.restitution,
        analysis.restitution_error,
        analysis.contacts,
        analysis.data_error,
        analysis.particles + analysis.target_particles,
        job.commands.stock_wall,
        job.step,
    )


def _scene_of_analysis(analysis: CollisionAnalysis) -> Scene | None:
    """Return the scene of a run if its script shows that the bonds are harmonic springs."""
    if analysis.bond is None or not analysis.bond.is_harmonic or analysis.target is not None:
        return None
    alike = are_equal(analysis.masses)
    masses = None if alike else tuple(map(float, analysis.masses))
    return Scene(
        potential="harmonic",
        particles=analysis.particles,
        velocity=analysis.velocity,
        masses=masses,
    )


def validate_result(scene: Scene, found: LammpsResult) -> Validation:
    """
    Compare a user's LAMMPS result with the reference engine.

    If the result has no error bar, the allowed difference in eta is the larger of two numbers: the
    scene's tolerance (by default 1e-6), and the error due to the digits of the dump. Raise
    InputError if the numbers of particles differ.
    """
    if found.particles not in (None, scene.problem.all_particles):
        raise InputError(
            f"{found.source} has {found.particles} particles, but the scene has "
            f"{scene.problem.all_particles}. Give the scene of that run: its SCENE.toml, or "
            f"--particles {found.particles} and its other options"
        )
    asked = scene.tolerance or DEFAULT_TOLERANCE
    judge = judge_for(scene, asked)
    known = found.restitution_error
    error = max(asked, found.data_error) if known is None else known
    others = [] if found.contacts is None else [compare_contacts(found.contacts, judge)]
    subject = f"LAMMPS, read from {found.source}"
    validation = Validation.of(scene, subject, found.restitution, error, judge, others)
    first = validation.comparisons[0]
    if first.agrees:
        return validation
    note = _of_stock_wall(scene, found, first.difference)
    allowed = first.allowed or asked
    cause = find_cause(scene, judge, found.restitution, allowed, contacts=found.contacts)
    if cause is not None and (note is None or "explains the difference" not in note):
        note = f"likely cause: {cause}"
    return replace(validation, note=note)


def _of_stock_wall(scene: Scene, found: LammpsResult, difference: float) -> str | None:
    """Describe whether the stock wall, at the time step of a run, explains a difference."""
    if not found.stock_wall:
        return None
    usual = "the run used fix wall/reflect, whose error is of first order in the step"
    if found.timestep is None or scene.line.soft or not scene.line.rigid:
        return f"{usual}; the step is unknown, so the size of this error is unknown, too"
    own = scene.without("tolerance", *NUMERICS_KEYS)
    bare = own.replace(engine="lammps", wall="reflect", scheme="verlet", timestep=found.timestep)
    bar = collide(bare).restitution_error or 0.0
    explained = (
        "explains the difference" if difference <= bar else "does not explain the whole difference"
    )
    return (
        f"{usual}; at a step of {found.timestep:g} the error is up to {bar:.1e}, which {explained}"
    )


def _has_dump(folder: Path) -> bool:
    try:
        find_job(folder)
    except InputError:
        return False
    return True


def _read_log(path: Path, scene: Scene | None) -> LammpsResult | None:
    """Return the result in a log; None if the file is no log."""
    try:
        with path.open("rb") as file:
            head = file.read(200)
        text = end_of(path, _MOST_BYTES)
    except OSError as error:
        raise InputError(f"cannot read {str(path)!r}: {error.strerror}") from None
    if not head.startswith(_HEADS) and "restitution = " not in text:
        return None
    if (fault := _fault(text, head.startswith(_HEADS))) is not None:
        raise InputError(f"the log {str(path)!r} {fault}")
    said = printed_numbers(text, ("restitution", "restitution_error", "contacts"))
    found = {name: value for name, value in said.items() if math.isfinite(value)}
    contacts, commands = found.get("contacts"), RunCommands.read([path])
    return LammpsResult(
        str(path),
        scene,
        found["restitution"],
        found.get("restitution_error"),
        None if contacts is None else round(contacts),
        particles=int(atoms[-1]) if (atoms := _ATOMS.findall(text)) else None,
        stock_wall=commands.stock_wall,
        timestep=commands.first_timestep,
    )


def _fault(text: str, whole: bool) -> str | None:
    """Return why a log has no result, or None; `whole` means that the log has its first lines."""
    said = printed_values(text, "restitution")
    values = [value for value in said if value is not None and math.isfinite(value)]
    if not said or said[-1] not in values:
        return (
            "holds no line 'restitution = NUMBER'. Print one in the script, or give the "
            "dump of the run"
        )
    if len(set(values)) > 1:
        # If a log has several results, the intended result is unknown.
        return (
            f"holds {len(values)} lines 'restitution = NUMBER', from {min(values):g} to "
            f"{max(values):g}. Write the log of each run into a file of its own"
        )
    why = None
    if (stopped := stopped_with(text)) is not None:
        why = f"{stopped[:200]!r}"
    elif _JOB.search(text) is not None:
        if re.search(r"^restitution_error = ", text, re.MULTILINE) is None:
            why = "no line 'restitution_error = '"
    elif whole and _ENDED.search(text) is None:
        why = "no line 'Total wall time: '"
    return why and (f"is from an unfinished run: it has {why}. Finish the run")
