"""Check the arguments of calls from Python, and shorten tracebacks after Ctrl-C."""

import functools
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import whole_number_given
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.versions import cores_allowed

# A larger number of processes is a typing mistake, because no machine has so many cores.
_MOST_WORKERS = 1_000_000

P = ParamSpec("P")
R = TypeVar("R")


def with_short_errors(function: Callable[P, R]) -> Callable[P, R]:
    """
    Shorten the traceback of Ctrl-C.

    The interrupted line does not help the user, and notebooks format long tracebacks slowly.
    """

    @functools.wraps(function)
    def call(*arguments: P.args, **named: P.kwargs) -> R:
        try:
            return function(*arguments, **named)
        except KeyboardInterrupt as interrupt:
            raise interrupt.with_traceback(None) from None

    return call


def scene_given(value: Any) -> Scene:
    """Return `value` if it is a scene; raise InputError, with a remedy, for any other object."""
    if isinstance(value, Scene):
        return value
    hint = "Scene(particles=100, speed=0.4)"
    if isinstance(value, Mapping):
        hint = "Scene(**fields)"
    elif isinstance(value, str | Path):
        hint = f"Scene.from_file({str(value)[:60]!r})"
    elif isinstance(value, type):
        hint = "Scene()"
    raise InputError(f"{_named(value)} was given instead of a scene. Give a scene, such as {hint}")


def scenes_given(values: Any) -> list[Scene]:
    """Return a scene or several scenes as a list; raise InputError for any other object."""
    several = isinstance(values, Iterable) and getattr(values, "ndim", 1) > 0
    if several and not isinstance(values, str | bytes | Mapping | Scene):
        return [scene_given(value) for value in values]
    return [scene_given(values)]


def workers_given(workers: Any) -> int:
    """Return the number of collisions to run at the same time; by default one per core."""
    if workers is None:
        return cores_allowed()
    return whole_number_given("workers", workers, most=_MOST_WORKERS)


def _named(value: Any) -> str:
    if isinstance(value, type):
        return f"the class {value.__name__}"
    return "None" if value is None else f"an object of type {type(value).__name__}"
