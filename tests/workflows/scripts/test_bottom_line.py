"""Test the bottom line: a step for all quantities, runs that stop early, causes, and advice."""

import json
import re
import shlex

import numpy as np
import pytest

from chaincor import timestep_study
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.engines.lammps.library import find_lmp_command
from chaincor.workflows.scripts import figure
from chaincor.workflows.scripts.crashes import find_crash
from chaincor.workflows.scripts.description import describe_script_study
from chaincor.workflows.scripts.energy_changes import default_quantities
from chaincor.workflows.scripts.script_run import ScriptRunError
from chaincor.workflows.scripts.script_text import ScriptText
from chaincor.workflows.scripts.study_files import script_study_to_dict
from chaincor.workflows.scripts.vary_options import in_whole_numbers, read_ladder
from tests.workflows.scripts.test_unedited import SPRING

# Two particles with a FENE bond of length up to 1.5 are so fast that a coarse step breaks the bond.
FENE = """
units lj
atom_style bond
region box block 0 20 0 20 0 20
create_box 1 box bond/types 1 extra/bond/per/atom 2
create_atoms 1 single 5 5 5
create_atoms 1 single 6 5 5
create_bonds single/bond 1 1 2
mass 1 1
pair_style zero 2.0
pair_coeff * *
bond_style fene
bond_coeff 1 30 1.5 1 1
special_bonds fene
velocity all create 400 123
fix 1 all nve
timestep {step}
run {count}
"""
# No force acts on the particle, so that its potential energy is 0.
NOTHING = """
units lj
region b block 0 2 0 2 0 2
create_box 1 b
create_atoms 1 single 0.5 0.5 0.5
mass 1 1
pair_style lj/cut 0.9
pair_coeff 1 1 1 1
fix 1 all nve
run 20
print "eta = $(pe:%.17g)"
"""
# The script's error is h^2. The step h is a variable, a string that no -var sets, or a whole
# number.
LAW = 'variable h {style} {value}\nprint "x = $(0.5+v_h^2:%.17g)"\n'


def study_of(tmp_path, text, *quantities, **options):
    path = tmp_path / "in.x"
    path.write_text(text)
    return timestep_study(path, quantities, **options)


@pytest.mark.slow
def test_crashed_rungs_are_part_of_the_answer(tmp_path, chaincor, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in.x").write_text(FENE.format(step=0.05, count=100))
    words = ("pe", "etotal:drift", "--tolerance", "1", "-o", "out", "--json", "--phases", "3")
    status, out, _ = chaincor("timestep", "in.x", *words)
    assert status == 0
    plain = json.loads(out)
    steps = [each["timestep"] for each in plain["crashed"]]
    assert 0.05 in steps
    assert steps == sorted(steps, reverse=True)
    for each in plain["crashed"]:
        assert each["step"] >= 1
        assert each["message"]
    messages = {each["message"] for each in plain["crashed"]}
    assert "FENE bond too long (bond of atoms 1 and 2)" in messages
    found = r"Your timestep 0.05 is too large: the run stops (at|after) step \d+: .*\. Use timestep"
    assert re.match(found, plain["summary"])
    assert "No other run stopped early." in plain["summary"]
    # The drift needs a step that is finer by a factor of 2.7.
    assert "The quantity that needs the finest timestep is etotal:drift." in plain["summary"]
    assert "each of pe:mean and etotal:drift then differs by less" in plain["summary"]
    assert plain["use"]["value"] < min(steps)
    assert any("FENE bond too long" in note for note in plain["notes"])
    rows = (tmp_path / "out" / "runs.csv").read_text()
    assert "stopped_at" in rows.splitlines()[0]
    page = (tmp_path / "out" / "timestep.html").read_text()
    assert "FENE bond too long" in page


def test_where_lammps_says_it_stopped():
    screen = "WARNING: FENE bond too long: 55 12 13 1.6 (src/bond_fene.cpp:89)\n"
    screen += "ERROR on proc 0: Bad FENE bond (src/src/MOLECULE/bond_fene.cpp:91)\n"
    assert str(find_crash(screen, 50, "")) == (
        "the run stops at step 55: FENE bond too long (bond of atoms 12 and 13)"
    )
    screen = "ERROR on proc 1: Bond atoms 5 6 missing on proc 1 at step 73 (a/b.cpp:5)\n"
    found = find_crash(screen, 70, "")
    assert (found.step, found.exact) == (73, True)
    found = find_crash("ERROR: Lost atoms: original 256 current 200 (src/thermo.cpp:4)\n", 40, "")
    assert str(found) == "the run stops after step 40: Lost atoms: original 256 current 200"


def test_a_quantity_that_is_always_0_has_a_result_and_files(tmp_path, chaincor, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "in.x").write_text(NOTHING)
    words = ("timestep", "in.x", "--observable", "eta = (.*)", "--phases", "3", "-o", "out")
    status, out, _ = chaincor(*words)
    assert status == 0
    assert "No quantity changes in this time of 0.1, so the timestep cannot be judged." in out
    assert "'eta = (.*)' is 0 in all runs" in out
    assert "small enough" not in out
    command = "chaincor timestep in.x --observable 'eta = (.*)' --phases 3"
    assert f"Make the runs longer, or start particles that move, then run: {command}\n" in out
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        *("timestep.html", "timestep.json", "runs.csv"),
    }


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"vary": "timestep=0.02:0.002:5", "phases": 3}, "--vary timestep=0.02:0.002:5 --phases 3"),
        ({"vary": "seed=5"}, "--seeds 5"),
    ],
)
def test_the_command_after_a_time_out_repeats_the_study(tmp_path, options, words):
    # LAMMPS needs more than 0.01 s to start.
    with pytest.raises(ScriptRunError) as refused:
        study_of(tmp_path, NOTHING, "pe", timeout=0.01, **options)
    command = f"chaincor timestep {tmp_path / 'in.x'} pe {words} --timeout 1"
    assert str(refused.value).endswith(f"allow more time: {command}")


