"""Test the command line as a whole: statuses, help, and no traceback."""

import importlib
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import click
import pytest

from chaincor.lammps_inputs.bonds.potentials import POTENTIAL_NAMES
from chaincor.workflows import cli
from tests.waiting import HANGS


def test_help_lists_every_command(chaincor):
    status, out, _ = chaincor("--help")
    assert status == 0
    for command in ("run", "inputs", "analyze", "sweep", "tradeoff", "validate", "doctor"):
        assert f"\n  {command} " in out


@pytest.mark.parametrize("command", ["run", "inputs", "doctor", "analyze", "sweep"])
def test_every_command_has_help(chaincor, command):
    status, out, _ = chaincor(command, "--help")
    assert status == 0
    assert out.startswith(f"Usage: chaincor {command}")
    assert "\\b" not in out  # a mark for line breaks, which is not printed


def test_help_of_run_documents_every_option(chaincor):
    own, scene = (chaincor("run", page)[1] for page in ("--help", "--help-scene"))
    for option in ("--animate", "--samples", "--json", "--help-scene"):
        assert option in own.partition("Options:")[2]
        assert f"\n  {option}" not in scene
    for option in (
        f"--potential [{'|'.join(POTENTIAL_NAMES)}]",
        "--toda-b",
        "--power-order",
        "--power-c",
        "--bond-file",
        "--particles",
        "--speed",
        "--velocity",
        "--engine [lammps|reference]",
        "--tolerance",
        "--wall [event|reflect]",
        "--scheme [verlet|order4|order6|order8]",
        "--timestep",
        "--table [linear|spline]",
        "--table-points",
        "--no-error",
        "--dump",
        "--save",
        "--arrays",
    ):
        assert option in scene
        assert f"\n  {option}" not in own


@pytest.mark.parametrize("command", ["run", "inputs", "tradeoff", "validate"])
def test_help_is_one_screen(chaincor, command):
    _, out, _ = chaincor(command, "--help")
    assert len(out.splitlines()) <= 36  # the options of the scene would make a hundred
    assert "--help-scene shows the options of the scene" in out


@pytest.mark.parametrize("command", ["run", "inputs", "tradeoff", "validate"])
def test_no_option_is_on_neither_page(chaincor, command):
    pages = "".join(chaincor(command, page)[1] for page in ("--help", "--help-scene"))
    module = importlib.import_module(f"chaincor.workflows.commands.{command}")
    options = [p for p in getattr(module, command).params if isinstance(p, click.Option)]
    assert len(options) > 20
    for option in options:
        assert sum(name in pages for name in option.opts) == len(option.opts), option.opts


def test_an_unknown_command(chaincor):
    status, out, err = chaincor("fly")
    assert (status, out) == (2, "")
    assert err.startswith("chaincor: there is no command 'fly'. Use one of run, inputs")


@pytest.mark.parametrize("arguments", [(), ("store",)])
def test_a_command_alone_prints_its_help_whole(chaincor, arguments):
    status, out, err = chaincor(*arguments)
    assert (status, err) == (0, "")
    assert out == chaincor(*arguments, "--help")[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("analyse",), "no command 'analyse'. Did you mean 'analyze'? Use one of run"),
        (("run", "--n", "50"), "No such option: '--n'. Did you mean '--particles'?"),
        (("run", "-n", "50"), "No such option: '-n'. Did you mean '--particles'?"),
        (("run", "--partcles", "50"), "No such option: '--partcles'. Did you mean '--particles'?"),
        (("run", "--dt", "0.1"), "No such option: '--dt'. Did you mean '--timestep'?"),
        (("run", "--colour", "red"), "No such option: '--colour'. See --help and --help-scene"),
        (("explain", "--colour", "red"), "No such option: '--colour'. See --help\n"),
        (("run", "--potential", "lennard-jones"), "Did you mean 'lj'?"),
    ],
)
def test_what_was_meant_is_suggested(chaincor, arguments, message):
    status, out, err = chaincor(*arguments)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_words_of_options_are_known_in_capitals(chaincor):
    arguments = ["run", "--potential", "LJ", "--engine", "Reference", "--particles", "3", "--json"]
    status, out, _ = chaincor(*arguments)
    assert (status, json.loads(out)["potential"]) == (0, "lj")


def test_help_of_run_has_groups_defaults_and_examples(chaincor):
    _, out, _ = chaincor("run", "--help-scene")
    heads = [line for line in out.splitlines() if line.endswith(":") and line[0] != " "]
    assert heads[:3] == [
        "What collides:",
        "Masses, target, contact and initial state:",
        "Impact speed:",
    ]
    assert out.count("--particles N") == 1
    plain = " ".join(out.split())
    assert "fix wall/reflect [default: event]" in plain
    assert "chosen for the tolerance; if you give timestep, table or wall: order6" in plain
    _, out, _ = chaincor("run", "--help")
    assert "\n    chaincor run --potential harmonic --particles 20" in out


