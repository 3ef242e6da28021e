"""Test that unedited scripts keep their simulated time, write no dumps, and report step counts."""

import json

import numpy as np
import pytest

from chaincor import timestep_study
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.scripts.change import Change
from chaincor.workflows.scripts.description import describe_script_study, notes
from chaincor.workflows.scripts.quantities import Quantity, RequestedNumbers, read_quantity
from chaincor.workflows.scripts.rewriting import rewrite
from chaincor.workflows.scripts.samples import Samples
from chaincor.workflows.scripts.script_run import Runner, ScriptRunError, list_files
from chaincor.workflows.scripts.script_text import ScriptText
from chaincor.workflows.scripts.step_counts import find_step_counts
from chaincor.workflows.scripts.study_files import script_study_to_dict
from chaincor.workflows.scripts.varied import read_varied
from tests.programs import python

# A particle on a spring has x = 0.1 cos t. Its energy does not drift, and its errors are known.
SPRING = """
units       lj
atom_style  atomic
atom_modify map array
region      box block -2 2 -2 2 -2 2
create_box  1 box
create_atoms 1 single 0 0 0
mass        1 1.0
pair_style  zero 1.0
pair_coeff  * *
fix         pull all spring/self 1.0
fix_modify  pull energy yes
displace_atoms all move 0.1 0 0 units box
fix         motion all nve
variable    x equal x[1]
"""
RUNS = """
timestep    0.02
dump        d all atom 1 frames.txt
dump_modify d &
            sort id
restart     10 old new
variable    k loop 2
label       again
if "${k} == 1" then "run 101 every 10 'print hello'" "dump e all atom 1 e.txt" else "run 150 upto"
next        k
jump        SELF again
variable    n equal 25+1
run         ${n} pre no
timestep    $(dt/2)
include     more.in
variable    at_end equal dt
"""
MORE = "run 100 start 0 stop 400 # the last\n"
# The runs have 101, 49 and 26 steps of 0.02 and 100 steps of 0.01.
TIME = 176 * 0.02 + 100 * 0.01


@pytest.fixture
def spring(tmp_path):
    (tmp_path / "more.in").write_text(MORE)
    path = tmp_path / "in.spring"
    path.write_text(SPRING + RUNS)
    return path


def runner(script, asked, scratch, files=None):
    return Runner(script, files or [script], asked, find_lmp_command(), scratch, 600.0)


def one_run(script, tmp_path, names=("v_x:last",), **change):
    asked = RequestedNumbers(None, tuple(map(read_quantity, names)))
    scratch = tmp_path / "scratch"
    scratch.mkdir(exist_ok=True)
    files = [path for path in list_files(script.parent) if scratch not in path.parents]
    run = runner(script, asked, scratch, files).run("a run", Change(**change))
    assert run.failure is None
    return run


@pytest.mark.parametrize("finer", [1.0, 0.5, 0.37, 2.0, 3.3])
def test_every_kind_of_run_keeps_its_time(spring, tmp_path, finer):
    run = one_run(spring, tmp_path, finer=finer)
    # Times are sums of some hundred steps, which round.
    assert run.samples.end == pytest.approx(TIME, abs=1e-12)
    # Verlet is of second order, with a phase error of at most t h^2/24.
    steps = 0.02 / finer
    assert abs(run.numbers["v_x:last"].value - 0.1 * np.cos(TIME)) < 0.1 * TIME * steps**2 / 12


def test_frames_and_restarts_are_left_out(spring, tmp_path):
    # The folder of a failed run is kept.
    spring.write_text(spring.read_text() + "no_such_command\n")
    asked = RequestedNumbers(None, (read_quantity("v_x"),))
    files = [spring, spring.parent / "more.in"]
    run = runner(spring, asked, tmp_path / "scratch", files).run("a run", Change(finer=2.0))
    assert "no_such_command" in run.failure
    written = {path.name for path in (tmp_path / "scratch" / "a_run").iterdir()}
    assert "more.in" in written
    assert not {"frames.txt", "e.txt", "old", "new"} & written


