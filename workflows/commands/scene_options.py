"""Generate command-line options for the fields of the `Scene` model."""

import contextlib
import types
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import click

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import BOND_KEYS, POTENTIAL_NAMES
from chaincor.lammps_inputs.errors import meant, mistakes_in
from chaincor.lammps_inputs.given_numbers import number_in
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.scene_parts.scene_fields import GROUPS
from chaincor.lammps_inputs.scene_parts.scene_file import read_scene_fields
from chaincor.workflows.commands.options import option


def _plain_types(annotation: Any) -> list[Any]:
    """Return the plain types inside an annotation with Optional, Union or Annotated."""
    origin = get_origin(annotation)
    if origin is tuple:
        return [tuple]
    if origin is Annotated:
        return _plain_types(get_args(annotation)[0])
    if origin in (Union, types.UnionType):
        return [t for part in get_args(annotation) for t in _plain_types(part)]
    return [] if annotation in (type(None), Potential) else [annotation]


def _number_or(words: tuple[str, ...]) -> Callable[[Any], float | str]:
    """Return a parser that accepts a number or one of the given words."""

    def read(text: str) -> float | str:
        given = number_in(text)
        if given is None and text not in words:
            raise click.BadParameter(
                f"{text[:60]!a} is neither a number nor {' nor '.join(words)}. Give one of them"
            )
        return text if given is None else given

    return read


class WordChoice(click.Choice):
    """
    Choice of words, in upper or lower case.

    The error for an unknown word suggests a similar word.
    """

    def __init__(self, words: tuple[str, ...]) -> None:
        super().__init__(words, case_sensitive=False)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """Return the word in its standard spelling."""
        try:
            return super().convert(value, param, ctx)
        except click.BadParameter as error:
            near = meant(str(value), [str(choice) for choice in self.choices])
            if near is None:
                raise
            self.fail(f"{error.message.rstrip('.')}. Did you mean '{near}'?", param, ctx)


def named_numbers(text: str) -> dict[str, float]:
    """Parse names and numbers, such as ``D=0.0139,a=6``."""
    numbers: dict[str, float] = {}
    for part in text.split(","):
        name, equals, number = (word.strip() for word in part.partition("="))
        given = number_in(number)
        if not equals or given is None or name in numbers:
            raise click.BadParameter(
                f"{text[:60]!a} does not give each name one number. Write NAME=NUMBER, such as "
                "D=0.0139,a=6"
            )
        numbers[name] = given
    return numbers


# This table gives the placeholder and the parser for each type. Paths remain text, because the
# scene converts and checks them.
_VALUES: dict[type, tuple[str, click.ParamType | Callable[[str], Any]]] = {
    int: ("N", click.INT),
    float: ("X", click.FLOAT),
    Path: ("FILE", click.STRING),
    tuple: ("LIST|FILE", click.STRING),
    str: ("TEXT", click.STRING),
    dict: ("NAME=X,...", named_numbers),
}


def _option(name: str, hidden: bool = False) -> Callable[[Callable], Callable]:
    field = Scene.model_fields[name]
    kind, *words = _plain_types(field.annotation)
    text, default, dashed = field.description or "", field.default, name.replace("_", "-")
    if default is not None and "[default" not in text and not isinstance(default, bool):
        text += f" [default: {f'{default:g}' if isinstance(default, float) else default}]"
    if kind is bool:
        both = f"--{dashed}/--no-{dashed}"
        return click.option(both, name, default=None, help=text, hidden=hidden)
    if name == "potential" or get_origin(kind) is Literal:
        choices = POTENTIAL_NAMES if name == "potential" else get_args(kind)
        return option(f"--{dashed}", text, WordChoice(choices), hidden=hidden)
    metavar, read = _VALUES[get_origin(kind) or kind]
    if words:
        choices = get_args(words[0])
        metavar, read = "|".join(("X", *choices)), _number_or(choices)
    metavar = "DIR" if name == "save" else metavar
    return option(f"--{dashed} {metavar}", text, read, hidden=hidden)


def bond_options(command: Callable) -> Callable:
    """Add the options of a scene's bonds to a command, but do not show them in its help."""
    for name in reversed(("potential", *BOND_KEYS)):
        command = _option(name, hidden=True)(command)
    return command


def _show_scene_help(ctx: click.Context, _parameter: click.Parameter, wanted: bool) -> None:
    if wanted and not ctx.resilient_parsing and isinstance(ctx.command, SceneCommand):
        click.echo(ctx.command.scene_help(ctx))
        ctx.exit()


class SceneCommand(click.Command):
    """Command that shows the options for its scene only with ``--help-scene``."""

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        self.params.append(
            click.Option(
                ["--help-scene"],
                is_flag=True,
                is_eager=True,
                expose_value=False,
                callback=_show_scene_help,
                help="Show the options of the scene and exit.",
            )
        )

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the help for the command's own options, and mention ``--help-scene``."""
        with formatter.section("Options"):
            shown = self._records(ctx)
            formatter.write_dl([shown[name] for name in shown if name not in Scene.model_fields])
        formatter.write_paragraph()
        formatter.write_text(
            "--help-scene shows the options of the scene, such as --potential "
            "toda, --particles 50 or --speed 0.8. They override SCENE.toml."
        )

    def scene_help(self, ctx: click.Context) -> str:
        """Return the help for the options of a scene, in groups."""
        formatter = ctx.make_formatter()
        formatter.write_text(
            f"Options of `{ctx.command_path}` that describe its scene. A file "
            "SCENE.toml has the same keys, with _ in place of -. Options override "
            "the file."
        )
        records = self._records(ctx)
        for title, names in GROUPS.items():
            if shown := [records[name] for name in names if name in records]:
                with formatter.section(title):
                    formatter.write_dl(shown)
        return formatter.getvalue().rstrip()

    def _records(self, ctx: click.Context) -> dict[str, tuple[str, str]]:
        """Return the help record for each option, by name."""
        options = [p for p in self.get_params(ctx) if isinstance(p, click.Option)]
        return {p.name or "": r for p in options if (r := p.get_help_record(ctx)) is not None}


def scene_options(*leave_out: str) -> Callable[[Callable], Callable]:
    """
    Add the argument SCENE.toml and one option for each field of a scene to a command.

    The command receives ``scene_file``, and the fields that are not in `leave_out`, as keyword
    arguments.
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
    Build the scene from an optional file and from options; options override the file.

    `beside` names keys in the file that belong to the command instead of the scene.
    """
    given = {name: value for name, value in options.items() if value is not None}
    fields = read_scene_fields(Path(scene_file)) if scene_file is not None else {}
    left_out = set(beside)
    if "speed" in given or "velocity" in given:
        left_out |= {"speed", "velocity"}
    if "potential" in given and given["potential"] != fields.get("potential"):
        left_out |= set(BOND_KEYS)
    kept = {key: value for key, value in fields.items() if key not in left_out}
    with contextlib.nullcontext() if scene_file is None else mistakes_in(scene_file):
        return Scene(**kept | given)
