"""A folder with a LAMMPS job: which file is the dump, the data file, the scene, the script."""

import gzip
import re
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from chaincor.analysis.dumps.data_file import DeclaredMasses, declared_masses
from chaincor.analysis.dumps.declared_setup import DeclaredSetup, declared_setup
from chaincor.analysis.dumps.other_trajectories import is_other_trajectory
from chaincor.analysis.dumps.run_commands import RunCommands
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene

_HEAD = 4096
_ATOM_COUNT = re.compile(rb"^\s*(\d+)\s+atoms\s*$", re.MULTILINE)
_BOND_COUNT = re.compile(rb"^\s*(\d+)\s+bonds\s*$", re.MULTILINE)
_DATA_SECTION = re.compile(rb"^\s*(Atoms|Masses)\b", re.MULTILINE)
_SCRIPT_COMMAND = re.compile(rb"^\s*(units|atom_style|read_data|run)\s", re.MULTILINE)


@dataclass(frozen=True)
class Job:
    """The files of a job."""

    dump: Path  #: LAMMPS dump of style custom, or a trajectory that ASE or MDAnalysis read.
    data: Path | None = None  #: LAMMPS data file.
    scene: Path | None = None  #: ``scene.toml``.
    #: Input scripts and LAMMPS logs.
    scripts: tuple[Path, ...] = ()
    logs: tuple[Path, ...] = ()  #: See ``scripts``.

    @cached_property
    def told_scene(self) -> Scene | None:
        """What its scene says; None where it has none. SceneError if that is none."""
        return None if self.scene is None else Scene.from_file(self.scene)

    @cached_property
    def commands(self) -> RunCommands:
        """What its logs and scripts hold."""
        return RunCommands.read(self.logs, self.scripts)

    @cached_property
    def setup(self) -> DeclaredSetup:
        """What these say of units, springs and walls."""
        return declared_setup(self.commands)

    @cached_property
    def masses(self) -> DeclaredMasses:
        """What these and the data file say of masses, in the units of the dump."""
        return declared_masses(self.data, self.commands)


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


def count_bonds(path: Path) -> int:
    """Return the number of bonds that a data file declares; 0 where it declares none."""
    found = _BOND_COUNT.search(_read_head(path))
    return 0 if found is None else int(found[1])


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
