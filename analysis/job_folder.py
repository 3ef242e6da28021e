"""A folder with a LAMMPS job: which file is the dump, the data file, the scene, the script."""

import gzip
import re
import zlib
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from chaincor.analysis.dumps.chain_frames import BODY_COLUMN, ChainLayout
from chaincor.analysis.dumps.data_file import DeclaredMasses, declared_masses
from chaincor.analysis.dumps.declared_setup import DeclaredSetup, declared_setup, has_stock_wall
from chaincor.analysis.dumps.frame import DumpFrame, Frames
from chaincor.analysis.dumps.masses import find_masses
from chaincor.analysis.dumps.other_trajectories import is_other_trajectory, open_trajectory
from chaincor.analysis.dumps.timestep import infer_timestep, read_timestep
from chaincor.analysis.dumps.view import DumpView, ViewedDump
from chaincor.analysis.frame_analysis import CHAIN_AND_WALL, Bodies, EndArgument, analyze_frames
from chaincor.analysis.results import CollisionAnalysis
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import Harmonic
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.units.unit_system import UNITS_FILE, UnitSystem

_HEAD = 4096
_ATOM_COUNT = re.compile(rb"^\s*(\d+)\s+atoms\s*$", re.MULTILINE)
_BOND_COUNT = re.compile(rb"^\s*(\d+)\s+bonds\s*$", re.MULTILINE)
_DATA_SECTION = re.compile(rb"^\s*(Atoms|Masses)\b", re.MULTILINE)
_UNITS = re.compile(r"^\s*units\s+(\S+)", re.MULTILINE)
_SCRIPT_COMMAND = re.compile(rb"^\s*(units|atom_style|read_data|run)\s", re.MULTILINE)


@dataclass(frozen=True)
class Job:
    """
    The files of a job.

    Attributes
    ----------
    dump : pathlib.Path
        LAMMPS dump of style custom, or a trajectory that ASE or MDAnalysis read.
    data : pathlib.Path or None
        LAMMPS data file.
    scene : pathlib.Path or None
        ``scene.toml``.
    scripts, logs : tuple of pathlib.Path
        Input scripts and LAMMPS logs.
    """

    dump: Path
    data: Path | None = None
    scene: Path | None = None
    scripts: tuple[Path, ...] = ()
    logs: tuple[Path, ...] = ()

    @cached_property
    def setup(self) -> DeclaredSetup:
        """What its logs and scripts say of units, springs and walls."""
        return declared_setup(self.logs, self.scripts)


def find_job(folder: Path | str, *, data: Path | None = None, dump: Path | None = None) -> Job:
    """
    Find the files of a job, by content and not by name.

    Parameters
    ----------
    folder : pathlib.Path or str
        Folder of the job.
    data, dump : pathlib.Path, optional
        Files to take, instead of those found.

    Returns
    -------
    Job
        Its files.

    Raises
    ------
    InputError
        If there is no dump, or more than one to choose from.

    Examples
    --------
    >>> from chaincor import Scene, collide, find_job
    >>> result = collide(Scene(potential="harmonic", particles=10, dump="motion.dump"))
    >>> find_job(".").dump.name
    'motion.dump'
    """
    return _job_of(Path(folder), _files_by_kind(Path(folder)), data, dump)


def find_jobs(
    folder: Path | str,
    *,
    data: Path | str | None = None,
    dump: Path | str | None = None,
    scene: Path | str | None = None,
) -> tuple[Job | None, tuple[Job, ...]]:
    """
    Find the job in a folder, and those in the folders below it, in order of their names.

    `scene` is that of all of them. There is None in the folder itself where it holds no dump, and
    one below does; of jobs whose files are named none below is looked for. Raises InputError as
    :func:`find_job` does.
    """
    folder = Path(folder)
    given = None if scene is None else _existing(Path(scene))
    if data is not None or dump is not None:
        named = (None if path is None else Path(path) for path in (data, dump))
        job = _job_of(folder, _files_by_kind(folder), *named)
        return replace(job, scene=given or job.scene), ()
    kinds = _files_by_kind(folder)
    folders = sorted(path for path in folder.rglob("*") if path.is_dir())
    below = tuple(
        _job_of(path, found, None, None)
        for path in folders
        if (found := _files_by_kind(path))["dump"]
    )
    below = tuple(replace(job, scene=given or job.scene) for job in below)
    if below and not kinds["dump"]:
        return None, below
    job = _job_of(folder, kinds, None, None)
    return replace(job, scene=given or job.scene), below


