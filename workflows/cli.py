"""Read the command line of chaincor, and import only the module of the command that is called."""

import contextlib
import errno
import importlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType
from typing import NamedTuple

import click

from chaincor.lammps_inputs.errors import ChaincorError, SceneError, meant
from chaincor.workflows.memory_limit import memory_is_short
from chaincor.workflows.terminal_text import printable


class CommandFacts(NamedTuple):
    """Help and libraries of a command, listed here so that its module need not be imported."""

    help: str  #: One line of help. ``chaincor --help`` prints it without importing any command.
    #: The command always uses these libraries, and each may be missing or fail to load. Numba is
    #: named even though compiled loops come from a cache.
    needs: tuple[str, ...]
    #: The command needs each of these libraries only for the uses named here.
    also: dict[str, str] = {}  # noqa: RUF012 - never changed


_REFERENCE = ("numba",)
_SOME_SCENES = {
    "scipy": "harmonic chains, chains with a temperature, your own bonds, the highest speeds"
}
_BY_LAMMPS = {"lammps": "engine lammps", "jinja2": "engine lammps"}

# tests/workflows/commands/test_needs.py compares this list with the imports of the commands.
COMMANDS = {
    "run": CommandFacts(
        "Run one collision and print its restitution with an error bar.",
        _REFERENCE,
        {
            **_BY_LAMMPS,
            "rich": "more than two seconds",
            **_SOME_SCENES,
            "matplotlib": "--animate",
        },
    ),
    "inputs": CommandFacts(
        "Write a self-contained LAMMPS job, or a grid of them.", (*_REFERENCE, "jinja2")
    ),
    "collect": CommandFacts("Read the logs of a grid of LAMMPS jobs into a store.", ()),
    "analyze": CommandFacts(
        "Turn the dump of a LAMMPS job into restitution, contacts, modes and plots.",
        ("jinja2", "rich"),
        {
            "scipy": "unequal masses, contacts between frames, .traj",
            "matplotlib": "-o, --animation",
            "ase": "extended XYZ and .traj",
            "MDAnalysis": "TRR and NetCDF",
        },
    ),
    "validate": CommandFacts(
        "Compare LAMMPS, the reference engine and your own integrator.",
        ("lammps", "jinja2", *_REFERENCE),
        {**_SOME_SCENES, "matplotlib": "--plot"},
    ),
    "tradeoff": CommandFacts(
        "Measure the error and the time of every setting for a scene.",
        ("lammps", "jinja2", *_REFERENCE, "rich"),
        {"matplotlib": "-o"},
    ),
    "timestep": CommandFacts(
        "Find the largest accurate time step of a LAMMPS script, without editing it.",
        ("jinja2", "rich", "scipy"),
        {"matplotlib": "-o"},
    ),
    "table": CommandFacts(
        "Measure how exact LAMMPS's table of a bond, an angle or a pair is.",
        ("scipy",),
    ),
    "sweep": CommandFacts(
        "Run many collisions into a store. A stopped sweep can be resumed.",
        (*_REFERENCE, "rich"),
        {**_BY_LAMMPS, **_SOME_SCENES, "distributed": "--scheduler"},
    ),
    "show": CommandFacts("Show a store of results as a table.", ()),
    "plot": CommandFacts("Draw curves or a heat map from a store.", ("matplotlib",)),
    "store": CommandFacts(
        "Merge stores, or export one to CSV, Parquet or an RO-Crate.",
        (),
        {"pandas": "export to Parquet", "pyarrow": "export to Parquet", "rocrate": "--rocrate"},
    ),
    "explore": CommandFacts("Write a page that computes collisions as you watch.", ("jinja2",)),
    "reproduce": CommandFacts(
        "Recompute the paper's curves.",
        ("lammps", "jinja2", *_REFERENCE, "scipy", "matplotlib", "rich"),
        {"rocrate": "--rocrate"},
    ),
    "lessons": CommandFacts(
        "Write the lessons as notebooks, with or without solutions.", ("jupytext",)
    ),
    "check-script": CommandFacts(
        "List what a student's LAMMPS script of the chain lacks.",
        (),
        dict.fromkeys(("lammps", *_REFERENCE, "scipy"), "a script without faults"),
    ),
    "explain": CommandFacts(
        "Explain an error or a word in the results, and what to do about it.", ()
    ),
    "doctor": CommandFacts(
        "Check whether this machine can run chaincor, and list missing libraries.",
        (),
    ),
}