def test_a_relative_path_of_lammps_is_found_from_the_folder_of_each_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    lmp = tmp_path / "lmp"
    lmp.write_text(f'#!/bin/sh\nexec {find_lmp_command()} "$@"\n')
    lmp.chmod(0o755)
    study = study_of(tmp_path, LAW.format(style="index", value=0.1), observable=r"x = (\S+)",
                     vary="h=0.1:0.01:4", phases=3, lmp="./lmp")  # fmt: skip
    assert shlex.split(study.lmp) == [str(lmp)]


def test_data_stay_where_a_figure_fails(tmp_path, monkeypatch):
    from chaincor.workflows.scripts.study_files import write_script_study

    study = study_of(tmp_path, LAW.format(style="index", value=0.1), observable=r"x = (\S+)",
                     vary="h=0.1:0.01:4", phases=3)  # fmt: skip

    def fails(*_words, **_options):
        raise RuntimeError("no figure")

    axes = figure.plot_script_study(study)
    monkeypatch.setattr(axes.figure, "savefig", fails)
    monkeypatch.setattr(figure, "plot_script_study", lambda _study: axes)
    with pytest.raises(RuntimeError, match="no figure"):
        write_script_study(study, tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"timestep.json", "runs.csv"}


def test_one_step_for_all_numbers(tmp_path):
    """Advise a step for errors of h^2 and 100 h^2: the larger requires h = 0.01 for 0.01."""
    text = 'variable h index 0.1\nprint "x = $(0.5+v_h^2:%.17g)"\n'
    study = study_of(tmp_path, text, observable=r"x = (\S+)", vary="h=0.1:0.01:4", phases=3,
                     tolerance=1e-3)  # fmt: skip
    found = re.search(r"Use h ([\d.]+) and one run\. With 95 % probability", study.summary)
    # The tolerance of 0.001 is h^2 plus the scatter of nearby values.
    assert 0.5 * 1e-3**0.5 < float(found[1]) <= 1e-3**0.5
    assert "differs by less than 0.001 from its value at the fine end" in study.summary
    assert study.summary.endswith("No run stopped early.")
    assert repr(study) == f"<ScriptStudy of in.x: x = (\\S+). {study.summary}>"
    html = study._repr_html_()
    assert html.count("<tr>") == 2
    assert "Use h" in html
    axes = study.plot()
    assert axes.get_xlabel() == "h"
    labels = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert len(labels) == len(set(labels)) <= 5
    assert [tick.get_text() for tick in axes.get_xticklabels()] == [
        "0.01",
        "0.0215",
        "0.0464",
        "0.1",
    ]


