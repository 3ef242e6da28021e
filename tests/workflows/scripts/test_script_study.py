"""Test studies of scripts by the real lmp command."""

import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

from chaincor import timestep_study
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.errors import MissingLibraryError
from chaincor.workflows.scripts import ladder_runs, study_inputs
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.quantities import RequestedNumbers
from chaincor.workflows.scripts.script_run import Runner, ScriptRunError, list_files
from chaincor.workflows.scripts.study_files import script_study_to_dict
from tests.page_checks import check_file_list, read_page, words_of
from tests.waiting import HANGS, wait_until

EXAMPLES = Path(__file__).parents[3] / "docs" / "examples" / "scripts"
# This script prints a number with a known error and takes little time.
LAW = r"""
variable timestep index 0.1
variable seed index 1
variable rows index 10
variable noise index 0
variable r equal random(-1.0,1.0,${seed})
print "x = $(0.5+v_timestep^2/v_rows+v_noise*v_r:%.17g)"
"""
OBSERVABLE = r"^x = (\S+)$"


@pytest.fixture
def law(tmp_path):
    path = tmp_path / "in.law"
    path.write_text(LAW)
    return path


def run(script, vary="timestep=0.1:0.01:5", observable=OBSERVABLE, **options):
    return timestep_study(script, observable=observable, vary=vary, **options)


def one_run(script, variables, pattern):
    with tempfile.TemporaryDirectory() as scratch:
        files, asked = list_files(script.resolve().parent), RequestedNumbers(pattern, ())
        runner = Runner(script, files, asked, find_lmp_command(), Path(scratch), 600.0)
        return runner.run("one", Change(variables=variables)).numbers[pattern].value


@pytest.mark.slow
def test_order_and_limit_of_a_known_law(law, tmp_path):
    before = sorted(path.name for path in tmp_path.iterdir())
    study = run(law, phases=3, tolerance=1e-4)
    (ladder,) = study.ladders[0].numbers
    assert ladder.verdict.kind == "regular"
    assert abs(ladder.verdict.order - 2.0) <= ladder.verdict.order_error < 0.01
    assert abs(ladder.verdict.value - 0.5) <= ladder.verdict.value_error < 1e-6
    # The tolerance is 0.0001 = h^2/10 at h = 0.0316, which the advised step does not exceed.
    assert 0.5 * 0.0316 < ladder.advice.value <= 0.0316
    # LAMMPS ran in a copy of the folder, so that log.lammps is not here.
    assert sorted(path.name for path in tmp_path.iterdir()) == before
    plain = json.loads(json.dumps(script_study_to_dict(study), allow_nan=False))
    assert plain["order"] == ladder.verdict.order
    assert plain["observables"][0]["advice"] == ladder.advice.value
    assert len(plain["ladders"][0]["runs"]) == 15


@pytest.mark.slow
def test_fixed_values_make_a_ladder_each(law):
    study = run(law, vary="timestep=0.1:0.02:4", phases=3, fix=["rows=1,100"])
    assert [each.fixed for each in study.ladders] == [{"rows": "1"}, {"rows": "100"}]
    spans = [float(np.ptp(each.numbers[0].results)) for each in study.ladders]
    assert spans[0] / spans[1] == pytest.approx(100.0, rel=1e-6)


