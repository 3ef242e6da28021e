"""Read a user's LAMMPS result: a job's folder, a dump, or a log with the restitution."""

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
# Jobs of chaincor print their error last, so their restitution alone is no finished result.
_JOB = re.compile(r"^variable +(restitution|step_error) string ", re.MULTILINE)


@dataclass(frozen=True)
class LammpsResult:
    """Result of a LAMMPS run that chaincor did not start."""

    source: str  #: Place of the result.
    #: Scene from ``scene.toml`` beside the result, or from its other files; None if unknown.
    scene: Scene | None
    restitution: float  #: Eta.
    restitution_error: float | None  #: Error of eta; None if unknown.
    contacts: int | None  #: Number of contacts, if known.
    data_error: float = 0.0  #: Error of eta from the digits of a dump.
    particles: int | None = None  #: Number in both bodies, if known.
    stock_wall: bool = False  #: Whether the run had LAMMPS's ``fix wall/reflect``.
    timestep: float | None = None  #: Time step in the chain's units.


def is_lammps_result(against: str | None) -> bool:
    """Return whether ``--against`` names a folder or a file other than CSV, NPZ and a module."""
    if against is None:
        return False
    path = Path(against)
    return path.suffix.lower() not in (".csv", ".npz", ".py") and (path.is_dir() or path.is_file())


def read_lammps_result(path: Path | str) -> LammpsResult:
    """
    Read a job's folder, a dump, or a log.

    The dump in a folder is analysed as in ``chaincor analyze``. A folder without a dump must
    contain ``log.lammps``. A log must come from a single finished run with a line ``restitution =
    NUMBER``; ``restitution_error`` and ``contacts`` are optional. Raises InputError if there is no
    such result.
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
    """Return the scene of a run, if its script shows that the bonds are springs."""
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

    For a result without an error bar, the allowed difference of eta is the larger of the scene's
    tolerance (default 1e-6) and the error from the digits of the dump. Raises InputError if the
    numbers of particles differ.
    """
    if found.particles not in (None, scene.problem.all_particles):
        raise InputError(
            f"{found.source} has {found.particles} particles, but the scene has "
            f"{scene.problem.all_particles}. Give the scene of that run: SCENE.toml, or "
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
    """Describe whether the error of the stock wall at a run's step explains a difference."""
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
    """Return the result in a log, or None if the file is no log."""
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
    """Return why a log has no result, or None; `whole` says whether the log has its head."""
    said = printed_values(text, "restitution")
    values = [value for value in said if value is not None and math.isfinite(value)]
    if not said or said[-1] not in values:
        return (
            "holds no line 'restitution = NUMBER'. Print one in the script, or give the "
            "dump of the run"
        )
    if len(set(values)) > 1:
        # If a log has several results, none can be preferred.
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
