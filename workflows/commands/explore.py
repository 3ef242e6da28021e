"""``chaincor explore``: a page with sliders."""

from pathlib import Path

import click


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
    type=click.IntRange(2, 60),
    default=20,
    show_default=True,
    metavar="N",
    help="length of the chain",
)
def explore(output: Path, particles: int) -> None:
    """
    Write a page with sliders for speed and potential, for those who would rather play than read.

    The page holds everything it needs: open it in any browser, also without a network.
    """
    from rich.console import Console
    from rich.progress import Progress

    from chaincor.analysis.atomic_write import written_aside
    from chaincor.workflows.pictures.sliders import explore_page

    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task("computing collisions")
        page = explore_page(
            particles, progress=lambda done, all_: bar.update(task, completed=done, total=all_)
        )
    with written_aside(output) as aside:
        aside.write_text(page, encoding="utf-8")
    click.echo(output)
