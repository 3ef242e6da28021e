"""Test that hostile settings and templates add no command to a job and run no code in jinja2."""

import itertools
import random

import pytest

from chaincor.lammps_inputs.commands import commands_of
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate, parse_settings
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script_plan import JobWishes
from chaincor.lammps_inputs.units.unit_system import UnitSystem
from chaincor.workflows import scripted as plan
from chaincor.workflows.job import job_files

SCENE = Scene(potential="harmonic", particles=2, velocity=0.1, scheme="verlet", error=False)
HEAD = '{% extends "job.in.j2" %}\n'
PIECES = [
    *(
        "\n",
        "\r",
        "\r\n",
        "&\n",
        " & ",
        "#",
        '"',
        "'",
        '"""',
        "\t",
        "\v",
        "\f",
        "\0",
        ";",
        "|",
        "`",
    ),
    *("$(1)", "${velocity}", "$x", "$(python.exec)", "{{ 7*7 }}", "{% raw %}", "{#", "}}", "%}"),
    *("\u2028", "\u0085", "\u00a0", "\uff04", "\\n", "\\", "\x1b[2J", "\ud800", "..", "/", "~"),
]
COMMANDS = ["shell touch marker", "python f here", "quit", "include x", "print p file x", "run 9"]
# These are disguised ways from Python's objects to a command.
ESCAPES = [
    "''.__class__.__mro__[1].__subclasses__()",
    "().__class__.__base__.__subclasses__()",
    "particles.__class__.__init__.__globals__",
    "self.__init__.__globals__.__builtins__",
    "self._TemplateReference__context",
    "cycler.__init__.__globals__.os.system('touch marker')",
    "lipsum.__globals__['os'].popen('touch marker').read()",
    "joiner.__init__.__globals__.os.system('touch marker')",
    "namespace.__init__.__globals__",
    "range.__self__",
    "scouted.__class__.__module__.__class__",
    "weights.__class__.__subclasses__()",
    "multiples.append(1)",
    "multiples.clear()",
    "multiples.__setitem__(0, 'x')",
    "(multiples|attr('__class__')).__mro__",
    "''|attr('__class__')",
    "'{0.__class__}'.format(particles)",
    "'%s'.__mod__.__self__.__class__",
    "config.items()",
    "request.application.__globals__",
    "import_module('os')",
    "caller()",
    "''.format_map({'x': 1}).__class__",
]
DRESSES = [
    "{{{{ {0} }}}}",
    "{{% set y = {0} %}}{{{{ y }}}}",
    "{{% if {0} %}}x{{% endif %}}",
    "{{% for y in {0} %}}{{{{ y }}}}{{% endfor %}}",
    "{{{{ [{0}]|map('string')|join }}}}",
    "{{% macro m() %}}{{{{ {0} }}}}{{% endmacro %}}{{{{ m() }}}}",
    "{{{{ ({0})|tojson }}}}",
    "{{% with y = {0} %}}{{{{ y }}}}{{% endwith %}}",
]


@pytest.fixture(scope="module")
def plain():
    return commands_of(job_files(SCENE)["in.chain"])


@pytest.fixture(autouse=True)
def empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield
    assert list(tmp_path.iterdir()) == []


def hostile_values():
    rng = random.Random(17)
    values = [piece + command for piece, command in itertools.product(PIECES, COMMANDS)]
    values += [f"1.0{piece}{command}" for piece, command in itertools.product(PIECES, COMMANDS)]
    for _ in range(60):
        parts = rng.choices(PIECES + COMMANDS + ["1.0", "word"], k=rng.randint(2, 6))
        values.append("".join(parts))
    return values


VALUES = hostile_values()


def test_there_are_more_than_500_attempts():
    assert len(VALUES) + len(VALUES) // 3 + len(ESCAPES) * len(DRESSES) >= 500


def test_a_setting_never_becomes_a_command(plain):
    accepted = 0
    text = HEAD + "{% block setup %}\nvariable mine equal {{ value }}\n{% endblock %}\n"
    for value in VALUES:
        try:
            settings = parse_settings((f"value={value}",))
        except SceneError:
            continue
        accepted += 1
        files = job_files(SCENE, JobWishes(template=OwnTemplate(text, settings)))
        added = list(commands_of(files["in.chain"]))
        for command in plain:
            added.remove(command)
        assert added == [f"variable mine equal {value}"]
    assert accepted < 0.1 * len(VALUES)


def test_the_name_of_a_setting_is_a_name():
    for value in VALUES[::3]:
        with pytest.raises(SceneError):
            parse_settings((f"{value}=1",))


def test_units_are_numbers_and_known_words():
    good = {"length": 1.0, "mass": 1.0, "stiffness": 1.0, "style": "metal"}
    for value in VALUES[::4]:
        for key in good:
            with pytest.raises(SceneError):
                UnitSystem.from_fields(good | {key: value})


@pytest.mark.parametrize("dress", DRESSES)
@pytest.mark.slow_cases
def test_a_template_stays_in_its_sandbox(dress, plain, monkeypatch):
    # Only the rendering is tested, with the same numerics each time.
    made = plan.plan_script(SCENE)
    monkeypatch.setattr("chaincor.workflows.job.plan_script", lambda *_, **__: made)
    for escape in ESCAPES:
        text = f"{HEAD}{{% block setup %}}\n# {dress.format(escape)}\n{{% endblock %}}\n"
        try:
            files = job_files(SCENE, JobWishes(template=OwnTemplate(text)))
        except SceneError:
            continue
        # Only a comment is rendered. It contains no object that jinja2 guards.
        script = files["in.chain"]
        assert commands_of(script) == plain
        assert "__" not in script.replace("TemplateReference", "")
        assert "<class" not in script
    assert commands_of(job_files(SCENE)["in.chain"]) == plain


@pytest.mark.parametrize(
    "expression",
    [
        "(10**8)**(10**8)",
        pytest.param("'x' * 2**31", marks=pytest.mark.slow),
        pytest.param("'{:>2000000000}'.format(1)", marks=pytest.mark.slow),
        pytest.param("'x'.ljust(2**31)", marks=pytest.mark.slow),
        pytest.param("('x' * 10**7)|replace('x', 'y' * 10**7)", marks=pytest.mark.slow),
        pytest.param("([1] * 10**9)|sum", marks=pytest.mark.slow),
    ],
)
def test_a_template_that_computes_too_much_is_refused_and_the_next_is_rendered(expression):
    def render(text):
        template = OwnTemplate(f"{HEAD}{{% block setup %}}# {{{{ {text} }}}}\n{{% endblock %}}")
        return job_files(SCENE, JobWishes(template=template))["in.chain"]

    with pytest.raises(SceneError, match=r"cannot be rendered: it (takes|needs) more"):
        render(expression)
    assert "# 14\n" in render("7 * particles")
