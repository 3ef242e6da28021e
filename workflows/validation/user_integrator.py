"""
Call a user's Python function with a scene in a separate process, or read its result.

Results are read from CSV and NPZ files.
"""

import csv
import importlib
import pickle
import sys
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from traceback import extract_tb
from typing import Any

import numpy as np

from chaincor.lammps_inputs.arrays import Array
from chaincor.lammps_inputs.errors import InputError, one_line
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.small_file import refuse_device
from chaincor.workflows.campaign.pool import ProcessPool, sent
from chaincor.workflows.errors import ChaincorError, RunError, WorkerDiedError

# By default, a user's function may take this many seconds.
USER_TIMEOUT = 600.0


class UserIntegratorError(RunError):
    """Failure of the user's integrator: an error, a timeout, or an unusable result."""


@dataclass(frozen=True)
class UserOutcome:
    """Result of a user's integrator."""

    #: Velocities after the last contact, from which eta is computed, of shape (n,).
    velocities: Array
    #: Displacements right after the last contact, for mode energies, of shape (n,); None if not
    #: given.
    displacements: Array | None = None
    #: Times of all contacts, counted from the first contact, of shape (contacts,); None if not
    #: given.
    contact_times: Array | None = None
    #: Speeds of all contacts, of shape (contacts,); None if not given.
    contact_speeds: Array | None = None
    #: Velocities of a free target along x, from the contact outward, of shape (M,); None for a
    #: wall.
    target_velocities: Array | None = None
    #: Displacements of the target, of shape (M,); None if not given.
    target_displacements: Array | None = None


_ARRAYS = tuple(field.name for field in fields(UserOutcome))


def run_user_integrator(against: str, scene: Scene, timeout: float) -> UserOutcome:
    """
    Call ``module:function`` with the scene, or read a CSV or NPZ file.

    The function runs in a separate process. Its argument is a
    :class:`~chaincor.lammps_inputs.scene.Scene`. This scene has a `velocity` in absolute units
    instead of a `speed`. Masses, a target, a soft contact and the initial state are in
    ``scene.line`` (a :class:`~chaincor.lammps_inputs.line.Line`).

    The function returns the final velocities (array of shape (n,)), or a mapping with the key
    ``velocities`` and optionally ``displacements``, ``contact_times`` and ``contact_speeds``. For a
    free target, the mapping must have ``target_velocities`` and may have ``target_displacements``.
    If a path ends in .csv or .npz, the result is read from this file. Results must be finite and
    have the right shape.

    Raise InputError if the function or the file does not exist, or if the module cannot be
    imported. Raise UserIntegratorError if the function raises an error, takes longer than `timeout`
    seconds, dies, or returns anything else.
    """
    if against.lower().endswith((".csv", ".npz")):
        return _checked(against, _read_file(Path(against)), scene)
    module, _, function = against.partition(":")
    if not module or not function or module.endswith(".py"):
        likely = f", such as {module[:-3]}:{function or 'function'}"
        raise InputError(
            f"--against is {against!r}. Give "
            f"module:function{(likely if module.endswith('.py') else '')}, or a file that "
            "ends in .csv or .npz"
        )
    return _checked(against, _call(module, function, scene, timeout), scene)


def _call(module: str, function: str, scene: Scene, timeout: float) -> dict[str, Any]:
    name = f"{module}:{function}"
    with sent("the scene", name, UserIntegratorError):
        pickle.dumps(scene)
    pool = ProcessPool(1)
    try:
        working = pool.submit(_work, module, function, scene, str(Path.cwd()))
        found = working.result(timeout)
    except TimeoutError:
        raise UserIntegratorError(
            f"{name} did not return within {timeout:g} s. Give a smaller scene, or "
            "more time with --timeout"
        ) from None
    except WorkerDiedError:
        raise UserIntegratorError(
            f"{name} ended its process before it returned. Return the final velocities"
        ) from None
    finally:
        pool.shutdown(wait=False)
    if isinstance(found, ChaincorError):
        raise found
    return found


