"""Implement ``chaincor timestep``: find the largest accurate time step of a LAMMPS script."""

from pathlib import Path
from typing import Any

import click

from chaincor.workflows.commands.options import (
    FILE,
    json_option,
    option,
    page_option,
    tell,
    tell_page,
)


@click.command()
@click.argument("script", type=FILE)
@click.argument("quantities", nargs=-1, metavar="[KEYWORD[:KIND]] ...")
@option(
    "--observable REGEX",
    "read a number that the script prints, by a pattern with one group; the last match counts",
)
@option(
    "--tolerance X",
    "largest absolute error allowed in each quantity [default: see `chaincor explain tolerance`]",
    float,
)
@option(
    "--vary NAME=FROM:TO:COUNT",
    "vary another setting, coarsest value first: a variable of the script, timestep, cutoff, skin "
    "or rows; or seed=N, ranks=1,2,4, lastdigit [default: the time step, from 2 times to 1/4 of "
    "the script's step]",
)
@option(
    "--fix NAME=VALUE,VALUE",
    "repeat the study at each of these values of another variable",
    multiple=True,
)
@option("--seeds N", "make N runs at each value, each with its own random seed", int)
@option("--phases N", "for each value, make N runs at nearby values [default: 4]", int)
@option(
    "--scale-periods",
    "scale intervals that the script counts in steps, so that outputs keep their times",
)
@option("--timeout S", "time limit of each run, in seconds [default: 600]", float)
@option("--lmp COMMAND", "LAMMPS command, such as 'srun lmp' [default: the installed one]")
@page_option("timestep.html", "figure")
@json_option
def timestep(script: Path, output: Path | None, as_json: bool, **options: Any) -> None:
    """
    Find the largest accurate time step of a LAMMPS script, without editing it.

    KEYWORD is a thermo keyword, compute or variable (etotal, c_1, v_x). KIND is mean (over the
    second half of the run), last, drift or fluctuation. By default, the study covers temperature,
    potential energy, pressure, and the drift and fluctuation of the total energy. With a
    thermostat, econserve replaces the total energy if LAMMPS counts the exchanged energy;
    otherwise the drift is left out.

    Each run uses a copy of the script's folder, covers the same physical time exactly, and writes
    no dumps. With --vary, the study varies a variable, a cutoff, seeds or the number of processes
    instead of the time step.
    """
    from chaincor.workflows.campaign.progress import study_progress
    from chaincor.workflows.scripts.description import describe_script_study
    from chaincor.workflows.scripts.study import timestep_study
    from chaincor.workflows.scripts.study_files import (
        REPORT,
        script_study_to_dict,
        write_script_study,
    )

    given = {name: value for name, value in options.items() if value is not None}
    if output is not None:
        REPORT.judge(output)
    with study_progress() as progress:
        study = timestep_study(script, **given, progress=progress)
    # The results are printed before the page is written, because the figures of the page may fail.
    tell(script_study_to_dict(study), describe_script_study(study), as_json)
    if output is not None:
        write_script_study(study, output)
        tell_page(output / REPORT.page, as_json)