def test_the_command_line_prints_and_writes(law, tmp_path, chaincor):
    words = ["timestep", law, "--observable", OBSERVABLE, "--phases", "3", "--tolerance", "1e-3"]
    out = tmp_path / "out"
    status, text, _ = chaincor(*words, "--vary", "timestep=0.1:0.02:4", "-o", out)
    assert status == 0
    assert "verdict      regular" in text
    assert "lmp -var timestep 0.09" in text  # h^2/10 = 1e-3 at 0.1, less three scatters
    names = {path.name for path in out.iterdir()}
    pictures = {"work_precision.png", "work_precision.svg"}
    assert names == {"timestep.html", "timestep.json", "runs.csv", *pictures}
    page = read_page(out / "timestep.html")
    check_file_list(page, out, beside={"timestep.html"})
    reported = words_of(page)
    assert "regular" in reported
    assert "0.1:0.02:4" in reported
    # The page has each line of the terminal's table of runs.
    for rung in json.loads((out / "timestep.json").read_text())["observables"][0]["rungs"]:
        assert f"{rung['mean']:.10g}" in reported
    assert hashlib.sha256(law.read_bytes()).hexdigest() in page


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--vary", "timestep=0.1:0.01:4"], "Missing argument 'SCRIPT'"),
        (["in.law", "--observable", "x", "--particles", "3"], "No such option: '--particles'"),
        (["no.in", "--observable", "x = (.*)", "--vary", "a=1:9:4"], "does not exist"),
    ],
)
def test_options_that_do_not_go_together(law, tmp_path, monkeypatch, chaincor, arguments, said):
    monkeypatch.chdir(tmp_path)
    status, _, err = chaincor("timestep", *arguments)
    assert status == 2
    (line,) = err.strip().splitlines()
    assert said in line


@pytest.mark.slow
def test_what_makes_no_sense_is_refused(law):
    for options, said in (
        ({"phases": 2}, "3 to 100"),
        ({"seeds": 5, "phases": 5}, "Leave out one"),
        ({"tolerance": 0.0}, "positive"),
        ({"timeout": 0.0}, "positive"),
        ({"fix": ["timestep=1"]}, "timestep is given more than once"),
        ({"lmp": "/nothing/lmp", "phases": 3}, "cannot start"),
        # The script reads `seed`, but the printed number does not depend on it.
        ({"seeds": 3}, "Use the variable 'seed'"),
    ):
        with pytest.raises(InputError, match=said):
            run(law, **options)


def test_variable_that_no_included_file_uses_is_named(tmp_path):
    (tmp_path / "more.in").write_text('print "x = 0.5"\n')
    path = tmp_path / "in.unused"
    # The name of the included file is known only when the script runs.
    path.write_text("variable part string more\ninclude ${part}.in\n")
    with pytest.raises(InputError, match=r"does not mention \$\{width\}\. Use the variable"):
        run(path, vary="width=0.1:0.01:4")


def test_without_lammps_it_says_so(law, monkeypatch):
    monkeypatch.setattr(study_inputs, "find_lmp_command", lambda: None)
    with pytest.raises(MissingLibraryError, match="no lmp command"):
        run(law)


def test_a_script_that_fails_is_named_and_kept(law):
    law.write_text(LAW + "no_such_command 1\n")
    with pytest.raises(ScriptRunError, match="no_such_command 1") as failure:
        run(law)
    kept = Path(str(failure.value).rsplit(" ", 1)[1])
    try:
        assert "timestep = 0.01" in str(failure.value)
        names = {path.name for path in kept.rglob("*") if path.is_file()}
        assert {"in.law", "screen.txt", "command.txt", "log.lammps"} <= names
    finally:
        shutil.rmtree(kept)


@pytest.mark.slow
def test_coarse_runs_that_fail_are_left_out(law):
    law.write_text(LAW + 'if "${timestep} > 0.05" then "no_such_command"\n')
    study = run(law, vary="timestep=0.1:0.01:6", phases=3)
    try:
        (ladder,) = study.ladders
        assert ladder.numbers[0].verdict.kind == "regular"
        assert ladder.values[0] < 0.05
        failed = [each for each in ladder.runs if each.failure]
        assert all("no_such_command" in each.failure for each in failed)
        assert len(failed) == 2
    finally:
        shutil.rmtree(study.kept)


def test_a_script_that_prints_nothing_or_hangs(law):
    for text, said, options in (
        ('print "y = 1"', "no printed line matches", {}),
        ('print "x = nan"', "finite number", {}),
        ("shell sleep 60", "not ended after 1 s", {"timeout": 1.0}),
    ):
        law.write_text(f"print '${{timestep}}'\n{text}\n")
        with pytest.raises(ScriptRunError, match=said) as failure:
            run(law, **options)
        (kept,) = re.findall(r"/\S*chaincor-script-\w+", str(failure.value))
        shutil.rmtree(kept)


