"""Implement ``chaincor explore``: write a page that computes collisions."""

from pathlib import Path

import click

from chaincor.workflows.commands.options import PATH, option, say
from chaincor.workflows.pictures.live_page import MOST_PARTICLES, live_page


@click.command()
@option(
    "-o, --output FILE",
    "the page",
    PATH,
    default=Path("explore.html"),
    show_default=True,
)
@option(
    "--particles N",
    "number of particles when the page opens",
    click.IntRange(1, MOST_PARTICLES),
    default=50,
    show_default=True,
)
def explore(output: Path, particles: int) -> None:
    """
    Write a page that computes collisions in the browser while you change their settings.

    In the page, the reader chooses speed, bond, length, masses, target and temperature. Any browser
    opens the page, also without a network.
    """
    from chaincor.analysis.atomic_write import write_whole
    from chaincor.analysis.output_paths import judge_output

    judge_output(output, ".html")
    write_whole(output, live_page(particles))
    say(output)
