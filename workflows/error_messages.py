"""Format the errors of the command line, each as one line on standard error."""

import errno

import click

from chaincor.lammps_inputs.errors import meant
from chaincor.workflows.terminal_text import printable

TERMINATED = "stopped by SIGTERM before the end. Finished results are kept"
_LONGEST_LINE = 700

# A disk counts as full if it has fewer free bytes than this.
_LEAST_ROOM = 2**20


# The system reports these errors for paths that no file can have.
BAD_PATHS = (errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR)
_LONGEST_NAME = 60


def describe_os_error(error: OSError) -> str:
    """Return a message about the file of an OSError, or about a full temporary folder."""
    import shutil
    import tempfile

    reason = error.strerror or str(error) or type(error).__name__
    if error.errno in BAD_PATHS:
        name = str(error.filename or "")
        named = name if len(name) <= _LONGEST_NAME else f"...{name[-_LONGEST_NAME:]}"
        return f"cannot use the file {named!r}: {reason}. Give another path"
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


def explain_pointer(name: str) -> str:
    """Return a hint at `chaincor explain`, which works without the web documentation."""
    return f" (see: chaincor explain {name})"


# Click raises this exception from version 8.2 on; earlier versions print the help themselves.
HELP_WANTED: type | tuple = getattr(click.exceptions, "NoArgsIsHelpError", ())


def usage_message(error: click.ClickException) -> str:
    """Return the message of a usage error; it suggests an option with a similar name."""
    if isinstance(error, click.NoSuchOption) and error.ctx is not None:
        options = [name for p in error.ctx.command.params for name in (*p.opts, *p.secondary_opts)]
        near = meant(error.option_name, [o.removeprefix("--") for o in options if o[:2] == "--"])
        helps = "--help and --help-scene" if "--help-scene" in options else "--help"
        hint = f"See {helps}" if near is None else f"Did you mean '--{near}'?"
        return f"No such option: '{error.option_name}'. {hint}"
    return error.format_message()


def print_error(text: str, end: str = "") -> None:
    """Print an error as one line, and shorten long texts."""
    click.echo(f"chaincor: {printable_line(text)}{end}", err=True)


def printable_line(text: str) -> str:
    """Return a text as one printable line, without the middle part if it is long."""
    line = " ".join(text.split())
    if len(line) > _LONGEST_LINE:
        line = f"{line[: _LONGEST_LINE // 2]} ... {line[-_LONGEST_LINE // 2 :]}"
    return printable(line)
