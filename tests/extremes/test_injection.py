"""Test that no user text becomes a command of LAMMPS, of a shell or of Python."""

import contextlib
import itertools
import tempfile
from pathlib import Path

import numpy as np
import pytest

from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.bonds.potentials import LennardJones
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script import SCRIPT_FILE
from chaincor.workflows import cli
from chaincor.workflows.collision import collide
from chaincor.workflows.engines.lammps.instance import LammpsChain
from chaincor.workflows.job import write_job
from chaincor.workflows.store.results_store import Store
from tests.extremes.cases import toml_text
from tests.lmp import number, run_lmp

# If executed, each text would make a file `pwned`, or would end or divert the script.
ATTACKS = (
    "x\nshell touch pwned\n",
    "x\r\nshell touch pwned\r\n",
    "x\vshell touch pwned",
    "x\fshell touch pwned",
    "x\x85shell touch pwned",
    "x\u2028shell touch pwned",
    "x\u2029shell touch pwned",
    "x\n\ninclude pwned\n",
    "x\njump pwned\n",
    "x\nquit\n",
    "x\nprint hacked file pwned\n",
    'x" \nshell touch pwned\n"',
    "x' \nshell touch pwned\n'",
    'x""" \nshell touch pwned\n"""',
    "$(touch pwned)",
    "`touch pwned`",
    "; touch pwned",
    "| touch pwned",
    "&& touch pwned",
    "x &\nshell touch pwned",
    "${pwned}",
    "$(v_pwned)",
    "$x",
    "x # comment",
    "x &",
    "{{ 7 * 7 }}",
    "{% include 'job.in.j2' %}",
    "{{ ''.__class__.__mro__ }}",
    "__import__('os').system('touch pwned')",
    "-in pwned",
    "-log pwned",
    "--help",
    "lj\x00shell touch pwned",
)
FILE_NAMES = [text for text in ATTACKS if "\x00" not in text and "/" not in text]
TEXT_KEYS = ("potential", "engine", "wall", "scheme", "table")


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    assert not list(tmp_path.rglob("pwned"))


@contextlib.contextmanager
def recorded_commands():
    """Record the commands of LAMMPS, with the temporary folder's name taken out."""
    printed = []
    original = LammpsChain.commands

    def record(self, text):
        printed.append(text.replace(self.folder.as_posix(), "FOLDER"))
        original(self, text)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(LammpsChain, "commands", record)
        yield printed


@pytest.fixture
def commands():
    with recorded_commands() as printed:
        yield printed


def test_there_are_more_than_200_attempts():
    assert 2 * len(ATTACKS) * len(TEXT_KEYS) >= 200


@pytest.mark.parametrize("key", TEXT_KEYS)
@pytest.mark.parametrize("attack", ATTACKS)
def test_text_fields_of_a_scene_are_refused(chaincor, folder, commands, attack, key):
    (folder / "scene.toml").write_text(f"particles = 3\n{key} = {toml_text(attack)}\n")
    # A text that is no known name is refused before LAMMPS starts, by both commands.
    for arguments in (("run", "scene.toml"), ("inputs", "scene.toml", "-o", "job")):
        status, out, err = chaincor(*arguments)
        assert status == 2, err
        assert out == ""
        assert err.count("\n") == 1
    assert commands == []
    assert not (folder / "job").exists()


def table_file(folder, name):
    path = folder / name
    path.write_text(tabulate(LennardJones(), (0.9, 1.1), "spline", 101).to_text())
    return path


@pytest.fixture(scope="module")
def plain_job(tmp_path_factory):
    """Return the commands of a job whose bond table has a harmless name."""
    folder = tmp_path_factory.mktemp("plain")
    path = table_file(folder, "plain")
    assert cli.run_command_line([*job_of(path), "-o", str(folder / "job")]) == 0
    return (folder / "job" / SCRIPT_FILE).read_text().splitlines()


def job_of(path):
    scene = ["--potential", "table", "--bond-file", str(path), "--particles", "3"]
    return ["inputs", *scene, "--velocity", "0.02", "--timestep", "0.02"]


