"""Command line of chaincor: one module per command, imported only when it is called."""

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
    """Help and libraries of a command, known before it is imported."""

    help: str  #: One line, so that ``chaincor --help`` need not import any command.
    #: Libraries that the command always uses and that may be missing or fail to load. Numba is
    #: named even though loops from the cache are loaded without it.
    needs: tuple[str, ...]
    #: Libraries that only some uses need, with these uses.
    also: dict[str, str] = {}  # noqa: RUF012 - never changed


_IN_HOUSE = ("numba",)
_SOME_SCENES = {"scipy": "harmonic and warm chains, bonds of yours, the highest speeds"}
_BY_LAMMPS = {"lammps": "engine lammps", "jinja2": "engine lammps"}

# tests/workflows/commands/test_needs.py compares these libraries with those that commands import.
COMMANDS = {
    "run": CommandFacts(
        "Run one collision and print its restitution with an error bar.",
        _IN_HOUSE,
        {
            **_BY_LAMMPS,
            "rich": "more than two seconds",
            **_SOME_SCENES,
            "matplotlib": "--animate",
        },
    ),
    "inputs": CommandFacts(
        "Write a self-contained LAMMPS job, or a grid of them.", (*_IN_HOUSE, "jinja2")
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
        "Compare LAMMPS, the reference engine and your own.",
        ("lammps", "jinja2", *_IN_HOUSE),
        {**_SOME_SCENES, "matplotlib": "--plot"},
    ),
    "tradeoff": CommandFacts(
        "Measure the error and the time of every setting for a scene.",
        ("lammps", "jinja2", *_IN_HOUSE, "rich"),
        {"matplotlib": "-o"},
    ),
    "timestep": CommandFacts(
        "Say which time step is small enough for a LAMMPS script, which stays as it is.",
        ("jinja2", "rich", "scipy"),
        {"matplotlib": "-o"},
    ),
    "table": CommandFacts(
        "Say how exact a LAMMPS table of a bond, an angle or a pair is.",
        ("scipy",),
    ),
    "sweep": CommandFacts(
        "Run many collisions into a store, resumable.",
        (*_IN_HOUSE, "rich"),
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
        ("lammps", "jinja2", *_IN_HOUSE, "scipy", "matplotlib", "rich"),
        {"rocrate": "--rocrate"},
    ),
    "lessons": CommandFacts(
        "Write the lessons as notebooks, with their solutions or without.", ("jupytext",)
    ),
    "check-script": CommandFacts(
        "Say what a student's LAMMPS script of the chain lacks.",
        (),
        dict.fromkeys(("lammps", *_IN_HOUSE, "scipy"), "a script without faults"),
    ),
    "explain": CommandFacts(
        "Explain a word that results print, or an error, and what to do about it.", ()
    ),
    "doctor": CommandFacts(
        "Say whether this machine can run chaincor, what is missing, and which commands need it.",
        (),
    ),
}


# Commands by task, as ``chaincor --help`` shows them.
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
            hint = "" if near is None else f"did you mean '{near}'? "
            raise click.UsageError(
                f"there is no command '{args[0]}'; {hint}expected one of {known}"
            )
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
    """SIGTERM, which batch systems send before they kill; it unwinds the program like Ctrl-C."""


@contextlib.contextmanager
def _terminable() -> Iterator[None]:
    """Let SIGTERM unwind the program, which removes temporary files and keeps finished results."""
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


# Status of a command whose output is lost, which has been reported.
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
    except BrokenPipeError:  # the reader, such as `head`, closed the pipe
        sys.stdout = None
        return False
    except (OSError, ValueError) as error:
        sys.stdout = None
        with contextlib.suppress(OSError, ValueError):
            reason = getattr(error, "strerror", None) or str(error)
            _complain(f"cannot print to standard output ({reason}); the result is lost")
        return False
    return True


# Environment variables in which MPI launchers store the number of copies and the index of a copy.
_LAUNCHERS = (("PMI_SIZE", "PMI_RANK"), ("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"))


def _refuse_copies() -> bool:
    """
    Return whether MPI started several copies, which cannot share a chain.

    Only the first copy prints the error.
    """
    for size, rank in _LAUNCHERS:
        copies = os.environ.get(size, "1")
        if copies.isdecimal() and int(copies) > 1:
            if os.environ.get(rank, "0") == "0":
                _complain(
                    f"MPI started {copies} processes, but a chain runs in one. Leave mpiexec out, "
                    "and give many collisions to `chaincor sweep --workers N`",
                    _pointer("InputError"),
                )
            return True
    return False


_TERMINATED = "terminated from outside (SIGTERM) before it was done; what is complete is kept"


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
            # A command without arguments shows its help, as with --help.
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
            "the machine's memory, or the memory limit of this program, is used up. Take "
            "fewer particles, table points or workers"
        )
        return 1
    except ImportError as error:
        _complain(
            memory_is_short()
            or (
                f"a library does not load: {error}. See `chaincor doctor`, or raise the memory "
                "limit of this program"
            )
        )
        return 1
    except OSError as error:
        if error.filename is None and not _is_printed():
            return _OUTPUT_LOST
        _complain(memory_is_short() or _what_failed(error))
        return 1
    return status if isinstance(status, int) else 0


# Least free bytes of a folder for temporary files.
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
        return f"there is no folder for temporary files ({reason}); set TMPDIR to one with room"
    if error.errno in (errno.ENOSPC, errno.EDQUOT) and is_full:
        return f"cannot write temporary files into {folder!r}: {reason}; set TMPDIR to another"
    return f"cannot use the file, or standard output: {reason}"


def _pointer(name: str) -> str:
    """Return a pointer to the explanation of an error by the program, which is always installed."""
    return f" (see: chaincor explain {name})"


# Raised by click 8.2 and later. Earlier versions print the help themselves.
_HELP_WANTED: type | tuple = getattr(click.exceptions, "NoArgsIsHelpError", ())


def _with_hint(error: click.ClickException) -> str:
    """Return the message of a usage error, with the option that was probably meant."""
    if isinstance(error, click.NoSuchOption) and error.ctx is not None:
        options = [name for p in error.ctx.command.params for name in (*p.opts, *p.secondary_opts)]
        near = meant(error.option_name, [o.removeprefix("--") for o in options if o[:2] == "--"])
        helps = "--help and --help-scene" if "--help-scene" in options else "--help"
        hint = f"see {helps}" if near is None else f"did you mean '--{near}'?"
        return f"No such option: '{error.option_name}'; {hint}"
    return error.format_message()


def _complain(text: str, end: str = "") -> None:
    """Print an error as one line; line ends are replaced, and long texts are shortened."""
    click.echo(f"chaincor: {_printable(text)}{end}", err=True)


def _printable(text: str) -> str:
    line = " ".join(text.split())
    if len(line) > _LONGEST_LINE:
        line = f"{line[: _LONGEST_LINE // 2]} ... {line[-_LONGEST_LINE // 2 :]}"
    return printable(line)
