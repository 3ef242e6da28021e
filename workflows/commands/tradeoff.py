"""``chaincor tradeoff``: error against time, measured."""

from pathlib import Path
from typing import Any

import click

from chaincor.lammps_inputs.scene import FILE_KEYS
from chaincor.workflows.commands.scene_options import SceneCommand, scene_from, scene_options
from chaincor.workflows.json_output import json_text

# A study chooses these itself, and writes none of the files of a single run.
_OWN = ("engine", "wall", "scheme", "timestep", "table", "table_points", "error")

# Of a script of the user's own.
_SCRIPT = ("script", "observable", "vary", "fix", "seeds", "phases", "timeout", "lmp")


@click.command(cls=SceneCommand)
@scene_options(*_OWN, *FILE_KEYS)
@click.option(
    "-o",
    "--output",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="write a page (tradeoff.html) with its figures, CSV and JSON here",
)
@click.option("--quick", is_flag=True, help="fewer settings: some 15 s instead of 90 s")
@click.option(
    "--calibrate",
    is_flag=True,
    help="measure what LAMMPS costs on this machine, for all later runs, and nothing else",
)
@click.option(
    "--script",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="a LAMMPS script of your own instead of a scene",
)
@click.option(
    "--observable",
    metavar="REGEX",
    help="the number that the script prints: a pattern with one group; the last match counts",
)
@click.option(
    "--vary",
    metavar="NAME=FROM:TO:COUNT",
    help="the variable and its ladder, coarse end first, such as timestep=0.01:0.0005:8",
)
@click.option(
    "--fix",
    multiple=True,
    metavar="NAME=VALUE,VALUE",
    help="repeat the ladder at each of these values of another variable",
)
@click.option(
    "--seeds",
    type=int,
    metavar="N",
    help="for scripts with random numbers: so many runs a rung, each with its own -var seed",
)
@click.option("--phases", type=int, metavar="N", help="so many nearby values a rung [default: 8]")
@click.option("--timeout", type=float, metavar="S", help="seconds one run may take [default: 600]")
@click.option("--lmp", metavar="PATH", help="the LAMMPS command [default: the one installed]")
@click.option("--json", "as_json", is_flag=True, help="print one JSON object")
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

    Prints the cheapest setting for each decade of error, the error by cause, and one line of
    advice for the scene's tolerance (1e-6 by default).

    With --script it is `chaincor timestep`, for a LAMMPS script of your own.
    """
    own = {name: options.pop(name) for name in _SCRIPT}
    given_own = [f"--{name}" for name, value in own.items() if value not in (None, ())]
    if own["script"] is not None:
        _tradeoff_script(scene_file, output, quick or calibrate, as_json, own, options)
        return
    if given_own:
        raise click.UsageError(
            f"{', '.join(given_own)} {'belongs' if len(given_own) == 1 else 'belong'} to a LAMMPS "
            "script; expected --script FILE beside it"
        )
    if calibrate:
        given = [name for name, value in options.items() if value is not None]
        given += [
            name
            for name, value in {"SCENE.toml": scene_file, "output": output, "quick": quick}.items()
            if value
        ]
        if given:
            raise click.UsageError(
                f"--calibrate measures the machine and nothing else, so that {', '.join(given)} "
                "would not be used; expected one or the other"
            )
        _calibrate(as_json)
        return
    from chaincor.workflows.study_progress import study_progress
    from chaincor.workflows.tradeoff.description import describe_study
    from chaincor.workflows.tradeoff.page import PAGE
    from chaincor.workflows.tradeoff.study import measure_tradeoff
    from chaincor.workflows.tradeoff.study_files import to_dict, write_study

    scene = scene_from(scene_file, options)
    unused = [key for key in (*_OWN, *FILE_KEYS) if key in scene.model_fields_set]
    if unused:
        click.echo(
            f"chaincor: note: a study measures every setting and writes no files of a single run; "
            f"of the scene it does not use {', '.join(unused)}",
            err=True,
        )
    with study_progress() as progress:
        study = measure_tradeoff(scene, quick=quick, progress=progress)
    if output is not None:
        write_study(study, output)
    if as_json:
        click.echo(json_text(to_dict(study), study.scene))
    else:
        click.echo(describe_study(study))
        if output is not None:
            click.echo(f"page: {output / PAGE}")


def _tradeoff_script(
    scene_file: str | None,
    output: Path | None,
    other: bool,
    as_json: bool,
    own: dict[str, Any],
    options: dict[str, Any],
) -> None:
    from chaincor.workflows.commands.timestep import study_script

    tolerance = options.pop("tolerance")
    given = [name for name, value in options.items() if value is not None]
    given += ["SCENE.toml"] if scene_file is not None else []
    given += ["--quick or --calibrate"] if other else []
    if given:
        raise click.UsageError(
            f"--script runs a script of yours, so that {', '.join(given)} would not be used; "
            "expected one or the other"
        )
    for name in ("observable", "vary"):
        if own[name] is None:
            raise click.UsageError(
                f"--script needs --{name}; expected such as --observable 'restitution = (\\S+)' "
                "--vary timestep=0.01:0.0005:8"
            )
    script = own.pop("script")
    study_script(script, output, as_json, own | {"tolerance": tolerance})
    click.echo("chaincor: note: tradeoff --script is `chaincor timestep`, by an old name", err=True)


def _calibrate(as_json: bool) -> None:
    from dataclasses import asdict

    from chaincor.workflows.accuracy.calibrate import calibrate
    from chaincor.workflows.accuracy.cost_model import user_cost_model_path

    model = calibrate()
    path = user_cost_model_path()
    model.save(path)
    if as_json:
        click.echo(json_text(asdict(model)))
        return
    for name, value in asdict(model).items():
        click.echo(f"{name:<14} {value if isinstance(value, str) else f'{value:.3g} s'}")
    click.echo(f"written to {path}")
