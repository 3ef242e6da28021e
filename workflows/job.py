"""Write self-contained LAMMPS jobs for scenes."""

import re
import shutil
import tempfile
import warnings
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from chaincor.analysis.atomic_write import made_folder
from chaincor.analysis.output_paths import resolve_folder
from chaincor.lammps_inputs.chain_data import format_data
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.explain import explain_data, explain_script, explain_table
from chaincor.lammps_inputs.given_texts import path_given
from chaincor.lammps_inputs.granular import (
    bead_table_rows,
    format_bead_table,
    format_beads,
    render_granular_job,
)
from chaincor.lammps_inputs.plain_script import is_plain, plain_scene, render_plain
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_file import read_from_anywhere
from chaincor.lammps_inputs.script import DATA_FILE, SCENE_FILE, SCRIPT_FILE, TABLE_FILE
from chaincor.lammps_inputs.script_plan import NO_WISHES, JobWishes, ScriptPlan
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UNITS_FILE, UnitSystem
from chaincor.workflows.engines.lammps.kept_script import job_script
from chaincor.workflows.errors import UnsureJobWarning
from chaincor.workflows.given import scene_given
from chaincor.workflows.scripted import plan_script

# A velocity above this multiple of the speed of sound in an uncompressed chain was probably meant
# in the units of the job, because LAMMPS cannot resolve such an impact.
_SUPERSONIC = 3.0


def write_job(
    scene: Scene, folder: Path | str, *, replace_existing: bool = False, **wishes: Any
) -> list[Path]:
    """
    Write a LAMMPS job, which ``lmp -in in.chain`` runs in its folder to print the restitution.

    Parameters
    ----------
    scene : Scene
        The collision. Without explicit numerics, numerics are chosen for the tolerance of the
        scene.
    folder : path
        Folder for the script, the data file of the chain, its bond table and the scene.
    replace_existing : bool
        Whether to replace an existing job.
    **wishes
        Fields of :class:`~chaincor.lammps_inputs.script_plan.JobWishes`. ``plain=True`` writes the
        shortest script. ``restartable=True``, ``guards=True``, ``contacts=True`` and ``dump=True``
        add tasks to the script. ``explain=True`` adds comments. Other fields are ``template``,
        ``table_range`` and ``units``.

    Returns
    -------
    list of pathlib.Path
        Paths of the files.

    Raises
    ------
    InputError
        If the folder already contains a job or cannot be made, and in the cases listed in
        :func:`job_files`.

    Examples
    --------
    >>> from chaincor import Scene, write_job
    >>> files = write_job(Scene(particles=10), "first", plain=True, explain=True)
    >>> sorted(path.name for path in files)
    ['bond.table', 'chain.data', 'in.chain', 'scene.toml']
    """
    known = [each.name for each in fields(JobWishes)]
    if unknown := sorted(set(wishes) - set(known)):
        raise InputError(f"write_job has no argument {unknown[0]!r}. Use one of {', '.join(known)}")
    try:
        files = job_files(scene_given(scene), JobWishes(**wishes))
        return write_files(files, path_given("folder", folder), replace_existing)
    except InputError as error:
        error.args = (_OPTION.sub(_argument, str(error)), *error.args[1:])
        raise


# In error messages, options of `chaincor inputs` are replaced by arguments of `write_job`.
# _OTHER_NAMES lists the options whose arguments have other names.
_OPTION = re.compile(r"(?<![\w-])(--[a-z][a-z-]*|-o)(?![\w-])")
_OTHER_NAMES = {
    "-o": "folder",
    "--output": "folder",
    "--frames": "dump=True",
    "--force": "replace_existing=True",
}


def _argument(option: re.Match[str]) -> str:
    """Return the Python argument that corresponds to an option of the command line."""
    name = option[0].lstrip("-").replace("-", "_")
    is_flag = any(each.name == name and each.default is False for each in fields(JobWishes))
    return _OTHER_NAMES.get(option[0], f"{name}=True" if is_flag else name)


