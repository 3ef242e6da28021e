"""``chaincor explore``: a page that computes collisions."""

from pathlib import Path

import click

from chaincor.workflows.pictures.live_page import MOST_PARTICLES, live_page


@click.command()
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=Path("explore.html"),
    show_default=True,
    metavar="FILE",
    help="the page",
)
@click.option(
    "--particles",
    type=click.IntRange(1, MOST_PARTICLES),
    default=50,
    show_default=True,
    metavar="N",
    help="length of the chain at first",
)
def explore(output: Path, particles: int) -> None:
    """
    Write a page that computes collisions as you watch, for those who would rather play than read.

    Speed, bond, length, masses, target and temperature are chosen in the page. It holds everything
    it needs: open it in any browser, also without a network.
    """
    from chaincor.analysis.atomic_write import write_whole
    from chaincor.workflows.outputs import refuse_other_kinds

    refuse_other_kinds(output, ".html")
    write_whole(output, live_page(particles))
    click.echo(output)
