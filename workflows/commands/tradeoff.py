"""Implement ``chaincor tradeoff``: measure error against time."""

from pathlib import Path
from typing import Any

import click

from chaincor.lammps_inputs.scene import FILE_KEYS
from chaincor.workflows.commands.options import (
    json_option,
    option,
    page_option,
    say,
    tell,
    tell_page,
)
from chaincor.workflows.commands.scene_options import SceneCommand, scene_from, scene_options

# These keys are not options of the command, because a study chooses their values itself.
_OWN = ("engine", "wall", "scheme", "timestep", "table", "table_points", "error")


@click.command(cls=SceneCommand)
@scene_options(*_OWN, *FILE_KEYS)
@page_option("tradeoff.html")
@option("--quick", "measure fewer settings, in about 15 s instead of 90 s")
@option(
    "--calibrate", "only measure the speed of LAMMPS on this machine, for forecasts of later runs"
)
@json_option
def tradeoff(
    scene_file: str | None,
    output: Path | None,
    quick: bool,
    calibrate: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """
    Measure error against time for every engine, wall, scheme, step and table.

    The command prints the cheapest setting for each decade of error, the error by cause, and one
    line of advice on the scene's tolerance (1e-6 by default).

    For a LAMMPS script of your own, use `chaincor timestep FILE`.
    """
    if calibrate:
        options |= {"SCENE.toml": scene_file, "output": output, "quick": quick or None}
        given = [name for name, value in options.items() if value is not None]
        if given:
            raise click.UsageError(
                "--calibrate measures only the machine and does not use "
                f"{', '.join(given)}. Leave out one or the other"
            )
        _calibrate(as_json)
        return
    from chaincor.workflows.campaign.progress import study_progress
    from chaincor.workflows.tradeoff import study
    from chaincor.workflows.tradeoff.shown import REPORT, describe_study, to_dict, write_study

    scene = scene_from(scene_file, options)
    unused = [key for key in (*_OWN, *FILE_KEYS) if key in scene.model_fields_set]
    if unused:
        say(
            "chaincor: note: a study chooses its own settings and writes no files "
            "of a single run. It ignores these keys of the scene: "
            f"{', '.join(unused)}",
            err=True,
        )
    if output is not None:
        REPORT.judge(output)
    with study_progress() as progress:
        found = study.tradeoff(scene, quick=quick, progress=progress)
    # The results are printed before the page is written, because the figures of the page may fail.
    tell(to_dict(found), describe_study(found), as_json, found.scene)
    if output is not None:
        write_study(found, output)
        tell_page(output / REPORT.page, as_json)


def _calibrate(as_json: bool) -> None:
    from dataclasses import asdict

    from chaincor.workflows.accuracy.cost_model import calibrate, user_cost_model_path

    model = calibrate()
    path = user_cost_model_path()
    model.save(path)
    lines = [
        f"{name:<14} {value if isinstance(value, str) else f'{value:.3g} s'}"
        for name, value in asdict(model).items()
    ]
    tell(asdict(model), "\n".join([*lines, f"written to {path}"]), as_json)