def _work(module: str, function: str, scene: Scene, folder: str) -> dict[str, Any] | ChaincorError:
    """
    Run the user's function in the child process.

    The user's module is searched in the current folder first.
    """
    sys.path.insert(0, folder)
    try:
        integrate = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError) as error:
        return InputError(
            f"cannot find {module}:{function}: {one_line(error)[:200]}. Give a function of "
            "a module on the Python path or in this folder"
        )
    except (Exception, SystemExit) as error:  # The import of a user's module can raise any error.
        return InputError(
            f"cannot import {module}: {_with_line(error, module)}. Correct the module, and "
            f"define the function {function} in it"
        )
    try:
        return _plain(integrate(_with_velocity(scene)))
    except Exception as error:  # A user's code can raise any error.
        return UserIntegratorError(f"{module}:{function} raised {_with_line(error, module)}")


def _with_line(error: BaseException, module: str) -> str:
    """Describe an error in one line, with the line of the user's module that raised it."""
    said = f"{type(error).__name__}: {one_line(error)[:200]}"
    if isinstance(error, SyntaxError):
        return said
    name = f"{module.rsplit('.', 1)[-1]}.py"
    frames = [f for f in extract_tb(error.__traceback__) if Path(f.filename).name == name]
    if not frames:
        return said
    return f"{said} ({name}, line {frames[-1].lineno}: {(frames[-1].line or '')[:80]})"


def _with_velocity(scene: Scene) -> Scene:
    """Return a scene with `velocity` instead of `speed`, if the scene has a single velocity."""
    if scene.velocity is not None or scene.problem.comes_moving:
        return scene
    return scene.replace(speed=None, velocity=scene.impact_velocity)


def _plain(value: Any) -> dict[str, Any]:
    """Convert a result to plain values, which can be unpickled without the user's code."""
    if isinstance(value, Mapping):
        return {
            str(key): np.asarray(inner, dtype=float).tolist()
            for key, inner in value.items()
            if str(key) in _ARRAYS and inner is not None
        }
    return {"velocities": np.asarray(value, dtype=float).tolist()}


def _read_file(path: Path) -> dict[str, Any]:
    refuse_device(path)
    try:
        if path.suffix.lower() == ".npz":
            with path.open("rb") as data, np.load(data, allow_pickle=False) as file:
                return {name: file[name] for name in _ARRAYS if name in file.files}
        with path.open(newline="", encoding="utf-8") as text:
            rows = list(csv.DictReader(text))
    except (OSError, ValueError, EOFError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or "it is damaged"
        raise InputError(
            f"cannot read {str(path)!r} ({reason}). Give a readable CSV or NPZ file"
        ) from None
    except Exception as error:  # A damaged archive can raise many errors from zipfile and zlib.
        raise InputError(
            f"cannot read {str(path)!r} ({type(error).__name__}). Give a readable CSV or NPZ file"
        ) from None
    columns = {"velocity": "velocities", "displacement": "displacements"}
    try:
        return {
            name: [float(row[column]) for row in rows]
            for column, name in columns.items()
            if rows and column in rows[0]
        }
    except (TypeError, ValueError):
        raise InputError(
            f"{str(path)!r} holds something that is not a number. Give a CSV with a column "
            "'velocity' and one row for each particle"
        ) from None


def _checked(source: str, found: dict[str, Any], scene: Scene) -> UserOutcome:
    if "velocities" not in found:
        raise UserIntegratorError(
            f"{source} gives no velocities. Give the final velocities of all particles"
        )
    targets = scene.target_particles or 0
    if targets and "target_velocities" not in found:
        raise UserIntegratorError(
            f"{source} gives no target_velocities, but the scene has a free target. "
            "Return a mapping, or write an NPZ file, that also has "
            f"target_velocities of {targets} particles"
        )
    arrays: dict[str, Array] = {}
    for name, given in found.items():
        try:
            values = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            raise UserIntegratorError(
                f"{source}: {name} are not numbers. Return finite numbers"
            ) from None
        size = targets if name.startswith("target") else scene.particles
        wanted = None if name.startswith("contact") else (size,)
        if name.startswith("target") and not targets:
            raise UserIntegratorError(
                f"{source} gives {name}, but the scene has a rigid wall. Leave {name} out"
            )
        if wanted is not None and values.shape != wanted:
            raise UserIntegratorError(
                f"{source}: {name} have shape {values.shape}. Give the shape {wanted}, one "
                "value for each particle"
            )
        if values.ndim != 1 or not np.all(np.isfinite(values)):
            raise UserIntegratorError(
                f"{source}: {name} are not a list of finite numbers. Correct the integrator"
            )
        arrays[name] = values
    return UserOutcome(**arrays)
