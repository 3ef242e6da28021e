"""Calls from Python: what is handed over, refused in one line, and Ctrl-C in the midst of it."""

import functools
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.given_numbers import whole_number_given
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.versions import cores_allowed

P = ParamSpec("P")
R = TypeVar("R")


def told_shortly(function: Callable[P, R]) -> Callable[P, R]:
    """Leave out of Ctrl-C where it happened to be: that says nothing, and takes a notebook long."""

    @functools.wraps(function)
    def call(*arguments: P.args, **named: P.kwargs) -> R:
        try:
            return function(*arguments, **named)
        except KeyboardInterrupt as interrupt:
            raise interrupt.with_traceback(None) from None

    return call


def scene_given(value: Any) -> Scene:
    """Return a scene; InputError, which says how to make one, for anything else."""
    if isinstance(value, Scene):
        return value
    hint = "Scene(particles=100, speed=0.4)"
    if isinstance(value, Mapping):
        hint = "one made of it: Scene(**it)"
    elif isinstance(value, str | Path):
        hint = f"one read from a file: Scene.from_file({str(value)[:60]!r})"
    elif isinstance(value, type):
        hint = "one of its objects: Scene()"
    raise InputError(f"{_named(value)} was given; expected a scene, such as {hint}")


def scenes_given(values: Any) -> list[Scene]:
    """Return scenes in their order; InputError where one is none, or they are no list."""
    if isinstance(values, Iterable) and not isinstance(values, str | bytes | Mapping | Scene):
        return [scene_given(value) for value in values]
    return [scene_given(values)]


def workers_given(workers: Any) -> int:
    """Return how many collisions to carry out at a time: one a core by default."""
    if workers is None:
        return cores_allowed()
    return whole_number_given("workers", workers)


def _named(value: Any) -> str:
    if isinstance(value, type):
        return f"the class {value.__name__}"
    return "None" if value is None else f"an object of type {type(value).__name__}"
