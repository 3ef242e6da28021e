"""Check output files before a command starts its work."""

from collections.abc import Iterable, Sequence
from hashlib import sha256
from pathlib import Path

from chaincor.analysis.output_paths import judge_output, resolve_folder, resolve_output
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script import DATA_FILE, DUMP_FILE, SCENE_FILE, SCRIPT_FILE, TABLE_FILE

# File formats of figures.
PICTURES = (".png", ".pdf", ".svg")
PICTURES_SAID = ".png, .pdf or .svg"


def refuse_unusable_outputs(scene: Scene) -> None:
    """
    Check the output paths of a collision before it runs.

    Raises InputError in three cases: two outputs have the same path; an output file has the path of
    a folder, or an output folder the path of a file; or an output would replace a file of another
    kind or the job of another collision. A repeated run may replace its own files.
    """
    if scene.dump is None and "dump_frames" in scene.model_fields_set:
        raise InputError(
            f"dump_frames is {scene.dump_frames!r}, but there is no dump. Give "
            "dump, or leave out dump_frames"
        )
    given = _outputs(scene)
    paths = {key: _resolved(key, path) for key, path in given.items()}
    if len(set(paths.values())) < len(paths):
        raise InputError(f"{' and '.join(paths)} have the same path. Give each its own path")
    for key, path in paths.items():
        folder = path if key == "save" else path.parent
        in_the_way = [p for p in (folder, *folder.parents) if p.exists() and not p.is_dir()]
        if in_the_way or (key != "save" and path.is_dir()):
            found = f"{str(in_the_way[0])!r} is a file" if in_the_way else "that is a folder"
            raise InputError(f"{key} is {str(given[key])!r}, but {found}. Give another path")
        if key == "save":
            _refuse_another_job(scene, path)
        else:
            judge_output(given[key], key)


def _resolved(key: str, path: Path) -> Path:
    """Return the path of an output with all links resolved."""
    return resolve_folder(path) if key == "save" else resolve_output(path)


def _outputs(scene: Scene) -> dict[str, Path]:
    """Return the output paths of a scene, by scene key."""
    given = {key: getattr(scene, key) for key in ("dump", "arrays", "save")}
    return {key: path for key, path in given.items() if path is not None}


def make_folder(folder: Path) -> None:
    """Make a folder and its parents; raise InputError on failure."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot make the folder {str(folder)!r}: {error.strerror}. Give another folder"
        ) from None


def refuse_overwriting_inputs(output: Path, inputs: Iterable[Path], option: str) -> None:
    """
    Raise InputError if an output file is an input file or a link to an input file.

    The files need not exist. `option` is the command-line option for `output`, for example
    ``--output``.
    """
    for path in inputs:
        if _is_one_file(output, path):
            also = "" if str(path) == str(output) else f", the same file as {str(path)!r}"
            raise InputError(
                f"{option} is {str(output)!r}{also}, which is an input of this command. "
                "Give another name"
            )


# In a saved job, the scene file contains one line with this prefix for each file: its name and its
# SHA-256.
_SIGNED = "# saved by chaincor run: "
# Every run of the job writes these files; a change in these files is therefore not an edit.
_WRITTEN_BY_RUNS = ("log.lammps", DUMP_FILE)


def sign_job(folder: Path) -> None:
    """Write the digests of the files of a saved job into its scene file, to detect later edits."""
    scene = folder / SCENE_FILE
    if not scene.exists():
        return
    lines = [f"{_SIGNED}{name} {digest}\n" for name, digest in _digests(folder).items()]
    scene.write_text("".join(lines) + scene.read_text(encoding="utf-8"), encoding="utf-8")


def _digests(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file in a job; the signature in the scene is left out."""
    found = {}
    for path in sorted(path for path in folder.iterdir() if path.is_file()):
        if path.name not in _WRITTEN_BY_RUNS:
            lines = path.read_bytes().splitlines(keepends=True)
            own = [line for line in lines if not line.startswith(_SIGNED.encode())]
            found[path.name] = sha256(b"".join(own)).hexdigest()
    return found


def _is_unedited(folder: Path) -> bool:
    """Return whether a folder contains a saved job whose files have not been edited."""
    try:
        text = (folder / SCENE_FILE).read_text(encoding="utf-8")
        signed = [
            tuple(line.removeprefix(_SIGNED).split())
            for line in text.splitlines()
            if line.startswith(_SIGNED)
        ]
        return bool(signed) and set(signed) <= {*_digests(folder).items()}
    except (OSError, ValueError):
        return False


def _refuse_another_job(scene: Scene, folder: Path) -> None:
    names = (SCRIPT_FILE, DATA_FILE, TABLE_FILE, SCENE_FILE, *_WRITTEN_BY_RUNS)
    there = [name for name in names if (folder / name).exists()]
    if not there:
        return
    try:
        kept = Scene.from_file(folder / SCENE_FILE)
    except InputError:  # the scene file is invalid or missing
        kept = None
    if kept is None or kept.collision_sha256 != scene.collision_sha256 or not _is_unedited(folder):
        raise InputError(
            f"save is {str(folder)!r}, which has files of something else "
            f"({', '.join(there)}). Give another folder, or remove these files"
        )


def refuse_shared_outputs(scenes: Sequence[Scene]) -> None:
    """Raise InputError if two scenes would write to the same path."""
    owners: dict[Path, int] = {}
    for number, scene in enumerate(scenes, start=1):
        for key, path in _outputs(scene).items():
            owner = owners.setdefault(_resolved(key, path), number)
            if owner != number:
                raise InputError(
                    f"{key} is {str(path)!r} in scenes {owner} and {number}. Give each "
                    "scene its own path"
                )


def _is_one_file(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except (OSError, ValueError):  # A file is missing, or its name is invalid.
        return False
