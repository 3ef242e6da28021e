"""Find the files of a LAMMPS job in a folder: dump, data file, scene, scripts, logs."""

import gzip
import re
import zlib
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from chaincor.analysis.dumps.frame import DumpFrames
from chaincor.analysis.dumps.many_files import files_of, is_pattern, pattern_of
from chaincor.analysis.dumps.masses import DeclaredMasses, declared_masses, read_data_sections
from chaincor.analysis.dumps.other_trajectories import is_other_trajectory, open_trajectory
from chaincor.analysis.dumps.run_commands import RunCommands
from chaincor.analysis.dumps.view import DumpView, ViewedDump
from chaincor.analysis.dumps.yaml_text import YAML_START
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_texts import path_given
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.schemes import COMPOSITIONS
from chaincor.lammps_inputs.small_file import refuse_device
from chaincor.lammps_inputs.units.unit_system import UNITS_FILE, UnitSystem

_HEAD = 4096
_COUNT = re.compile(r"[0-9]{1,18}")
_ATOM_COUNT = re.compile(rb"^\s*(\d+)\s+atoms\s*$", re.MULTILINE)
_DATA_SECTION = re.compile(rb"^\s*(Atoms|Masses)\b", re.MULTILINE)
_SCRIPT_COMMAND = re.compile(rb"^\s*(units|atom_style|read_data|run)\s", re.MULTILINE)
# A ``dump`` command may also be an argument of another command, such as ``if``.
_DUMP_COMMAND = re.compile(r"^[^#\n]*\b(write_dump\s+\S+|dump\s+\S+\s+\S+)\s+custom", re.MULTILINE)


@dataclass(frozen=True)
class Job:
    """Files of a job."""

    dump: Path  #: LAMMPS dump of style custom, or a trajectory that ASE or MDAnalysis can read.
    data: Path | None = None  #: LAMMPS data file.
    scene: Path | None = None  #: ``scene.toml``.
    #: Input scripts.
    scripts: tuple[Path, ...] = ()
    logs: tuple[Path, ...] = ()  #: LAMMPS logs.
    seen: DumpView | None = None  #: View of the dump from the user; None if the user gave no view.

    @property
    def files(self) -> list[tuple[str, Path]]:
        """Roles and paths of the files of the job."""
        found = {
            "dump": files_of(self.dump) if is_pattern(self.dump) else (self.dump,),
            "data file": (self.data,),
            "scene": (self.scene,),
            "script": self.scripts,
            "log": self.logs,
        }
        return [(kind, path) for kind, paths in found.items() for path in paths if path is not None]

    @cached_property
    def loaded_scene(self) -> Scene | None:
        """Scene of the job; None if there is no scene. Raises SceneError for a faulty scene."""
        return None if self.scene is None else Scene.from_file(self.scene)

    @cached_property
    def commands(self) -> RunCommands:
        """Commands in the logs and scripts of the job."""
        return RunCommands.read(self.logs, self.scripts)

    @cached_property
    def masses(self) -> DeclaredMasses:
        """Masses that the scripts, logs and data file declare, in the units of the dump."""
        return declared_masses(self.data, self.commands)

    @cached_property
    def view(self) -> DumpView:
        """
        View of the dump, from the files beside it.

        The units come from ``units.toml``. If there is neither this file nor a scene, they are the
        units in which springs and masses of the run are 1. The wall is the wall of ``fix
        wall/reflect``. If there are two walls, the wall that the chain approaches is used. A view
        from the user has priority.
        """
        if self.seen is not None:
            return self.seen
        path, setup = self.dump.parent / UNITS_FILE, self.commands.setup
        units = UnitSystem()
        if path.exists():
            units = UnitSystem.from_file(path)
        elif self.scene is None:
            units = setup.units(next(iter(self.masses.by_type.values()), None))
        faces = [*setup.walls]
        if not faces:
            return DumpView(units)
        first = open_trajectory(self.dump).first()
        upwards = faces == ["xhi"]
        if len(faces) > 1 and "vx" in first.columns:
            upwards = bool(np.mean(first.column("vx")) > 0.0)
        place = setup.walls["xhi" if upwards else "xlo"]
        try:
            wall = float(first.bounds[0, int(upwards)] if place == "EDGE" else place)
        except ValueError:
            return DumpView(units)
        return DumpView(units, wall, upwards)

    @property
    def order(self) -> int | None:
        """Order of convergence of the run: 0 for the stock wall, None if unknown."""
        if self.commands.stock_wall:
            return 0
        scene = self.loaded_scene
        return None if scene is None else COMPOSITIONS[scene.scheme or "verlet"].order

    @property
    def step(self) -> float | None:
        """Initial time step of the run, in the chain's units; None if it is unknown."""
        step = self.commands.first_timestep
        return None if step is None else step / self.view.units.time

    def frames(self) -> DumpFrames:
        """Open the dump in the chain's units; a dump already in these units is not converted."""
        source = open_trajectory(self.dump)
        return source if self.view == DumpView() else ViewedDump(source, self.view)


def find_job(folder: Path | str, *, data: Path | None = None, dump: Path | None = None) -> Job:
    """
    Find the files of a job by their content, not by their names.

    Parameters
    ----------
    folder : pathlib.Path or str
        Folder of the job.
    data, dump : pathlib.Path, optional
        Files to use instead of the files found.

    Returns
    -------
    Job
        Files of the job.

    Raises
    ------
    InputError
        If there is no dump, or more than one.

    Examples
    --------
    >>> from chaincor import Scene, collide, find_job
    >>> result = collide(Scene(potential="harmonic", particles=10, dump="motion.dump"))
    >>> find_job(".").dump.name
    'motion.dump'
    """
    folder = path_given("folder", folder)
    return _job_of(folder, _files_by_kind(folder), data, dump)