@pytest.mark.parametrize("attack", FILE_NAMES)
@pytest.mark.slow_cases
def test_the_name_of_a_bond_table_changes_no_command(chaincor, folder, plain_job, attack):
    path = table_file(folder, f"{attack}.table")
    status, _, err = chaincor(*job_of(path), "-o", "job")
    assert status == 0, err
    script = (folder / "job" / SCRIPT_FILE).read_text().rstrip("\n")
    # Only the title, which is a comment, contains the name. Newline and vertical tab do not end a
    # comment.
    assert script.split("\n")[1:] == plain_job[1:]
    assert script.splitlines()[1:] == plain_job[1:]
    assert script.startswith("# A ")
    # The scene is kept with the job and still names the same file.
    assert Scene.from_file(folder / "job" / "scene.toml").bond_file == path


@pytest.mark.parametrize("attack", FILE_NAMES)
@pytest.mark.slow_cases
def test_paths_change_no_command(chaincor, folder, commands, attack):
    scene = ["run", "--particles", "3", "--velocity", "0.02", "--scheme", "order6", "--no-error"]
    assert chaincor(*scene, "--save=a", "--arrays=b", "--dump=c")[0] == 0
    plain, commands[:] = commands[:], []
    deep = f"deep/{attack}"
    options = (f"--save={deep}/s", f"--arrays={deep}/a", f"--dump={deep}/d")
    status, _, err = chaincor(*scene, *options)
    assert status == 0, err
    assert commands == plain
    assert sorted(p.name for p in (folder / "deep" / attack).iterdir()) == ["a", "d", "s"]


@pytest.mark.parametrize("attack", [name for name in FILE_NAMES if name != "--help"])
def test_a_hostile_temporary_folder_is_refused(chaincor, folder, commands, monkeypatch, attack):
    temporary = folder / f"{attack}tmp"
    temporary.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    status, _, err = chaincor("run", "--particles", "3", "--velocity", "0.02")
    assert status == 2
    assert "Set TMPDIR to" in err
    assert commands == []


def text_of_a_python_potential(name, folder, commands):
    """Return all LAMMPS commands of the engine and of a job, without the title."""
    # No loop of a pilot run is compiled for each bond, because the function is not plain Python.
    bond = UserBond(energy=lambda s: 0.5 * s * s, force=np.negative, name=name)
    scene = Scene(potential=bond, particles=2, velocity=0.02, scheme="verlet", error=False)
    commands.clear()
    collide(scene)
    files = write_job(scene, folder / "job")
    title, *script = files[0].read_text().splitlines()
    assert title.startswith("# A ")
    return list(commands), script, [file.read_text() for file in files[1:]]


@pytest.fixture(scope="module")
def text_of_a_plain_name(tmp_path_factory):
    with recorded_commands() as commands:
        return text_of_a_python_potential("plain", tmp_path_factory.mktemp("plain"), commands)


@pytest.mark.parametrize("attack", ATTACKS)
@pytest.mark.slow_cases
def test_the_name_of_a_python_potential_changes_no_command(
    folder, commands, text_of_a_plain_name, attack
):
    assert text_of_a_python_potential(attack, folder, commands) == text_of_a_plain_name


@pytest.mark.parametrize("attack", ATTACKS)
def test_conditions_on_a_store_are_values_not_sql(chaincor, folder, attack):
    with Store(folder / "s.sqlite"):
        pass
    before = (folder / "s.sqlite").read_bytes()
    sql = (f"potential={attack}", f'potential"={attack}', f"1=1;DROP TABLE collisions;--{attack}")
    for condition, option in itertools.product(sql, ("--where", "--sort", "--columns")):
        status, _, err = chaincor("show", "s.sqlite", f"{option}={condition}")
        assert status in (0, 2), err
    assert (folder / "s.sqlite").read_bytes() == before


def test_lammps_itself_runs_a_job_with_a_hostile_name(folder, chaincor):
    path = table_file(folder, "x\nshell touch pwned\n.table")
    assert chaincor(*job_of(path), "-o", "job")[0] == 0
    assert 0.0 < number(run_lmp(folder / "job").stdout, "restitution") < 1.0


def test_archives_with_pickles_are_refused(folder, chaincor):
    class Bomb:
        def __reduce__(self):
            return Path.touch, (folder / "pwned",)

    np.savez(folder / "v.npz", velocities=np.array([Bomb()], dtype=object))
    scene = ["--particles", "2", "--velocity", "0.02", "--against", "v.npz"]
    status, _, err = chaincor("validate", *scene)
    assert status == 2
    assert "v.npz" in err