def test_without_an_answer_there_is_a_command_that_would_give_one(tmp_path):
    study = study_of(tmp_path, LAW.format(style="index", value=0.1), observable=r"x = (\S+)",
                     vary="h=0.1:0.01:4", phases=3, tolerance=1e-8)  # fmt: skip
    command = study.summary.rpartition("run: ")[2]
    assert "No h from 0.1 to 0.01 is small enough for" in study.summary
    options = command.split()
    assert options[:2] == ["chaincor", "timestep"]
    assert "--tolerance 1e-08" in command
    ladder = read_ladder(options[options.index("--vary") + 1])
    assert ladder.coarse == 0.01
    # A tolerance of 1e-8 = h^2 requires h = 1e-4.
    assert ladder.fine <= 1e-4
    again = timestep_study(tmp_path / "in.x", observable=r"x = (\S+)", phases=3, tolerance=1e-8,
                           vary=options[options.index("--vary") + 1])  # fmt: skip
    assert "Use h" in again.summary


@pytest.mark.parametrize(
    ("style", "said"), [("index", "lmp -var h"), ("equal", "'variable h equal 0.0")]
)
def test_advice_can_be_carried_out(tmp_path, style, said):
    study = study_of(tmp_path, LAW.format(style=style, value=0.1), observable=r"x = (\S+)",
                     vary="h=0.1:0.01:4", phases=3, tolerance=1e-3)  # fmt: skip
    text = script_study_to_dict(study)["observables"][0]["text"]
    assert said in text
    assert ("-var" in text) == (style == "index")


@pytest.mark.slow
def test_whole_numbers_for_whole_arguments(tmp_path):
    """Vary an argument of `loop` in whole numbers, because LAMMPS refuses 16.0."""
    text = ("variable n index 8\nvariable k loop ${n}\nlabel a\nnext k\njump SELF a\n"
            'print "x = $(1.0/v_n:%.17g)"\n')  # fmt: skip
    study = study_of(tmp_path, text, observable=r"x = (\S+)", vary="n=2:16:4", phases=3)
    assert study.ladders[0].values.tolist() == [2.0, 4.0, 8.0, 16.0]
    assert study.ladders[0].numbers[0].results[0].tolist() == [0.5, 0.5, 0.5]
    with pytest.raises(InputError, match="only 4"):
        in_whole_numbers(read_ladder("n=1:4:6"))
    with pytest.raises(InputError, match="takes whole numbers"):
        in_whole_numbers(read_ladder("n=1.5:4:4"))


CRYSTAL = """
units lj
lattice fcc 0.8442
region box block 0 3 0 3 0 3
create_box 1 box
create_atoms 1 box
mass 1 1.0
velocity all create 0.1 87287
pair_style lj/cut 2.5
pair_coeff 1 1 1.0 1.0
{more}
fix 1 all nve
run 200
"""


@pytest.mark.slow
def test_a_drift_that_no_step_cures_has_its_cause_tested(tmp_path):
    """Use a warm crystal in which neighbours cross the cutoff."""
    study = study_of(tmp_path, CRYSTAL.format(more=""), "etotal:drift", phases=3)
    (change,) = study.changes
    assert change.confirmed
    assert change.tested.remedy == "pair_modify shift yes"
    # Without the jump at the cutoff, the energy drift is far smaller.
    assert abs(change.after) < 0.01 * abs(change.before)
    assert "'pair_style lj/cut 2.5' (line 9 of in.x)" in str(change)
    study = study_of(
        tmp_path, CRYSTAL.format(more="pair_modify shift yes"), "etotal:drift", phases=3
    )
    assert study.changes == ()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fix", "instead"),
    [
        ("langevin 1.0 1.0 0.1 4711", "; add 'tally yes' to fix langevin and use the keyword ec"),
        ("langevin 1.0 1.0 0.1 4711 tally yes", "; use the keyword econserve:drift instead."),
        ("viscous 0.5", "."),
    ],
)
def test_a_thermostat_is_named_and_not_tested(fix, instead, tmp_path):
    study = study_of(tmp_path, CRYSTAL.format(more=f"fix 2 all {fix}"), "etotal:drift", phases=3)
    (change,) = study.changes
    assert change.tested is None
    said = f"'fix 2 all {fix.split()[0]}' (line 11 of in.x) exchanges energy, so etotal need not "
    for text in (change.short, str(change)):
        assert f"{said}be conserved{instead}" in text