def test_ends_the_other_way_round_are_seen_by_their_cost(law, monkeypatch):
    monkeypatch.setattr(ladder_runs, "_SURELY_SECONDS", 0.0)
    monkeypatch.setattr(ladder_runs, "_DEARER", 0.01)
    with pytest.raises(InputError, match=r"--vary timestep=0\.01:0\.1:5"):
        run(law)


@pytest.mark.slow
def test_users_files_are_left_alone(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "more.in").write_text('print "x = $(v_timestep^2:%.17g)"\n')
    (tmp_path / "out.txt").write_text("mine")
    script = tmp_path / "in.files"
    script.write_text('print "theirs" file out.txt\ninclude sub/more.in\n')
    study = run(script, phases=3)
    assert study.ladders[0].numbers[0].verdict.kind == "regular"
    assert (tmp_path / "out.txt").read_text() == "mine"
    assert {path.name for path in tmp_path.iterdir()} == {"sub", "out.txt", "in.files"}


def test_ctrl_c_stops_at_once_and_leaves_no_lammps(law, tmp_path):
    law.write_text(
        f"print '${{timestep}}'\nprint 'begun' file {tmp_path.name}.txt\nshell sleep 3600\n"
    )
    program = "from chaincor.workflows.cli import main; main()"
    words = ["timestep", law.name, "--observable", OBSERVABLE]
    process = subprocess.Popen(
        [sys.executable, "-c", program, *words, "--vary", "timestep=0.1:0.01:4"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(EXAMPLES.parents[2]), "TMPDIR": str(tmp_path)},
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        wait_until(lambda: list(tmp_path.rglob(f"{tmp_path.name}.txt")))
        process.send_signal(signal.SIGINT)
        # The script would sleep for an hour.
        _, said = process.communicate(timeout=HANGS)
    finally:
        process.kill()
    assert process.returncode == 130
    assert "interrupted" in said
    assert not list(tmp_path.glob("chaincor-script-*"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "observable", "vary", "seeds", "tolerance", "kind", "order"),
    [
        ("reflecting_wall", "restitution", "0.05:0.001:8", None, 5e-3, "irregular", 1),
        ("spring_chain", "position", "0.2:0.01:6", None, 1e-4, "regular", 2),
        ("bond_stretch", "frequency", "0.2:0.02:6", None, 3e-4, "regular", 2),
        ("crystal_energy", "energy", "0.2:0.01:6", 5, 2e-5, "regular", 2),
        ("melt_drift", "fluctuation", "0.008:0.001:6", None, 3e-4, "regular", 2),
        ("langevin", "energy", "0.1:0.01:6", 10, 0.1, "noise", None),
    ],
)
def test_orders_of_scripts_and_advice_that_is_followed(
    name, observable, vary, seeds, tolerance, kind, order
):
    script, pattern = EXAMPLES / f"{name}.in", rf"^{observable} = (\S+)$"
    phases = None if seeds else 6
    study = run(
        script, f"timestep={vary}", pattern, phases=phases, seeds=seeds, tolerance=tolerance
    )
    (ladder,) = study.ladders[0].numbers
    assert ladder.verdict.kind == kind
    if order is not None:
        assert abs(ladder.verdict.order - order) <= ladder.verdict.order_error
    # Results at two steps near the advised step are compared with that at a far finer step. Each is
    # a mean over six seeds. Its error, half of the scatter, is well below the tolerance.
    advice = ladder.advice
    assert advice.tried
    assert advice.runs == 1

    def value(step, seed):
        variables = {"timestep": repr(step)} | ({"seed": str(seed)} if seeds else {})
        return one_run(script, variables, pattern)

    fine = study.ladder.fine / (1.0 if kind == "noise" else 4.0)
    reference_value = np.mean(
        [value(fine * (1.0 - 0.003 * k), 100 + k) for k in range(6 if seeds else 2)]
    )
    for k in (1, 2):
        followed = value(advice.value * (1.0 - 0.007 * k), 7000 + k)
        assert abs(followed - reference_value) <= tolerance