def test_all_mistakes_are_said_at_once(chaincor, tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text('particles = 0\n"odd\\nkey" = 5\n')
    status, out, err = chaincor("run", str(file), "--speed", "-1")
    assert (status, out) == (2, "")
    head, *lines = err.splitlines()
    assert head == f"chaincor: {file}: 3 mistakes (see: chaincor explain SceneError):"
    assert [line[:14] for line in lines] == ["  particles is", "  speed is -1.", "  unknown key "]


def test_version(chaincor):
    status, out, _ = chaincor("--version")
    assert status == 0
    assert {line.split()[0] for line in out.splitlines()} >= {"python", "chaincor", "lammps"}


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (KeyboardInterrupt(), 130, "chaincor: interrupted"),
        (PermissionError(13, "Permission denied", "/file"), 1, "cannot use the file '/file'"),
        (cli.ChaincorError("two\n lines"), 1, "chaincor: two lines"),
    ],
)
def test_what_goes_wrong_is_one_line(chaincor, monkeypatch, error, status, line):
    def fail():
        raise error

    monkeypatch.setattr("chaincor.workflows.machine.examine", fail)
    code, _, err = chaincor("doctor")
    assert code == status
    assert line in err
    assert err.strip().count("\n") == 0  # click first ends the line that shows ^C


def test_the_process_exits_with_the_status():
    code = "from chaincor.workflows.cli import main; main()"
    for arguments, status in ((["run", "--particles", "0"], 2), (["--help"], 0)):
        done = subprocess.run(
            [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False
        )
        assert done.returncode == status
        assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("redirected", "said"),
    [
        (">&-", "cannot print the result to standard output"),
        (">/dev/full", "No space left on device"),
    ],
)
def test_a_result_that_cannot_be_printed_is_a_failure(redirected, said):
    if redirected == ">/dev/full" and not Path("/dev/full").exists():
        pytest.skip("needs /dev/full")
    done = subprocess.run(
        f"{sys.executable} -m chaincor explain eta {redirected}",
        shell=True,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr.count("\n")) == (1, 1)
    assert said in done.stderr


@pytest.mark.skipif(sys.platform != "linux", reason="needs a limit of the address space")
@pytest.mark.parametrize("engine", ["lammps", "reference"])
def test_a_small_limit_of_memory_is_named(engine):
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (3 * 10**8, -1));"
        "from chaincor.workflows.cli import main; main()"
    )
    command = [sys.executable, "-c", code, "run", "--particles", "3", "--engine", engine]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (1, "", 1)
    assert "the limit of memory set for this program, 286 MB, is too small" in done.stderr


def test_a_full_folder_for_temporary_files_is_named(chaincor, monkeypatch):
    def fail():
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("chaincor.workflows.machine.examine", fail)
    monkeypatch.setattr("shutil.disk_usage", lambda _: shutil._ntuple_diskusage(1, 1, 0))
    status, _, err = chaincor("doctor")
    assert status == 1
    assert f"cannot write temporary files into {tempfile.gettempdir()!r}" in err


MPIEXEC = Path(sys.executable).with_name("mpiexec")
by_mpi = pytest.mark.skipif(not MPIEXEC.exists(), reason="the mpich wheel brings mpiexec")


def two_copies(folder, *command):
    return subprocess.run(
        [MPIEXEC, "-n", "2", *command],
        capture_output=True,
        text=True,
        cwd=folder,
        timeout=HANGS,
        check=False,
    )


@by_mpi
@pytest.mark.parametrize("engine", ["lammps", "reference"])
def test_copies_started_by_mpi_are_refused_in_one_line(engine, tmp_path):
    program = Path(sys.executable).with_name("chaincor")
    done = two_copies(tmp_path, program, "run", "--particles", "5", "--engine", engine)
    assert done.returncode == 2
    lines = [line for line in done.stderr.splitlines() if line.startswith("chaincor:")]
    assert len(lines) == 1
    assert "MPI started 2 processes" in lines[0]
    assert "Traceback" not in done.stderr + done.stdout


@pytest.mark.slow
@by_mpi
def test_scripts_started_several_times_by_mpi_are_refused(tmp_path):
    script = "from chaincor import Scene, collide; collide(Scene(particles=5))"
    done = two_copies(tmp_path, sys.executable, "-c", script)
    assert done.returncode != 0
    assert "InputError: MPI started this program 2 times" in done.stderr
