"""Command-line options for the fields of a scene, made from the scene's own description."""

import types
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import click

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import POTENTIAL_NAMES
from chaincor.lammps_inputs.errors import meant, mistakes_in
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.rules import OWNERS
from chaincor.lammps_inputs.scene_parts.scene_file import read_scene_fields


def _plain_types(annotation: Any) -> list[Any]:
    """Take Optional and Annotated apart."""
    origin = get_origin(annotation)
    if origin is tuple:
        return [tuple]
    if origin is Annotated:
        return _plain_types(get_args(annotation)[0])
    if origin in (Union, types.UnionType):
        return [t for part in get_args(annotation) for t in _plain_types(part)]
    return [] if annotation in (type(None), Potential) else [annotation]


class _NumberOrWord(click.ParamType):
    """A number, or one of a few words."""

    name = "number or word"

    def __init__(self, *words: str) -> None:
        self.words = words

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float | str:
        return value if value in self.words else click.FLOAT.convert(value, param, ctx)


class WordChoice(click.Choice):
    """One of some words in any case; a word from elsewhere gets what was meant suggested."""

    def __init__(self, words: tuple[str, ...]) -> None:
        super().__init__(words, case_sensitive=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the word, as it is known."""
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            near = meant(str(value), [str(choice) for choice in self.choices])
            if near is None:
                raise
            self.fail(f"{error.message.rstrip('.')}; did you mean '{near}'?", param, ctx)


class NamedNumbers(click.ParamType):
    """Names and numbers: ``D=0.0139,a=6``."""

    name = "named numbers"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> dict[str, float]:
        """Return the numbers by name."""
        if isinstance(value, dict):
            return value
        numbers: dict[str, float] = {}
        for part in value.split(","):
            name, equals, number = (word.strip() for word in part.partition("="))
            try:
                given = float(number)
            except ValueError:
                given = None
            if not equals or given is None or name in numbers:
                self.fail(
                    f"{value[:60]!a} does not give each name one number; expected NAME=NUMBER, "
                    "such as D=0.0139,a=6",
                    param,
                    ctx,
                )
            numbers[name] = given
        return numbers


def _option(name: str, hidden: bool = False) -> Callable[[Callable], Callable]:
    field = Scene.model_fields[name]
    kind, *words = _plain_types(field.annotation)
    text = field.description or ""
    default = field.default
    if default is not None and "[default" not in text and not isinstance(default, bool):
        text += (
            f" [default: {default:g}]" if isinstance(default, float) else f" [default: {default}]"
        )
    dashed = name.replace("_", "-")
    if kind is bool:
        return click.option(
            f"--{dashed}/--no-{dashed}", name, default=None, help=text, hidden=hidden
        )
    choices = POTENTIAL_NAMES if name == "potential" else get_args(kind)
    if name == "potential" or get_origin(kind) is Literal:
        return click.option(f"--{dashed}", name, type=WordChoice(choices), help=text, hidden=hidden)
    types_and_names: dict[type, tuple[click.ParamType | None, str]] = {
        int: (click.INT, "N"),
        float: (click.FLOAT, "X"),
        Path: (None, "FILE"),
        tuple: (None, "LIST|FILE"),
        str: (None, "TEXT"),
        dict: (NamedNumbers(), "NAME=X,..."),
    }
    option_type, metavar = types_and_names[get_origin(kind) or kind]
    if words:
        choices = get_args(words[0])
        option_type, metavar = _NumberOrWord(*choices), "|".join(("X", *choices))
    if name == "save":
        metavar = "DIR"
    # Paths stay text here: the scene turns them into paths and says what is wrong with them.
    return click.option(
        f"--{dashed}", name, type=option_type, metavar=metavar, help=text, hidden=hidden
    )


def bond_options(command: Callable) -> Callable:
    """Give a command the options of a scene's bonds, which its help leaves to ``--scene``."""
    for name in reversed(("potential", *OWNERS)):
        command = _option(name, hidden=True)(command)
    return command


# Groups of options, each up to and with the field named.
_GROUPS = (
    ("What collides", "particles"),
    ("Bodies that are more than a cold chain of equal masses and a hard wall", "seed"),
    ("How fast", "velocity"),
    ("Who integrates, and how exactly", "tolerance"),
    ("Numerics of your own, in place of a tolerance", "error"),
    ("Files to write", "arrays"),
)


class SceneCommand(click.Command):
    """A command whose help shows the options of a scene in groups, its own at the end."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the groups."""
        options = [p for p in self.get_params(ctx) if isinstance(p, click.Option)]
        left = {p.name: record for p in options if (record := p.get_help_record(ctx))}
        fields = iter(Scene.model_fields)
        for title, last in _GROUPS:
            records = []
            for name in fields:
                if name in left:
                    records.append(left.pop(name))
                if name == last:
                    break
            if records:
                with formatter.section(title):
                    formatter.write_dl(records)
        with formatter.section("Options of the command"):
            formatter.write_dl(list(left.values()))


def scene_options(*leave_out: str) -> Callable[[Callable], Callable]:
    """
    Add an argument SCENE.toml and an option for each field of a scene to a command.

    The command gets ``scene_file`` and the fields as keyword arguments; `leave_out` names fields
    that it has no use for.
    """

    def decorate(command: Callable) -> Callable:
        for name in reversed([n for n in Scene.model_fields if n not in leave_out]):
            command = _option(name)(command)
        return click.argument("scene_file", metavar="[SCENE.toml]", required=False)(command)

    return decorate


def scene_from(
    scene_file: str | None, options: dict[str, Any], beside: tuple[str, ...] = ()
) -> Scene:
    """
    Build the scene from a file, if there is one, and the options, which win over the file.

    `beside` are keys of the file that are no fields of a scene.
    """
    given = {name: value for name, value in options.items() if value is not None}
    fields = read_scene_fields(Path(scene_file)) if scene_file is not None else {}
    fields = {key: value for key, value in fields.items() if key not in beside}
    if "speed" in given or "velocity" in given:
        fields = {k: v for k, v in fields.items() if k not in ("speed", "velocity")}
    if "potential" in given and given["potential"] != fields.get("potential"):
        fields = {k: v for k, v in fields.items() if k not in OWNERS}
    if scene_file is not None:
        with mistakes_in(scene_file):
            return Scene(**fields | given)
    return Scene(**given)
