"""``chaincor timestep``: find the largest accurate time step of any unedited LAMMPS script."""

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
    "a number that the script prints: a pattern with one group; the last match counts",
)
@option(
    "--tolerance X",
    "largest absolute error allowed in each quantity [default: see `chaincor explain tolerance`]",
    float,
)
@option(
    "--vary NAME=FROM:TO:COUNT",
    "another ladder, coarse end first: a variable of the script, timestep, cutoff, skin or "
    "rows; or seed=N, ranks=1,2,4, lastdigit [default: the script's step, from 2 to 1/4 of it]",
)
@option(
    "--fix NAME=VALUE,VALUE",
    "repeat the ladder at each of these values of another variable",
    multiple=True,
)
@option("--seeds N", "N runs at each value, each with a seed of its own", int)
@option("--phases N", "N runs at nearby values for each value [default: 4]", int)
@option("--scale-periods", "keep the time between outputs that the script counts in steps")
@option("--timeout S", "seconds one run may take [default: 600]", float)
@option("--lmp COMMAND", "the LAMMPS command, such as 'srun lmp' [default: the one installed]")
@page_option("timestep.html", "figure")
@json_option
def timestep(script: Path, output: Path | None, as_json: bool, **options: Any) -> None:
    """
    Say which time step of a LAMMPS script is small enough, without editing it.

    KEYWORD is a thermo keyword, compute or variable (etotal, c_1, v_x), KIND one of mean (over the
    second half of the run), last, drift and fluctuation. Without any: energy drift and fluctuation,
    temperature, potential energy and pressure.

    Each run takes place in a copy of the script's folder, at the same physical time exactly;
    dumps are left out. With --vary the same for a variable, a cutoff, seeds, or processes.
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
    # Print the numbers before the page, because its figures may fail.
    tell(script_study_to_dict(study), describe_script_study(study), as_json)
    if output is not None:
        write_script_study(study, output)
        tell_page(output / REPORT.page, as_json)