# Scripts compute these numbers of steps from a time step of 0.03.
ROUNDED = {
    "run $(ceil(1.0/dt))": 34,
    "run $(floor(1.0/dt))": 33,
    "run $(round(1.0/dt))": 33,
    "run $(ceil(1.0/v_h))": 34,
    "variable n equal floor(1.0/dt)\nrun ${n}": 33,
    "variable n equal ceil(0.5/dt)\nrun ${n}\nrun ${n}": 34,
    "variable n equal round(1.0/dt)\nrun $n upto": 33,
    "run $(ceil(1.0/dt)) every 7 'print again'": 34,
    "run 7\nrun $(round(1.0/dt)) upto": 33,
    "run 7\nrun $(round(1.0/dt)) start 0 stop 40 upto": 33,
    "variable k loop 3\nlabel a\nrun $(round(0.34/dt))\nnext k\njump SELF a": 33,
}


@pytest.mark.parametrize("lines", ROUNDED)
@pytest.mark.parametrize("finer", [0.37, 3.3])
def test_lengths_that_a_script_rounds_are_the_same_time_at_every_step(tmp_path, lines, finer):
    path = tmp_path / "in.x"
    path.write_text(f"{SPRING}variable h index 0.03\ntimestep $h\n{lines}\n")
    run = one_run(path, tmp_path, finer=finer)
    assert run.samples.end == pytest.approx(0.03 * ROUNDED[lines], abs=1e-12)


def test_line_ends_of_windows_change_nothing(spring, tmp_path):
    run = one_run(spring, tmp_path, finer=2.0)
    for path in (spring, spring.parent / "more.in"):
        path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    again = one_run(spring, tmp_path, finer=2.0)
    assert again.numbers == run.numbers


def test_quotes_comments_and_continued_lines_are_read_as_lammps_reads_them(tmp_path):
    """Take ten steps: ``&`` continues a comment, and a # in quotes begins none."""
    path = tmp_path / "in.x"
    if_so = "if '1 == 1' then 'print \"# 1\"' 'run 1&\n0' # run 5 &\nrun 3\n"
    path.write_text(f"{SPRING}timestep 0.02\n# no &\nrun 7\n{if_so}")
    run = one_run(path, tmp_path, finer=2.0)
    assert run.samples.end == pytest.approx(10 * 0.02, abs=1e-12)


def test_between_runs_the_script_sees_its_own_step(tmp_path):
    path = tmp_path / "in.x"
    path.write_text(SPRING + 'timestep 0.03\nrun 50\nprint "dt is $(dt)"\nrun 0\n')
    asked = RequestedNumbers(r"dt is (\S+)", ())
    run = runner(path, asked, tmp_path).run("x", Change(finer=4.0))
    assert run.numbers[asked.pattern].value == 0.03


def test_nothing_else_is_rewritten(tmp_path):
    text = (
        'fix 1 all nve  # as it is\n\nprint "run 100"\nvariable a equal &\n 2\nprint """a\n'
        'run 5\n"""\nif "1 > 0" then "print \'dump\'"\n'
    )
    assert rewrite(text, tmp_path, Change(finer=2.0)) == text


def test_keywords_that_a_script_does_not_print_are_sampled(tmp_path):
    path = tmp_path / "in.x"
    path.write_text(SPRING + "thermo_style custom step temp\nrun 20\n")
    run = one_run(path, tmp_path, ("press", "etotal:drift", "temp"))
    assert set(run.numbers) == {"press:mean", "etotal:drift", "temp:mean"}


PERIODS = (
    "fix a all ave/time 5 2 10 c_thermo_temp\n"
    "variable a equal f_a\n"
    "thermo_style custom step temp f_a v_a\n"
    "thermo_modify format 3 %12.6f colname f_a Mean colname v_a Same\n"
    "thermo_modify format f_a %12.6f\n"
    "run 20\n"
)


def test_thermo_output_of_fixes_with_a_period_stops_no_run(tmp_path):
    """Run 33 steps, at whose end LAMMPS refuses to print ``f_a``, which has a period of 10."""
    path = tmp_path / "in.x"
    path.write_text(SPRING + PERIODS)
    run = one_run(path, tmp_path, ("temp",), finer=1.65)
    assert run.failure is None
    assert run.samples.end == pytest.approx(20 * 0.005, abs=1e-12)
    # A printed number may come from such output, which is then not removed.
    asked = RequestedNumbers(r"Step.*\n.* (\S+)$", ())
    run = runner(path, asked, tmp_path).run("x", Change(finer=1.65))
    assert "compatible time" in run.failure