def _existing(path: Path) -> Path:
    if not path.is_file():
        raise InputError(f"cannot read {path}: no such file; expected the scene of the job")
    return path


def _job_of(
    folder: Path, kinds: dict[str, list[Path]], data: Path | None, dump: Path | None
) -> Job:
    dump, data = (_beside(folder, path) for path in (dump, data))
    if dump is None:
        dump = _only_one(kinds["dump"], "dump", folder)
    if dump is None:
        empty = [path.name for path in _empty_dumps(folder)]
        hint = f" ({', '.join(empty)} is empty)" if empty else ""
        raise InputError(
            f"{folder} holds no LAMMPS dump of style custom, and no trajectory that ASE or "
            f"MDAnalysis read{hint}; write one with "
            "'dump ID all custom N FILE id x vx', or name it (--dump)"
        )
    scene = folder / "scene.toml"
    return Job(
        dump=dump,
        data=data or _only_one(kinds["data"], "data", folder),
        scene=scene if scene.exists() else None,
        scripts=tuple(kinds["script"]),
        logs=tuple(kinds["log"]),
    )


def _beside(folder: Path, path: Path | None) -> Path | None:
    """Return a file that is named: where the name says, else in the folder."""
    if path is None or path.exists() or not (folder / path).exists():
        return path
    return folder / path


def _files_by_kind(folder: Path) -> dict[str, list[Path]]:
    if not folder.is_dir():
        raise InputError(f"{folder} is not a folder; expected the folder of a LAMMPS job")
    kinds: dict[str, list[Path]] = {"dump": [], "data": [], "script": [], "log": []}
    others = []
    for path in sorted(folder.iterdir()):
        kind = _recognise(path) if path.is_file() else None
        if kind is not None:
            kinds[kind].append(path)
        elif path.is_file() and is_other_trajectory(path):
            others.append(path)
    # Beside a dump they are copies of it, with fewer digits.
    kinds["dump"] = kinds["dump"] or others
    return kinds


def count_atoms(path: Path) -> int:
    """Return the number of atoms that a data file declares; InputError if it is not one."""
    found = _ATOM_COUNT.search(_read_head(path))
    if found is None:
        raise InputError(f"{path} is not a LAMMPS data file: no line 'N atoms' in its header")
    return int(found[1])