def find_jobs(
    folder: Path | str,
    *,
    data: Path | str | None = None,
    dump: Path | str | None = None,
    scene: Path | str | None = None,
) -> tuple[Job | None, tuple[Job, ...]]:
    """
    Find the job in a folder, and the jobs in its subfolders, in order of their names.

    `scene` applies to all jobs. The first item is None if only a subfolder contains a dump. If
    files of the job are named, subfolders are not searched. Raises InputError like
    :func:`find_job`.
    """
    folder = path_given("folder", folder)
    if scene is not None and not Path(scene).is_file():
        raise InputError(f"{scene} does not exist. Give the scene of the job")
    data, dump = (None if path is None else Path(path) for path in (data, dump))
    kinds, below = _files_by_kind(folder), []
    if data is None and dump is None:
        for path in sorted(path for path in folder.rglob("*") if path.is_dir()):
            found = _files_by_kind(path)
            if found["dump"]:
                below.append(_job_of(path, found))
    jobs = [] if below and not kinds["dump"] else [_job_of(folder, kinds, data, dump)]
    if scene is not None:
        jobs, below = ([replace(job, scene=Path(scene)) for job in each] for each in (jobs, below))
    return jobs[0] if jobs else None, tuple(below)


def _job_of(
    folder: Path,
    kinds: dict[str, list[Path]],
    data: Path | None = None,
    dump: Path | None = None,
) -> Job:
    # A named file is looked up at the given path first, then in the folder.
    dump, data = (
        path if path is None or _is_there(path) or not _is_there(folder / path) else folder / path
        for path in (dump, data)
    )
    if dump is None and len(kinds["dump"]) > 1:
        dump = pattern_of(kinds["dump"])
    if dump is None:
        dump = _only_one(kinds["dump"], "dump", folder)
    scene = folder / "scene.toml"
    if dump is None:
        raise InputError(_why_no_dump(folder, kinds["script"], scene))
    return Job(
        dump=dump,
        data=data or _only_one(kinds["data"], "data", folder),
        scene=scene if scene.exists() else None,
        scripts=tuple(kinds["script"]),
        logs=tuple(kinds["log"]),
    )


def _is_there(path: Path) -> bool:
    return path.exists() or (
        is_pattern(path) and path.parent.is_dir() and bool([*path.parent.glob(path.name)])
    )


def _why_no_dump(folder: Path, scripts: list[Path], scene: Path) -> str:
    """Explain why a folder has no dump, and how to make one."""
    found = f"{folder} holds no LAMMPS dump of style custom, and no trajectory that ASE or "
    found += "MDAnalysis read"
    empty = [
        path.name
        for path in sorted(folder.iterdir())
        if path.is_file() and path.stat().st_size == 0 and re.search("dump|lammpstrj", path.name)
    ]
    if empty:
        found += f" ({', '.join(empty)} is empty)"
    for script in scripts:
        refuse_device(script)
        if _DUMP_COMMAND.search(script.read_text(errors="replace")):
            return (
                f"{found}; {script.name} writes one: run it, (cd {folder} && lmp -in {script.name})"
            )
    if scripts and scene.exists():
        return (
            f"{found}, and its script writes none; 'chaincor run {scene} --dump "
            f"{folder / 'chain.dump'}' writes one, as does a job of 'chaincor inputs {scene} "
            "--frames', once it is run"
        )
    return f"{found}; write one with 'dump ID all custom N FILE id x vx', or name it (--dump)"


def _files_by_kind(folder: Path) -> dict[str, list[Path]]:
    if not folder.is_dir():
        raise InputError(f"{folder} is not a folder. Give the folder of a LAMMPS job")
    kinds: dict[str, list[Path]] = {"dump": [], "data": [], "script": [], "log": [], "other": []}
    for path in sorted(path for path in folder.iterdir() if path.is_file()):
        kind = _recognise(path)
        if kind is not None:
            kinds[kind].append(path)
    # If there is a dump, other trajectories are copies of the dump with fewer digits.
    kinds["dump"] = kinds["dump"] or kinds["other"]
    return kinds


def count_atoms_and_bonds(path: Path) -> tuple[int, int]:
    """Count the atoms and bonds of a data file; raise InputError for other files."""
    _, header = read_data_sections(path)[""]
    counts = {row[1]: int(row[0]) for row in header if len(row) == 2 and _COUNT.fullmatch(row[0])}
    if "atoms" not in counts:
        raise InputError(f"{path} is not a LAMMPS data file: no line 'N atoms' in its header")
    return counts["atoms"], counts.get("bonds", 0)


def _read_head(path: Path) -> bytes:
    refuse_device(path)
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
    if head.startswith((b"ITEM:", YAML_START)) or head[8:18] == b"DUMPCUSTOM":
        return "dump"
    if _ATOM_COUNT.search(head) and _DATA_SECTION.search(head):
        return "data"
    # If a script itself opens the log ``log.lammps``, LAMMPS's first line is missing in this log.
    if head.startswith(b"LAMMPS (") or path.name == "log.lammps":
        return "log"
    if path.suffix != ".toml" and len(_SCRIPT_COMMAND.findall(head)) >= 2:
        return "script"
    return "other" if is_other_trajectory(path) else None


def _only_one(paths: list[Path], kind: str, folder: Path) -> Path | None:
    if len(paths) > 1:
        names = ", ".join(path.name for path in paths)
        raise InputError(f"{folder} holds several {kind} files ({names}); name one (--{kind})")
    return paths[0] if paths else None