@pytest.mark.parametrize(
    ("fixes", "quantities"),
    [
        ("fix 2 all wall/reflect xlo 0.0", ["etotal:drift", "etotal:fluctuation"]),
        ("fix 2 all wall/lj93 xlo 0.0 1.0 1.0 2.5", ["etotal:drift", "etotal:fluctuation"]),
        ("fix 2 all temp/csvr 1 1 0.1 4711", ["econserve:drift", "econserve:fluctuation"]),
        ("fix 2 all langevin 1 1 0.1 4711 tally yes", ["econserve:drift", "econserve:fluctuation"]),
        ("fix 2 all langevin 1 1 0.1 4711", ["etotal:fluctuation"]),
        ("fix 2 all temp/csvr 1 1 0.1 4711\nfix 3 all viscous 0.5", ["etotal:fluctuation"]),
    ],
)
def test_the_default_energy_is_one_that_the_fixes_conserve(fixes, quantities, tmp_path):
    (tmp_path / "in.x").write_text(CRYSTAL.format(more=fixes))
    found = default_quantities(ScriptText.read(tmp_path / "in.x"))
    assert list(found) == [*quantities, "temp", "pe", "press"]


@pytest.mark.slow
def test_a_fix_that_counts_steps_may_be_the_cause(tmp_path):
    more = "fix 2 all temp/rescale 10 1.0 1.0 0.01 0.5"
    study = study_of(tmp_path, CRYSTAL.format(more=more), "temp", phases=3)
    said = "The integrator may not be the cause: line 11 of in.x, 'fix temp/rescale', acts every "
    assert f"{said}10 steps" in study.summary
    assert "too large" not in study.summary
    assert "First run the command at the end of this line." in study.summary
    assert study.summary.endswith(" --scale-periods")


@pytest.mark.slow
def test_a_users_tolerance_and_short_means_are_stated(tmp_path):
    """Use half a period of a spring, which is one correlation time."""
    study = study_of(tmp_path, SPRING + "timestep 0.1\nrun 30\n", "v_x", "pe", phases=3,
                     tolerance=1e-3)  # fmt: skip
    text = describe_script_study(study)
    assert "tolerance: 0.001 for each quantity, as given by --tolerance" in text
    assert "the means of v_x, pe cover only 1 correlation time. This does not affect" in text
    assert "For an error bar of these means from one run, make the run 30 times longer" in text


@pytest.mark.slow
def test_timesteps_of_a_script_with_several_are_named(tmp_path):
    runs = "timestep 0.1\nrun 10\ntimestep 0.05\nrun 20\n"
    text = describe_script_study(study_of(tmp_path, SPRING + runs, "v_x", phases=3))
    assert "(yours: 0.05)" in text
    assert "note: the script runs at timesteps 0.1, 0.05. The study scales them" in text


@pytest.mark.slow
def test_drifts_are_counted_from_step_0(tmp_path):
    """Require that samples begin with the initial state, here a particle at rest at x = 0.1."""
    path = tmp_path / "in.x"
    path.write_text(SPRING + "timestep 0.1\nrun 30\n")
    study = timestep_study(path, ["v_x:drift", "v_x"], phases=3)
    run = study.ladders[0].runs[0]
    assert run.samples.times[0] == 0.0
    assert run.samples.values["v_x"][0] == pytest.approx(0.1, abs=1e-15)
    times = np.linspace(0.0, 3.0, 3001)
    slope = np.polyfit(times, 0.1 * np.cos(times), 1)[0]
    drift = study.ladders[0].numbers[0].verdict
    # Verlet's error is (h t) h/24 times the amplitude at h = 0.2, for a value of 0.2.
    assert drift.value == pytest.approx(3.0 * slope, rel=1e-2)
    note = next(each for each in script_study_to_dict(study)["notes"] if "over times" in each)
    assert note == "note: drift over times 0 to 3, mean over times 1.5 to 3"
