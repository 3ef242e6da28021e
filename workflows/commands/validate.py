"""Implement ``chaincor validate``: compare a result with the reference engine."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from chaincor.analysis.output_paths import judge_output
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import NUMERICS_KEYS, OUTPUT_KEYS
from chaincor.workflows.commands.options import POSITIVE, json_option, option, tell
from chaincor.workflows.commands.scene_options import SceneCommand, scene_from, scene_options
from chaincor.workflows.outputs import PICTURES, PICTURES_SAID
from chaincor.workflows.validation.user_integrator import USER_TIMEOUT

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene
    from chaincor.workflows.validation.comparison import Validation


@click.command(cls=SceneCommand)
@scene_options("engine", *OUTPUT_KEYS)
@option(
    "--against MODULE:FUNCTION|FILE|DIR",
    "what to compare: your integrator as MODULE:FUNCTION (chaincor runs its code), the output of "
    "your integrator as CSV or NPZ, or your own LAMMPS result, which is a job's folder, a dump, "
    "or a log with a line 'restitution = '",
)
@option(
    "--timeout S", f"time limit of your function, in seconds [default: {USER_TIMEOUT:g}]", POSITIVE
)
@option(
    "--grid",
    "compare the results for a grid of potentials, chain lengths and speeds; for LAMMPS also "
    "masses, free targets, soft contacts and compressed chains",
)
@option(
    "--ladder",
    "measure the order of the error of your function, at --timestep and 5 successive halvings",
)
@option("--template", "print an example integrator for --against mine:collide, and exit")
@option("--plot FILE", "draw the differences and their error bars, as PNG, PDF or SVG")
@json_option
def validate(
    scene_file: str | None,
    against: str | None,
    timeout: float | None,
    grid: bool,
    ladder: bool,
    template: bool,
    plot: str | None,
    as_json: bool,
    **options: Any,
) -> None:
    """
    Compare LAMMPS, or your own integrator, with the reference engine.

    The exit status is 1 if the results differ by more than the sum of their error bars.
    """
    from chaincor.workflows.campaign.progress import progress_bar
    from chaincor.workflows.validation import comparison
    from chaincor.workflows.validation.grid import grid_around
    from chaincor.workflows.validation.lammps_result import is_lammps_result
    from chaincor.workflows.validation.user_comparison import climb_ladder, validate_user

    if template:
        from importlib.resources import files

        text = files("chaincor.workflows.validation").joinpath("templates/integrator.py.txt")
        click.echo(text.read_text(encoding="utf-8"), nl=False)
        return
    if plot is not None:
        if Path(plot).suffix not in PICTURES:
            raise click.UsageError(
                f"--plot is '{plot}', which ends in '{Path(plot).suffix}'. Give {PICTURES_SAID}"
            )
        judge_output(Path(plot), Path(plot).suffix)
    is_function = ":" in (against or "")
    if timeout is not None and not is_function:
        raise click.UsageError("--timeout limits your own function. Add --against MODULE:FUNCTION")
    scene = scene_from(scene_file, options)
    if ladder:
        if against is None or not is_function or grid or plot is not None:
            raise click.UsageError(
                "--ladder needs your own function and no --grid or --plot. Give "
                "--against MODULE:FUNCTION --timestep H"
            )
        climbed = climb_ladder(scene, against, timeout or USER_TIMEOUT)
        tell(climbed.to_dict(), repr(climbed), as_json, scene)
        return
    if against is not None and not is_function and scene.explicit:
        given = [key for key in NUMERICS_KEYS if getattr(scene, key) is not None]
        raise click.UsageError(
            f"'{against}' holds results, on which {', '.join(given)} have no "
            "effect. Leave out these options"
        )
    own = sorted(scene.model_fields_set - {"tolerance", *NUMERICS_KEYS})
    if grid and own:
        raise click.UsageError(
            f"--grid chooses its own chains and does not use {', '.join(own)}. "
            "Leave out one or the other"
        )
    if grid and is_lammps_result(against):
        raise click.UsageError(
            f"--grid runs many scenes, and '{against}' holds one result. Leave out --grid"
        )
    # A user's integrator may not support masses, targets or soft contacts. The grid for it has none
    # of these.
    scenes = grid_around(scene, bodies=against is None) if grid else [scene]
    results = []
    with progress_bar(grid, len(scenes), 0.0) as advance:
        for each in scenes:
            if against is None:
                results.append(comparison.validate(each))
            elif is_lammps_result(against):
                is_given = bool(own) or scene_file is not None
                results.append(_validate_result(each, against, is_given))
            else:
                results.append(validate_user(each, against, timeout=timeout or USER_TIMEOUT))
            advance(0.0, 1)
    good = sum(result.agrees for result in results)
    agrees = good == len(results)
    said = [repr(result) for result in results]
    if len(results) > 1:
        said.append(f"{good} of {len(results)} scenes agree")
    plain = {"agrees": agrees, "validations": [result.to_dict() for result in results]}
    tell(plain, "\n\n".join(said), as_json)
    if plot is not None:
        from chaincor.workflows.validation.drawing import save_validation_plot

        save_validation_plot(results, Path(plot))
    if not agrees:
        raise click.exceptions.Exit(1)


def _validate_result(scene: "Scene", against: str, is_given: bool) -> "Validation":
    """
    Compare a LAMMPS result with the reference engine.

    By default, the scene is read from the files beside the result.
    """
    from chaincor.workflows.validation.lammps_result import read_lammps_result, validate_result

    found = read_lammps_result(against)
    if is_given:
        return validate_result(scene, found)
    if found.scene is None:
        raise InputError(
            f"no file beside '{against}' describes the scene of that run"
            + (f" of {found.particles} particles" if found.particles else "")
            + (
                ". Give SCENE.toml, or options such as --potential lj --particles "
                f"{found.particles or 100} --velocity V"
            )
        )
    own = found.scene.without(*NUMERICS_KEYS).replace(tolerance=scene.tolerance)
    return validate_result(own, found)
