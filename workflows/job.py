"""Writing a self-contained LAMMPS job for a scene."""

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from chaincor.lammps_inputs.chain_data import format_scene_data
from chaincor.lammps_inputs.errors import InputError, SceneError
from chaincor.lammps_inputs.explain import explain_data, explain_script, explain_table
from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate
from chaincor.lammps_inputs.plain_script import plain_scene, render_plain
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script import DATA_FILE, SCENE_FILE, SCRIPT_FILE, TABLE_FILE, Extras
from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UNITS_FILE, UnitSystem
from chaincor.workflows.engines.lammps.bodies import approach_time
from chaincor.workflows.engines.lammps.kept_script import job_script
from chaincor.workflows.given import scene_given
from chaincor.workflows.scripted.plan import ScriptPlan, plan_script

# No bond that LAMMPS can follow is met so fast, in units of the sound in a chain at rest.
_SUPERSONIC = 3.0


def write_job(
    scene: Scene, folder: Path | str, *, replace_existing: bool = False, **wishes: Any
) -> list[Path]:
    """
    Write a LAMMPS job: ``lmp -in in.chain`` in its folder runs it and prints the restitution.

    Parameters
    ----------
    scene : Scene
        The collision. Without explicit numerics the job is made for its tolerance.
    folder : path
        Where the script, the chain, its bond table and the scene are written.
    replace_existing : bool
        Whether a job that lies there already is replaced.
    **wishes
        As :func:`job_files` takes them: ``plain=True`` for the shortest script,
        ``restartable=True``, ``guards=True``, ``contacts=True`` and ``dump=True`` for what a script
        does besides, ``explain=True`` for comments, ``template``, ``table_range``, ``units``.

    Returns
    -------
    list of pathlib.Path
        The files.

    Raises
    ------
    InputError
        If the folder holds a job already or cannot be made, and what :func:`job_files` raises.

    Examples
    --------
    >>> from chaincor import Scene, write_job
    >>> files = write_job(Scene(particles=10), "first", plain=True, explain=True)
    >>> sorted(path.name for path in files)
    ['bond.table', 'chain.data', 'in.chain', 'scene.toml']
    """
    return _write_files(job_files(scene_given(scene), **wishes), Path(folder), replace_existing)