def test_means_are_integrals_over_the_same_time():
    """Use a parabola: the trapezoidal rule has an error of h^2/6, plain sums of h/2."""
    for count in (20, 23, 31):
        times = np.linspace(0.0, 2.0, count)
        samples = Samples(times, {"x": times**2})
        step = times[1]
        assert abs(samples.number(Quantity("x", "mean")).value - 7.0 / 3.0) < step**2 / 3.0
        # The line through t^2 on [0, 2] has slope 2; the residuals have variance 2^4/180.
        assert samples.number(Quantity("x", "drift")).value == pytest.approx(4.0, abs=step**2)
        rest = samples.number(Quantity("x", "fluctuation")).value
        assert rest == pytest.approx(4.0 / 180**0.5, abs=step**2)


@pytest.mark.slow
def test_a_script_as_it_stands_gets_values_and_advice(spring, tmp_path):
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    study = timestep_study(spring, ["v_x:last", "etotal:drift"], phases=3, tolerance=1e-6)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
    position, _ = study.ladders[0].numbers
    assert position.verdict.kind == "regular"
    assert abs(position.verdict.order - 2.0) <= position.verdict.order_error
    exact = 0.1 * np.cos(TIME)
    assert abs(position.verdict.value - exact) <= position.verdict.value_error < 1e-6
    # The script's step is the step of its last run.
    assert study.own_step == 0.01
    assert not study.ladders[0].ends_apart
    run = one_run(spring, tmp_path, finer=0.01 / position.advice.value)
    assert abs(run.numbers["v_x:last"].value - exact) <= position.advice.promised_error <= 1e-6
    plain = json.loads(json.dumps(script_study_to_dict(study), allow_nan=False))
    first, second = plain["observables"]
    assert (first["name"], second["name"]) == ("v_x:last", "etotal:drift")
    assert first["advice"] == position.advice.value
    assert "v_x:last" in describe_script_study(study)