# ``chaincor --help`` shows the commands by task.
GROUPS = {
    "Any LAMMPS script or table": ("timestep", "table", "check-script"),
    "One collision": ("run", "validate", "tradeoff"),
    "Many collisions": ("sweep", "show", "plot", "store"),
    "LAMMPS jobs": ("inputs", "collect", "analyze"),
    "Teaching and the paper": ("explore", "lessons", "reproduce"),
    "Help": ("explain", "doctor"),
}
_LONGEST_LINE = 700


class _LazyGroup(click.Group):
    """Group of commands that imports a command's module in ``commands/`` when it is called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module_name = cmd_name.replace("-", "_")
        module = importlib.import_module(f"chaincor.workflows.commands.{module_name}")
        return getattr(module, module_name)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        for title, names in GROUPS.items():
            with formatter.section(title):
                formatter.write_dl([(name, COMMANDS[name].help) for name in names])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            known = ", ".join(COMMANDS)
            near = meant(args[0], COMMANDS)
            hint = "" if near is None else f"Did you mean '{near}'? "
            raise click.UsageError(f"there is no command '{args[0]}'. {hint}Use one of {known}")
        return super().resolve_command(ctx, args)


def _print_version(ctx: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if value and not ctx.resilient_parsing:
        from chaincor.workflows.versions import versions

        for name, version in versions().items():
            click.echo(f"{name} {version}")
        ctx.exit()


@click.group(
    cls=_LazyGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.option(
    "--version",
    is_flag=True,
    expose_value=False,
    is_eager=True,
    callback=_print_version,
    help="Print the versions of chaincor and its libraries.",
)
def program() -> None:
    """How much energy a one-dimensional chain keeps when it hits a wall."""


class _TerminatedError(KeyboardInterrupt):
    """Exception for SIGTERM, which batch systems send before they kill; it acts like Ctrl-C."""


@contextlib.contextmanager
def _terminable() -> Iterator[None]:
    """End the program as an exception on SIGTERM, so that it removes temporary files."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def leave(_number: int, _frame: FrameType | None) -> None:
        raise _TerminatedError

    before = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


