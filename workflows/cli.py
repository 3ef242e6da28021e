"""Read the command line of chaincor, and import only the module of the command that is called."""

import contextlib
import importlib
import os
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType

import click

from chaincor.lammps_inputs.errors import ChaincorError, SceneError, meant
from chaincor.workflows.command_list import COMMANDS, GROUPS
from chaincor.workflows.error_messages import (
    BAD_PATHS,
    HELP_WANTED,
    TERMINATED,
    describe_os_error,
    explain_pointer,
    print_error,
    printable_line,
    usage_message,
)
from chaincor.workflows.memory_limit import memory_is_short


class _LazyGroup(click.Group):
    """Group of commands; the module of a command is imported when the command is called."""

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
    """Exception that SIGTERM raises; batch systems send SIGTERM before they kill a job."""


@contextlib.contextmanager
def _terminable() -> Iterator[None]:
    """Let SIGTERM raise an exception, so that the program removes its temporary files."""
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


# `run_command_line` returns this status if the output could not be written, and this error has
# already been reported.
_OUTPUT_LOST = -1


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit."""
    status = run_command_line(arguments)
    if status == _OUTPUT_LOST:
        sys.exit(1)
    sys.exit(status if _is_printed() else status or 1)


def _is_printed() -> bool:
    """Return whether all output reached standard output; print an error if some was lost."""
    try:
        if sys.stdout is None:
            raise OSError("it is closed")
        sys.stdout.flush()
    except BrokenPipeError:  # A program such as `head`, which reads the pipe, closed it.
        sys.stdout = None
        return False
    except (OSError, ValueError) as error:
        sys.stdout = None
        with contextlib.suppress(OSError, ValueError):
            reason = getattr(error, "strerror", None) or str(error)
            print_error(
                f"cannot print the result to standard output ({reason}). Give an open "
                "file or pipe with free space"
            )
        return False
    return True


# MPI launchers store the number of processes, and the index of each process, in these variables.
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
                print_error(
                    f"MPI started {copies} processes, but a chain runs in one process. Run "
                    "chaincor without mpiexec. For many collisions use `chaincor sweep "
                    "--workers N`",
                    explain_pointer("InputError"),
                )
            return True
    return False


def run_command_line(arguments: list[str] | None) -> int:
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
        if isinstance(error, HELP_WANTED) and isinstance(error, click.UsageError) and error.ctx:
            # Show the help of a command that needs arguments and gets none.
            click.echo(error.ctx.get_help())
            return 0
        print_error(usage_message(error))
        return error.exit_code
    except click.exceptions.Exit as leave:
        return leave.exit_code
    except (click.Abort, KeyboardInterrupt) as error:
        terminated = isinstance(error.__cause__ or error.__context__ or error, _TerminatedError)
        click.echo(f"chaincor: {TERMINATED if terminated else 'interrupted'}", err=True)
        return 143 if terminated else 130
    except ChaincorError as error:
        pointer = explain_pointer(type(error).__name__)
        if type(error).__name__ == "MissingLibraryError" and (short := memory_is_short()):
            print_error(short)
            return error.exit_status
        if isinstance(error, SceneError) and error.mistakes:
            head, *_ = str(error).splitlines()
            print_error(head.removesuffix(":"), f"{pointer}:")
            for mistake in error.mistakes:
                click.echo(f"  {printable_line(mistake)}", err=True)
        else:
            print_error(str(error), pointer)
        return error.exit_status
    except BrokenPipeError:
        return 1
    except MemoryError:
        print_error(
            "the memory of this machine, or the memory limit of this program, is "
            "used up. Take fewer particles, table points or workers"
        )
        return 1
    except ImportError as error:
        print_error(
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
        print_error(memory_is_short() or describe_os_error(error))
        return 2 if error.errno in BAD_PATHS else 1
    return status if isinstance(status, int) else 0