@pytest.mark.slow
def test_the_command_answers_without_a_word(tmp_path, chaincor, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in.x").write_text(SPRING + "timestep 0.1\nrun 400\n")
    status, out, _ = chaincor("timestep", "in.x", "--phases", "3", "-o", "out", "--json")
    plain = json.loads(out)
    assert status == 0
    names = [each["name"] for each in plain["observables"]]
    assert names == ["etotal:drift", "etotal:fluctuation", "temp:mean", "pe:mean", "press:mean"]
    # etotal does not include the spring's energy. It is m v^2/2, sampled 200 times.
    times = np.linspace(0.0, 40.0, 201)
    energies = 0.005 * np.sin(times) ** 2
    rest = energies - np.polyval(np.polyfit(times, energies, 1), times)
    fluctuation = plain["observables"][1]
    # Nearby steps have other sample times, and one of a hundred samples more or less.
    assert fluctuation["value"] == pytest.approx(rest.std(), rel=1e-2)
    assert fluctuation["value_error"] < 1e-5
    written = {path.name for path in (tmp_path / "out").iterdir()}
    pictures = {"work_precision.png", "work_precision.svg"}
    assert written == {"timestep.html", "timestep.json", "runs.csv", *pictures}


@pytest.mark.slow
def test_runs_that_end_at_other_times_are_reported(tmp_path):
    path = tmp_path / "in.x"
    path.write_text(SPRING + 'variable h index 0.1\ntimestep $h\nrun 100\nprint "x = $x"\n')
    path.write_text(path.read_text().replace('$x"', '$(x[1]:%.17g)"'))
    study = timestep_study(path, observable=r"x = (\S+)", vary="h=0.1:0.01:4", phases=3)
    assert study.ladders[0].ends_apart
    (note,) = [note for note in notes(study) if "the runs end at different times" in note]
    assert "Choose a length that is a multiple of every step." in note
    assert "--vary" not in note


TRAPS = {
    "fix t all temp/rescale 10 1.0 1.0 0.1 1.0": ("acts every 10 steps", True),
    "fix a all ave/time 5 2 10 c_thermo_temp": (
        "samples every 5 steps and writes every 10 steps",
        False,
    ),
    "fix a all ave/time 1 1 1 c_thermo_temp": ("samples every step", False),
    "fix d all deform 3 x erate 0.1": ("acts every 3 steps", True),
    "fix h all halt 7 v_x > 1": ("checks every 7 steps", True),
    "fix m all momentum/kk 100 linear 1 1 1": ("acts every 100 steps", True),
    "fix l all nve/limit 0.1": ("in one step", True),
    "fix n all nvt temp 1.0 1.0 0.05": ("damps within 0.05, fewer than 10 steps of 0.02", True),
    "fix g all langevin 1 1 0.1 48": ("damps within 0.1", True),
    "neigh_modify delay 0 every 20 check no": ("after steps", True),
    "variable r equal step*0.1": ("number of the step", True),
}


@pytest.mark.parametrize("line", TRAPS)
def test_what_counts_steps_is_named(tmp_path, line):
    path = tmp_path / "in.x"
    (tmp_path / "more.in").write_text(f"{line}\n")
    path.write_text("include more.in\nrun 10\n")
    (found,) = find_step_counts(ScriptText.read(path), 0.02)
    said, moves = TRAPS[line]
    assert said in str(found)
    assert str(found).startswith("line 1 of more.in, ")
    assert found.moves == moves


@pytest.mark.parametrize(
    "line",
    [
        "fix n all nvt temp 1.0 1.0 0.5",
        "neigh_modify delay 0 every 1 check yes",
        "neigh_modify once yes",
        "variable r equal stepping+v_step1",
        "fix p all print 10 x",
        "fix m all nve",
    ],
)
def test_what_counts_no_steps_is_not_named(tmp_path, line):
    path = tmp_path / "in.x"
    path.write_text(f"{line}\n")
    assert find_step_counts(ScriptText.read(path), 0.02) == ()


def test_periods_are_held_in_time(tmp_path):
    text = "fix a all ave/time 5 2 20 c_1\nneigh_modify delay 0 every 4 check no\n"
    path = tmp_path / "in.x"
    path.write_text(SPRING + "timestep 0.1\nrun 100\n")
    found = rewrite(text, tmp_path, Change(finer=4.0, scale_periods=True))
    assert "fix a all ave/time ${chaincor_c4x} 2 ${chaincor_c6x} c_1" in found
    # LAMMPS computes these values of the variables.
    program = SPRING + found.split("fix a")[0] + "run 10\nprint 'n = $(v_chaincor_c4x)'\n"
    program += "print 'f = $(v_chaincor_c6x)'\n"
    path.write_text(program.replace("'", '"'))
    for pattern, count in ((r"n = (\d+)", 20.0), (r"f = (\d+)", 80.0)):
        run = runner(path, RequestedNumbers(pattern, ()), tmp_path).run("p", Change())
        assert run.numbers[pattern].value == count


def test_seeds_and_settings_are_found(tmp_path):
    change = Change(seed=5, settings={"cutoff": "3", "skin": "0.4", "rows": "99"})
    for line, expected in (
        ("velocity all create 1.0 100 dist gaussian", "velocity all create 1.0 106 dist gaussian"),
        ("fix 1 all langevin 1 1 0.1 48279", "fix 1 all langevin 1 1 0.1 48285"),
        ("pair_style lj/cut 2.5", "pair_style lj/cut 3"),
        ("neighbor 0.3 bin", "neighbor 0.4 bin"),
        ("bond_style table spline 1000", "bond_style table spline 99"),
    ):
        assert rewrite(line, tmp_path, change).split("\n")[0] == expected


def test_random_forces_have_seeds_of_their_own_and_starts_keep_theirs(tmp_path):
    change = Change(seed=5, forces_alone=True)
    for line, expected in (
        ("fix 1 all langevin/kk 1 1 0.1 48279", "fix 1 all langevin/kk 1 1 0.1 48285"),
        ("fix g all gcmc 10 1000 0 2 29494 298 -0.5 0.01",
         "fix g all gcmc 10 1000 0 2 29500 298 -0.5 0.01"),
        ("pair_style dpd 1.0 2.5 100", "pair_style dpd 1.0 2.5 106"),
        ("pair_style dpd/kk 1.0 2.5 100", "pair_style dpd/kk 1.0 2.5 106"),
        ("fix r all rigid molecule langevin 1 1 1 428984",
         "fix r all rigid molecule langevin 1 1 1 428990"),
        ("velocity all create 1.0 100 dist gaussian", "velocity all create 1.0 100 dist gaussian"),
        ("fix d all deposit 10 1 5 100 region r", "fix d all deposit 10 1 5 100 region r"),
    ):  # fmt: skip
        assert rewrite(line, tmp_path, change).split("\n")[0] == expected
    # Here, the seed is the value of a variable, which LAMMPS computes.
    path = tmp_path / "in.x"
    path.write_text(f"{SPRING}variable s equal 899999999\nfix 1 all langevin 1 1 0.1 $s\nrun 10\n")
    path.write_text(path.read_text() + 'print "s = ${chaincor_seed}"\n')
    run = runner(path, RequestedNumbers(r"s = (\S+)", ()), tmp_path).run("seed", change)
    assert run.numbers[r"s = (\S+)"].value == 5.0


@pytest.mark.parametrize(
    ("vary", "seeds", "drawn"),
    [(None, None, True), ("h=0.1:0.01:4", None, True), ("r=10:1000:4", None, False),
     ("cutoff=2:4:4", None, False), (None, 3, False)],
)  # fmt: skip
def test_random_forces_are_drawn_where_the_step_varies(tmp_path, vary, seeds, drawn):
    path = tmp_path / "in.x"
    path.write_text(f"{SPRING}variable h index 0.1\nvariable r index 9\ntimestep $h\nrun $r\n")
    options = {"printed": False, "scale_periods": False}
    varied = read_varied(ScriptText.read(path), vary, (), seeds, None, **options)
    assert varied.random_forces == drawn
    # Each run has its own random numbers; with seeds, each column of runs has them.
    if varied.values is not None:
        changes = [varied.change({}, rung, column) for rung in range(4) for column in range(4)]
        assert len({change.seed for change in changes}) == (16 if drawn else 1)
        assert all(change.forces_alone == drawn for change in changes)


def test_nearby_steps_of_a_thermostat_scatter_as_its_random_forces_do(tmp_path):
    """Use a hundredth of the damping time, after which v has the variance 2 T t/damp = 0.02."""
    path = tmp_path / "in.x"
    path.write_text(SPRING + "fix 2 all langevin 1 1 1 48279\ntimestep 1e-4\nrun 100\n")
    path.write_text(path.read_text().replace("variable    x equal x[1]", "variable v equal vx[1]"))
    study = timestep_study(path, ["v_v:last"], phases=3)
    (number,) = study.ladders[0].numbers
    # Twelve runs have two degrees of freedom at each step. Chi squared with 8 degrees is between
    # 1.6 and 20 in 99 of 100 cases.
    squares = float(np.sum(number.verdict.scatter**2)) * 2.0 / 0.02
    assert 1.6 < squares < 20.0


def test_what_cannot_be_studied_is_refused(tmp_path):
    path = tmp_path / "in.x"
    for text, options, said in (
        ("rerun a.dump dump x y z\n", {}, "'rerun'"),
        ("run 10\n", {"quantities": ["temp:median"]}, "one of :mean"),
        ("run 10\n", {"quantities": ["temp", "temp:mean"]}, "twice"),
        ("run 10\n", {"vary": "ranks=2"}, "two numbers of processes"),
        ("run 10\n", {"vary": "seed=3", "seeds": 3}, "Leave out one"),
        ("run 10\n", {"lmp": "'"}, "Give a command"),
        ("run 10\n", {"vary": "lastdigit", "phases": 5}, "does not use --phases"),
        (
            "variable n index 10\nrun $n\n",
            {"vary": "ranks=1,2", "fix": ["n=20"], "tolerance": 1.0, "scale_periods": True},
            "does not use --fix, --tolerance, --scale-periods",
        ),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=said):
            timestep_study(path, **options)


@pytest.mark.parametrize("step", ["0", "-0.02"])
@pytest.mark.parametrize("vary", [None, "timestep=0.1:0.01:4"])
def test_a_step_that_is_not_above_0_is_refused(tmp_path, step, vary):
    path = tmp_path / "in.x"
    path.write_text(f"{SPRING}timestep {step}\nrun 20\n")
    with pytest.raises(ScriptRunError, match=f"its timestep is {step}. Set a timestep above 0"):
        timestep_study(path, ["pe:last"], vary=vary)


def test_scripts_need_no_scene_and_no_compiler():
    """Study other users' scripts without libraries that only chains need."""
    code = (
        "import sys, chaincor\nchaincor.timestep_study\nchaincor.check_table\n"
        "import chaincor.workflows.commands.timestep, chaincor.workflows.commands.table\n"
        "import chaincor.workflows.scripts.study_files\n"
        "print(*(m for m in ('numba', 'MDAnalysis', 'lammps', 'pydantic', "
        "'chaincor.lammps_inputs.scene') if m in sys.modules))"
    )
    assert python(code).strip() == ""