# `_run` returns this status if the output was lost and the error is already printed.
_OUTPUT_LOST = -1


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit."""
    status = _run(arguments)
    if status == _OUTPUT_LOST:
        sys.exit(1)
    sys.exit(status if _is_printed() else status or 1)


def _is_printed() -> bool:
    """Return whether all output reached standard output; print an error if it did not."""
    try:
        if sys.stdout is None:
            raise OSError("it is closed")
        sys.stdout.flush()
    except BrokenPipeError:  # A reader such as `head` closed the pipe.
        sys.stdout = None
        return False
    except (OSError, ValueError) as error:
        sys.stdout = None
        with contextlib.suppress(OSError, ValueError):
            reason = getattr(error, "strerror", None) or str(error)
            _complain(
                f"cannot print the result to standard output ({reason}). Give an open "
                "file or pipe with free space"
            )
        return False
    return True


# MPI launchers store the number of processes and the index of each process in these variables.
_LAUNCHERS = (("PMI_SIZE", "PMI_RANK"), ("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"))


def _refuse_copies() -> bool:
    """
    Return whether MPI started several processes, which cannot share a chain.

    Only the first process prints the error.
    """
    for size, rank in _LAUNCHERS:
        copies = os.environ.get(size, "1")
        if copies.isdecimal() and int(copies) > 1:
            if os.environ.get(rank, "0") == "0":
                _complain(
                    f"MPI started {copies} processes, but a chain runs in one process. Run "
                    "chaincor without mpiexec. For many collisions use `chaincor sweep "
                    "--workers N`",
                    _pointer("InputError"),
                )
            return True
    return False


_TERMINATED = "stopped by SIGTERM before the end. Finished results are kept"


def _run(arguments: list[str] | None) -> int:
    """
    Run the command line and return its exit status.

    The status is 0 for success, 1 for a failed run or validation, 2 for bad input, 130 after
    Ctrl-C, and 143 after SIGTERM.
    """
    if _refuse_copies():
        return 2
    try:
        with _terminable():
            status = program.main(args=arguments, prog_name="chaincor", standalone_mode=False)
    except click.ClickException as error:
        if isinstance(error, _HELP_WANTED) and isinstance(error, click.UsageError) and error.ctx:
            # A command that needs arguments and gets none shows its help.
            click.echo(error.ctx.get_help())
            return 0
        _complain(_with_hint(error))
        return error.exit_code
    except click.exceptions.Exit as leave:
        return leave.exit_code
    except (click.Abort, KeyboardInterrupt) as error:
        terminated = isinstance(error.__cause__ or error.__context__ or error, _TerminatedError)
        click.echo(f"chaincor: {_TERMINATED if terminated else 'interrupted'}", err=True)
        return 143 if terminated else 130
    except ChaincorError as error:
        pointer = _pointer(type(error).__name__)
        if type(error).__name__ == "MissingLibraryError" and (short := memory_is_short()):
            _complain(short)
            return error.exit_status
        if isinstance(error, SceneError) and error.mistakes:
            head, *_ = str(error).splitlines()
            _complain(head.removesuffix(":"), f"{pointer}:")
            for mistake in error.mistakes:
                click.echo(f"  {_printable(mistake)}", err=True)
        else:
            _complain(str(error), pointer)
        return error.exit_status
    except BrokenPipeError:
        return 1
    except MemoryError:
        _complain(
            "the memory of this machine, or the memory limit of this program, is "
            "used up. Take fewer particles, table points or workers"
        )
        return 1
    except ImportError as error:
        _complain(
            memory_is_short()
            or (
                f"a library does not load: {error}. Run `chaincor doctor`, or raise the "
                "memory limit of this program"
            )
        )
        return 1
    except OSError as error:
        if error.filename is None and not _is_printed():
            return _OUTPUT_LOST
        _complain(memory_is_short() or _what_failed(error))
        return 1
    return status if isinstance(status, int) else 0


# A folder with fewer free bytes is too full for temporary files.
_LEAST_ROOM = 2**20


def _what_failed(error: OSError) -> str:
    """Return a message about the file of an error, or about a full folder for temporary files."""
    import shutil
    import tempfile

    reason = error.strerror or str(error) or type(error).__name__
    if error.filename:
        return f"cannot use the file {error.filename!r}: {reason}"
    try:
        folder = tempfile.gettempdir()
        is_full = shutil.disk_usage(folder).free < _LEAST_ROOM
    except OSError:
        return (
            f"there is no folder for temporary files ({reason}). Set TMPDIR to a "
            "folder with free space"
        )
    if error.errno in (errno.ENOSPC, errno.EDQUOT) and is_full:
        return (
            f"cannot write temporary files into {folder!r}: {reason}. Set TMPDIR to another folder"
        )
    return f"cannot use the file, or standard output: {reason}"


def _pointer(name: str) -> str:
    """Return a pointer to `chaincor explain`, which works without the web documentation."""
    return f" (see: chaincor explain {name})"


# Click raises this exception from version 8.2 on. Earlier versions print the help themselves.
_HELP_WANTED: type | tuple = getattr(click.exceptions, "NoArgsIsHelpError", ())


def _with_hint(error: click.ClickException) -> str:
    """Return the message of a usage error, and suggest an option with a similar name."""
    if isinstance(error, click.NoSuchOption) and error.ctx is not None:
        options = [name for p in error.ctx.command.params for name in (*p.opts, *p.secondary_opts)]
        near = meant(error.option_name, [o.removeprefix("--") for o in options if o[:2] == "--"])
        helps = "--help and --help-scene" if "--help-scene" in options else "--help"
        hint = f"See {helps}" if near is None else f"Did you mean '--{near}'?"
        return f"No such option: '{error.option_name}'. {hint}"
    return error.format_message()


def _complain(text: str, end: str = "") -> None:
    """Print an error as one line, and shorten long texts."""
    click.echo(f"chaincor: {_printable(text)}{end}", err=True)


def _printable(text: str) -> str:
    line = " ".join(text.split())
    if len(line) > _LONGEST_LINE:
        line = f"{line[: _LONGEST_LINE // 2]} ... {line[-_LONGEST_LINE // 2 :]}"
    return printable(line)