def analyze_job(
    job: Job,
    *,
    bond: Potential | None = None,
    impact_velocity: float | None = None,
    timestep: float | None = None,
    masses: ArrayLike | None = None,
    end_argument: EndArgument | None = None,
    progress: Callable[[int], None] | None = None,
    view: DumpView | None = None,
    target_particles: int | None = None,
) -> CollisionAnalysis:
    """
    Analyse the dump of a job, with what its other files know.

    Parameters
    ----------
    job : Job
        Files of the job.
    bond : Potential, optional
        The bonds' potential; that of ``scene.toml`` by default.
    impact_velocity : float, optional
        v0; that of ``scene.toml`` or of the first frame by default.
    timestep : float, optional
        Simulated time per step, for dumps that do not carry the time; from the log, the script or
        the flight of the last particle by default.
    masses : array_like, optional
        Particle masses from the wall outwards, repeated along the chain; by default those of the
        dump, else of the data file and the script by type, else 1.
    end_argument : callable, optional
        See :func:`~chaincor.analysis.frame_analysis.analyze_frames`.
    progress : callable, optional
        Called with the number of bytes of the dump read so far.
    view : DumpView, optional
        Units of the dump, where its wall is and which way the chain moves; velocity, timestep and
        masses that are given are in these units too. By default those of ``units.toml`` beside the
        dump, else the chain's own, with the wall at 0 below the chain.
    target_particles : int, optional
        So many particles, those at the lowest x where the dump has no column ``mol``, are a free
        target; by default as :func:`bodies_of` tells it.

    Returns
    -------
    CollisionAnalysis
        All results.

    Raises
    ------
    InputError
        If the files do not fit together or do not show a collision.

    Examples
    --------
    >>> from chaincor import Scene, analyze_job, collide, find_job
    >>> result = collide(Scene(potential="harmonic", particles=10, dump="motion.dump"))
    >>> analyze_job(find_job(".")).contacts
    9
    """
    view = view or view_of(job)
    units = view.units
    _refuse_other_units((*job.scripts, *job.logs), units.style)
    dump = open_dump(job, view)
    first = dump.first()
    bodies = bodies_of(job, first, target_particles)
    layout = ChainLayout.from_frame(first, bodies.targets)
    if impact_velocity is not None:
        impact_velocity /= units.speed
    if timestep is not None:
        timestep /= units.time
    if masses is not None:
        masses = np.asarray(masses, dtype=float) / units.mass
    notes: list[str] = []
    if job.scene is not None:
        scene = Scene.from_file(job.scene)
        if bond is not None and bond != scene.bond:
            notes.append(
                f"energies are those of {bond.name} bonds, as asked for, where {job.scene.name} "
                f"has {scene.label} ones"
            )
        bond = bond or scene.bond
        impact_velocity = impact_velocity or scene.impact_velocity
        _expect_count(scene.all_particles, job.scene, layout.by_ids.particles, job.dump)
    elif bond is None and job.setup.spring is not None:
        bond = Harmonic()
        notes.append("script or log says bond_style harmonic: energies are those of such bonds")
    if job.scene is None and (view.wall != 0.0 or view.upwards):
        side = "+x" if view.upwards else "-x"
        notes.append(f"the wall is taken to be at x = {view.wall:g}, met by a chain along {side}")
    if job.data is not None and bodies == CHAIN_AND_WALL:
        _expect_count(count_atoms(job.data), job.data, layout.particles, job.dump)
        _expect_one_chain(job.data, layout.particles)
    declared = masses_declared(job, units)
    given = None if bodies.targets else masses  # which are refused then
    known = find_masses(first, layout.by_ids, given=given, declared=declared)
    if job.scene is None and known is None:
        notes.append(
            "nothing tells the masses: particles are taken to be alike, of mass 1; --masses gives "
            "them"
        )
    if uses_reflecting_wall(job):
        notes.append(
            "the run used fix wall/reflect: each contact then costs an error of first order in "
            "the timestep, usually 1e-3 to 1e-2 of restitution in all, which energy and momentum "
            "hardly show"
        )
    if timestep is None and not layout.time_known:
        timestep = read_timestep(job.logs, job.scripts)
        if timestep is not None:
            timestep /= units.time
        else:
            timestep = infer_timestep(dump, layout)
            if timestep is not None:
                notes.append(
                    f"the dump does not carry the time; a step was found to be {timestep:.6g} "
                    "long from the flight of the last particle; --timestep gives it exactly"
                )
    return analyze_frames(
        dump.frames(progress),
        bond=bond,
        impact_velocity=impact_velocity,
        timestep=timestep,
        masses=masses,
        declared=declared,
        end_argument=end_argument,
        notes=notes,
        is_truncated=lambda: dump.truncated,
        bodies=bodies,
    )


def bodies_of(job: Job, first: DumpFrame, given: int | None = None) -> Bodies:
    """
    Return what meets in a job.

    How many particles are a free target's is told by `given`, by ``scene.toml``, or by the first
    frame of the dump, whose column ``mol`` is 1 in the chain and 2 in the target; that bodies are
    soft is told by ``scene.toml``. Raises InputError where these differ.
    """
    scene = None if job.scene is None else Scene.from_file(job.scene)
    told: dict[str, int] = {}
    if given is not None:
        told["--target-particles"] = given
    if scene is not None and scene.target_particles is not None:
        told[str(job.scene)] = scene.target_particles
    if BODY_COLUMN in first.columns:
        numbers = first.column(BODY_COLUMN)
        if set(numbers.tolist()) == {1.0, 2.0}:
            told[f"column {BODY_COLUMN} of the dump"] = int(np.sum(numbers == 2.0))
    if len(set(told.values())) > 1:
        shown = ", ".join(f"{source} {count}" for source, count in told.items())
        raise InputError(f"the free target has {shown} particles; expected one number: drop one")
    return Bodies(next(iter(told.values()), 0), scene is not None and scene.contact_duration > 0.0)


def uses_reflecting_wall(job: Job) -> bool:
    """Tell by its scripts and logs whether a run had the stock wall, ``fix wall/reflect``."""
    return any(map(has_stock_wall, (*job.scripts, *job.logs)))


