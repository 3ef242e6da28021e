"""Implement ``chaincor lessons``: write the lessons as notebooks."""

from pathlib import Path

import click

from chaincor.workflows.commands.options import FOLDER, option, say


@click.command()
@option(
    "-o, --output DIR",
    "folder for the notebooks",
    FOLDER,
    default=Path("lessons"),
    show_default=True,
)
@option("--solutions", "include the solutions, for teachers")
@option("--force", "replace existing notebooks in the folder")
def lessons(output: Path, solutions: bool, force: bool) -> None:
    """
    Write the lessons as notebooks for students: `jupyter lab DIR` opens them.

    The notebooks need no network. `pip install chaincor[notebook]` installs the libraries that
    write and show notebooks.
    """
    from chaincor.analysis.atomic_write import write_whole
    from chaincor.analysis.output_paths import resolve_output
    from chaincor.lammps_inputs.errors import InputError
    from chaincor.workflows.lessons.notebooks import lesson_pages, notebook
    from chaincor.workflows.outputs import make_folder

    made = {
        output / f"{name}.ipynb": notebook(page, solutions=solutions)
        for name, page in lesson_pages().items()
    }
    there = [path for path in made if resolve_output(path).exists()]
    if there and not force:
        raise InputError(
            f"{there[0]} exists already. Give a new folder, or replace the file with --force"
        )
    make_folder(output)
    for path, text in made.items():
        write_whole(path, text)
        say(path)