def job_files(
    scene: Scene,
    *,
    dump: bool = False,
    explain: bool = False,
    table_range: tuple[float, float] | None = None,
    template: OwnTemplate | None = None,
    units: UnitSystem = CHAIN_UNITS,
    plain: bool = False,
    restartable: bool = False,
    guards: bool = False,
    contacts: bool = False,
) -> dict[str, str]:
    """
    Return the files of a job, by name.

    Numerics are chosen for the scene's tolerance, unless it gives them; the script tells its error
    unless the scene says ``error = false``. `dump` has the job dump its motion, as it does where
    the scene has a dump; `restartable`, `guards` and `contacts` add what
    :class:`~chaincor.lammps_inputs.script.Extras` says; `explain` says of every command and file
    what it is for; for `table_range` see :func:`~chaincor.workflows.scripted.plan.plan_script`;
    LAMMPS computes in `units`; `plain` is for the
    shortest script, and so is a template that is a whole script. Raises SceneError if the scheme
    cannot be scripted or the template cannot be used, RunError if no numerics meet the tolerance.
    """
    if not dump and scene.dump is None and "dump_frames" in scene.model_fields_set:
        raise InputError(
            f"dump_frames is {scene.dump_frames!r} and the job dumps nothing; expected --frames "
            "beside it, or neither"
        )
    if scene.bond_file is not None:  # the job lies elsewhere, and its scene names the file
        scene = scene.replace(bond_file=scene.bond_file.resolve())
    scene = scene.replace(engine="lammps")
    if units != CHAIN_UNITS and (scene.velocity or 0.0) > _SUPERSONIC:
        v, style = scene.impact_velocity, units.style
        raise InputError(
            f"velocity is {v:g} in units of the chain, in which sound has 1: that would be "
            f"{v * units.speed:g} in units {style}; expected the chain's units, as [units] is of "
            f"the job alone: {v:g} in units {style} is velocity = {v / units.speed:.6g}"
        )
    whole = template if template is not None and template.whole else None
    if plain and whole is not None:
        raise InputError("--plain and a template that is a whole script; expected either")
    plain = plain or whole is not None
    if plain:
        blocks = {"frames": dump, "a restartable job": restartable, "guards": guards}
        blocks |= {"a list of contacts": contacts, "a template": template is not whole}
        wrong = [name for name, given in blocks.items() if given]
        if wrong:
            kind = "a template that is a whole script" if whole else "a plain script"
            raise InputError(f"{kind} is asked for, and {wrong[0]}; expected either")
        scene = plain_scene(scene)
    plan = plan_script(scene, table_range)
    texts = {
        SCRIPT_FILE: _plain_script(scene, plan, units, whole)
        if plain
        else job_script(
            scene,
            plan.numerics,
            plan.table,
            None if plan.scouting is None else plan.scouting.end,
            Extras(
                restartable,
                guards,
                contacts,
                _frame_time(scene) if dump or scene.dump is not None else None,
            ),
            bar=plan.bar,
            tolerance=plan.tolerance,
            fastest=plan.fastest,
            template=template,
            units=units,
        ),
        DATA_FILE: format_scene_data(scene, units=units),
    }
    if plan.table is not None:
        texts[TABLE_FILE] = plan.table.to_text(units)
    if explain:
        annotate: dict[str, Callable[[str], str]] = {
            SCRIPT_FILE: lambda text: explain_script(
                text, others_own=template is not None, brief=plain
            ),
            DATA_FILE: explain_data,
            TABLE_FILE: explain_table,
        }
        texts = {name: annotate[name](text) for name, text in texts.items()}
    if isinstance(scene.potential, str):
        texts[SCENE_FILE] = _as_run(scene, plan).without("dump_frames").to_toml()
    if units != CHAIN_UNITS:
        texts[UNITS_FILE] = units.to_toml()
    return texts


def _plain_script(
    scene: Scene, plan: ScriptPlan, units: UnitSystem, whole: OwnTemplate | None
) -> str:
    if plan.scouting is None:
        raise SceneError(
            "a plain script is asked for, and no in-house run tells how long this collision "
            "takes; leave --plain out: other scripts look for the end themselves"
        )
    return render_plain(scene, plan.table, plan.scouting.end, approach_time(scene), units, whole)


def _frame_time(scene: Scene) -> float | Literal["contacts"]:
    interval = scene.frame_interval
    return "contacts" if interval is None else interval


def _as_run(scene: Scene, plan: ScriptPlan) -> Scene:
    """Return the scene with what was chosen for it: another run of it takes the same steps."""
    if scene.explicit:
        return scene.replace(scheme=plan.numerics.scheme)
    return scene.replace(
        tolerance=None,
        scheme=plan.numerics.scheme,
        timestep=plan.numerics.timestep,
        table=None if plan.table is None else plan.table.style,
        table_points=None if plan.table is None else plan.table.rows,
    )


def _write_files(texts: dict[str, str], folder: Path, replace_existing: bool) -> list[Path]:
    present = [name for name in texts if (folder / name).exists()]
    if present and not replace_existing:
        raise InputError(
            f"the folder {str(folder)!r} has {', '.join(present)} already; expected a new or empty "
            "folder: give another, or --force to replace the job"
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".partial-", dir=folder) as aside:
            for name, text in texts.items():
                (Path(aside) / name).write_text(text, encoding="utf-8")
            for name in texts:
                shutil.move(Path(aside) / name, folder / name)
    except OSError as error:
        raise InputError(
            f"cannot write the job into {str(folder)!r}: {error.strerror}; give another folder"
        ) from None
    return [folder / name for name in texts]