def view_of(job: Job) -> DumpView:
    """
    Return how to see the dump of a job, by what lies beside it.

    Units are those of ``units.toml``; without one, and without a scene, those in which its springs
    and masses are 1. The wall is that of ``fix wall/reflect``; of two, the chain flies to one.
    """
    path, setup = job.dump.parent / UNITS_FILE, job.setup
    units = UnitSystem()
    if path.exists():
        units = UnitSystem.from_file(path)
    elif job.scene is None:
        masses = declared_masses(job.data, job.scripts, job.logs).by_type
        units = setup.units(next(iter(masses.values()), None))
    faces = [*setup.walls]
    if not faces:
        return DumpView(units)
    first = open_trajectory(job.dump).first()
    upwards = faces == ["xhi"]
    if len(faces) > 1 and "vx" in first.columns:
        upwards = bool(np.mean(first.column("vx")) > 0.0)
    place = setup.walls["xhi" if upwards else "xlo"]
    try:
        wall = float(first.bounds[0, int(upwards)] if place == "EDGE" else place)
    except ValueError:
        return DumpView(units)
    return DumpView(units, wall, upwards)


def open_dump(job: Job, view: DumpView) -> Frames:
    """Return the dump of a job in the chain's units; exactly as it is where it is in them."""
    source = open_trajectory(job.dump)
    return source if view == DumpView() else ViewedDump(source, view)


def masses_declared(job: Job, units: UnitSystem) -> DeclaredMasses:
    """Return the masses that the files of a job declare, in the chain's units."""
    declared = declared_masses(job.data, job.scripts, job.logs)
    by_type = {kind: mass / units.mass for kind, mass in declared.by_type.items()}
    return replace(declared, by_type=by_type)


def _refuse_other_units(paths: Iterable[Path], style: str) -> None:
    for path in paths:
        other = next((found for found in _UNITS.findall(_text(path)) if found != style), None)
        if other is not None and "$" not in other:
            raise InputError(
                f"{path} sets units {other}; expected units {style}: --units, --length, --mass and "
                "--stiffness say what the chain's own are in those of the dump"
            )


def _text(path: Path) -> str:
    return path.read_text(errors="replace")


def _expect_count(expected: int, source: Path, found: int, dump: Path) -> None:
    if expected != found:
        raise InputError(
            f"{dump} holds {found} particles, {source} {expected}; expected the dump of that job"
        )


def _expect_one_chain(data: Path, particles: int) -> None:
    found = _BOND_COUNT.search(_read_head(data))
    bonds = 0 if found is None else int(found[1])
    if bonds not in (0, particles - 1):  # none: other forces hold the chain together
        raise InputError(
            f"{data} has {bonds} bonds between {particles} particles; expected one open chain with "
            f"{particles - 1}: all particles of the dump are taken to be that chain"
        )


def _read_head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
        if head.startswith(b"\x1f\x8b"):
            with gzip.open(path, "rb") as stream:
                head = stream.read(64)
    except OSError as error:
        raise InputError(f"cannot read {path}: {error.strerror or error}") from None
    except (EOFError, zlib.error):
        return b""
    return head


def _recognise(path: Path) -> str | None:
    head = _read_head(path)
    if head.startswith(b"ITEM:") or head[8:18] == b"DUMPCUSTOM":
        return "dump"
    if _ATOM_COUNT.search(head) and _DATA_SECTION.search(head):
        return "data"
    # A script that names its log itself has no first line of LAMMPS in it.
    if head.startswith(b"LAMMPS (") or path.name == "log.lammps":
        return "log"
    if path.suffix != ".toml" and len(_SCRIPT_COMMAND.findall(head)) >= 2:
        return "script"
    return None


def _empty_dumps(folder: Path) -> Iterable[Path]:
    return [
        path
        for path in sorted(folder.iterdir())
        if path.is_file() and path.stat().st_size == 0 and re.search("dump|lammpstrj", path.name)
    ]


def _only_one(paths: list[Path], kind: str, folder: Path) -> Path | None:
    if len(paths) > 1:
        names = ", ".join(path.name for path in paths)
        raise InputError(f"{folder} holds several {kind} files ({names}); name one (--{kind})")
    return paths[0] if paths else None