def job_files(
    scene: Scene, wishes: JobWishes = NO_WISHES, *, shared_table: bool = False
) -> dict[str, str]:
    """
    Return the texts of all files in a job, by file name.

    The numerics are those of the scene, or are chosen for its tolerance. The script prints the
    error of eta unless the scene has ``error = false``. It dumps the motion if the scene has a
    dump. With `shared_table`, similar scenes get equal bond tables. Raises InputError for wishes
    that contradict each other or the scene. Raises SceneError if a script cannot use the scheme or
    the template. Raises RunError if no numerics meet the tolerance. Issues UnsureJobWarning if the
    collision amplifies errors beyond the tolerance.
    """
    if not wishes.dump and scene.dump is None and "dump_frames" in scene.model_fields_set:
        raise InputError(
            f"dump_frames is {scene.dump_frames!r}, but the job writes no dump. Add "
            "--frames, or leave out dump_frames"
        )
    scene = read_from_anywhere(scene).replace(engine="lammps")
    units = wishes.units
    _refuse_units_of_velocity(scene, units)
    if scene.bond.only_pushes:
        return _bead_files(scene, wishes)
    plain = is_plain(wishes)
    if plain:
        scene = plain_scene(scene)
    plan = plan_script(scene, wishes.table_range, shared_table=shared_table)
    if plan.doubt is not None:
        warnings.warn(plan.doubt, UnsureJobWarning, stacklevel=2)
    named = isinstance(scene.potential, str)
    if wishes.guards and named:
        plan = replace(plan, scene_sha256=_as_run(scene, plan).sha256)
    texts = {
        SCRIPT_FILE: render_plain(scene, plan, scene.problem.approach_time, wishes)
        if plain
        else job_script(scene.problem, plan, _with_frames(scene, wishes)),
        DATA_FILE: format_data(scene.line, units=units),
    }
    if plan.table is not None:
        texts[TABLE_FILE] = plan.table.to_text(units)
    if wishes.explain:
        others_own = wishes.template is not None
        texts[SCRIPT_FILE] = explain_script(texts[SCRIPT_FILE], others_own, brief=plain)
        texts[DATA_FILE] = explain_data(texts[DATA_FILE])
        if plan.table is not None:
            texts[TABLE_FILE] = explain_table(texts[TABLE_FILE])
    if named:
        texts[SCENE_FILE] = _as_run(scene, plan).without("dump_frames").to_toml()
    if units != CHAIN_UNITS:
        texts[UNITS_FILE] = units.to_toml()
    return texts


def _bead_files(scene: Scene, wishes: JobWishes) -> dict[str, str]:
    """Return the files for a column of beads; its script uses only LAMMPS's granular styles."""
    for each in fields(JobWishes):
        if getattr(wishes, each.name) != each.default:
            raise InputError(
                f"jobs of beads have a short script of their own, without {each.name}. Leave "
                f"out {each.name}, or add the commands to in.chain by hand"
            )
    plan = plan_script(scene)
    texts = {
        SCRIPT_FILE: render_granular_job(scene.problem, plan),
        DATA_FILE: format_beads(scene.problem),
    }
    if (rows := bead_table_rows(scene.problem, plan.numerics)) is not None:
        texts[TABLE_FILE] = format_bead_table(scene.problem, rows)
    if isinstance(scene.potential, str):
        used = scene.replace(tolerance=None, timestep=plan.numerics.timestep)
        texts[SCENE_FILE] = used.without("dump_frames").to_toml()
    return texts


def _with_frames(scene: Scene, wishes: JobWishes) -> JobWishes:
    """Return the wishes with the frame interval of the scene, and a dump if the scene has one."""
    dump = wishes.dump or scene.dump is not None
    return replace(wishes, dump=dump, frame_interval=scene.frame_interval)


def _refuse_units_of_velocity(scene: Scene, units: UnitSystem) -> None:
    """Raise InputError for a velocity that was probably meant in the units of the job."""
    if units == CHAIN_UNITS or (scene.velocity or 0.0) <= _SUPERSONIC:
        return
    v, style = scene.impact_velocity, units.style
    raise InputError(
        f"velocity is {v:g} in units of the chain, where the speed of sound is "
        f"1. That is {v * units.speed:g} in units {style}. For {v:g} in units "
        f"{style}, give velocity = {v / units.speed:.6g}"
    )


def _as_run(scene: Scene, plan: ScriptPlan) -> Scene:
    """Return the scene with the chosen numerics, so that later runs take the same steps."""
    if scene.explicit:
        return scene.replace(scheme=plan.numerics.scheme)
    return scene.replace(
        tolerance=None,
        scheme=plan.numerics.scheme,
        timestep=plan.numerics.timestep,
        table=None if plan.table is None else plan.table.style,
        table_points=None if plan.table is None else plan.table.rows,
    )


def write_files(texts: dict[str, str], folder: Path, replace_existing: bool) -> list[Path]:
    """Write all files of a job or none; raise InputError if one of them already exists."""
    place = resolve_folder(folder)
    present = [name for name in texts if (place / name).exists()]
    if present and not replace_existing:
        raise InputError(
            f"the folder {str(folder)!r} has {', '.join(present)} already. Give another "
            "folder, or replace the job with --force"
        )
    try:
        with (
            made_folder(folder),
            tempfile.TemporaryDirectory(prefix=".partial-", dir=folder) as aside,
        ):
            for name, text in texts.items():
                (Path(aside) / name).write_text(text, encoding="utf-8")
            for name in texts:
                shutil.move(Path(aside) / name, folder / name)
    except OSError as error:
        raise InputError(
            f"cannot write the job into {str(folder)!r}: {error.strerror}. Give another folder"
        ) from None
    return [folder / name for name in texts]
