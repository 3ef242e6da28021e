"""Test separately the lists of steps, the patterns and the texts of scripts."""

import numpy as np
import pytest

from chaincor.analysis.ladders.verdict import LadderVerdict
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.errors import RunError
from chaincor.workflows.scripts import quantities
from chaincor.workflows.scripts.advice import advise_value
from chaincor.workflows.scripts.ladder import PHASE_WIDTH
from chaincor.workflows.scripts.quantities import find_observable, read_observed
from chaincor.workflows.scripts.script_text import ScriptText
from chaincor.workflows.scripts.vary_options import read_fixed, read_ladder


def test_a_ladder_goes_from_end_to_end_in_equal_ratios():
    ladder = read_ladder("timestep=0.01:0.0005:8")
    rungs = np.array([ladder.value(k, 0, 8) for k in range(8)])
    assert rungs[0] == 0.01
    assert rungs[-1] == 0.0005
    # Values are given with six digits.
    assert np.ptp(rungs[1:] / rungs[:-1]) < 1e-5
    nearby = np.array([ladder.value(3, k, 8) for k in range(8)]) / rungs[3]
    assert len(set(nearby)) == 8
    assert np.max(np.abs(nearby - 1.0)) <= PHASE_WIDTH + 1e-5


def test_counts_stay_whole_and_grow_towards_fine():
    ladder = read_ladder("rows=1000:100000:5")
    values = [ladder.value(r, k, 4) for r in range(5) for k in range(4)]
    assert all(value == int(value) for value in values)
    assert ladder.text(ladder.value(0, 0, 4)) == "1000"
    assert ladder.step(1000.0) > ladder.step(100000.0)


@pytest.mark.parametrize(
    "text",
    [
        *("timestep", "timestep=", "timestep=1:2", "timestep=0.1:0.01:3", "timestep=0.1:0.09:8"),
        *("timestep=0.1:0:8", "timestep=-1:1:8", "timestep=0.1:0.01:8.0", "timestep=nan:1:8"),
        *("time step=0.1:0.01:8", "=0.1:0.01:8", "timestep=0.1:0.01:99", "t=1e999:1:8"),
    ],
)
def test_ladders_that_are_none(text):
    with pytest.raises(InputError, match=r"\. (Give|Use) "):
        read_ladder(text)


def test_fixed_values_are_combined_as_given():
    found = read_fixed(("rows=1000,1e4", "skin=0.3"))
    assert found == [{"rows": "1000", "skin": "0.3"}, {"rows": "1e4", "skin": "0.3"}]
    assert read_fixed(()) == [{}]
    for text in ("rows", "rows=", "rows=1,,2", "rows=1;2", "ro ws=1"):
        with pytest.raises(InputError, match=r"\. (Give|Use) "):
            read_fixed((text,))
    with pytest.raises(InputError, match="twice"):
        read_fixed(("rows=1", "rows=2"))


def test_the_last_match_counts_and_its_digits_are_kept(tmp_path):
    screen = tmp_path / "screen.txt"
    screen.write_text("x = 1.0\nx = ${x}\nx = 0.9125\nTotal wall time: 0:00:00\n")
    found = find_observable(r"^x = ([\d.]+)$", screen)
    assert (found.value, found.unit) == (0.9125, 1e-4)
    assert read_observed("", "1.25e-03,").unit == pytest.approx(1e-5)
    assert read_observed("", "12").unit == 1.0
    for text, said in (("nan", "finite"), ("abc", "no number"), (None, "no number")):
        with pytest.raises(RunError, match=said):
            read_observed("", text)
    with pytest.raises(RunError, match="no printed line matches"):
        find_observable(r"^y = (\S+)$", screen)


def test_a_search_that_does_not_end_is_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr(quantities, "PATTERN_SECONDS", 1.0)
    screen = tmp_path / "screen.txt"
    screen.write_text("a" * 60 + "b\n")
    with pytest.raises(RunError, match="longer than"):
        find_observable(r"^((?:a+)+)$", screen)


def script(tmp_path, text):
    path = tmp_path / "in.mine"
    path.write_text(text)
    return ScriptText.read(path)


@pytest.mark.parametrize("style", ["loop 3", "world 0.1 0.2", "uloop 3"])
def test_a_variable_that_counts_is_named(tmp_path, style):
    text = script(tmp_path, f"# by hand\nvariable timestep &\n  {style}\ntimestep ${{timestep}}\n")
    with pytest.raises(InputError, match=f"line 2 .*timestep {style.split()[0]}"):
        text.check_variable("timestep")


def test_a_variable_that_is_not_used_is_named(tmp_path):
    text = script(tmp_path, "variable timestep index 0.01\ntimestep 0.01 # not ${timestep}\n")
    with pytest.raises(InputError, match="does not use the variable 'timestep'"):
        text.check_variable("timestep")
    for line in ("timestep ${timestep}", "timestep $(v_timestep)", "include more.in"):
        script(tmp_path, f"variable timestep index 0.01\n{line}\n").check_variable("timestep")
    script(tmp_path, "timestep $t\n").check_variable("t")
    (tmp_path / "found.in").write_text("timestep 0.01\n")
    script(tmp_path, "if '1 > 0' then 'include more.in'\n").check_variable("t")
    with pytest.raises(InputError, match="does not use the variable 't'"):
        script(tmp_path, "include found.in\n").check_variable("t")


def test_paths_out_of_the_folder_are_refused(tmp_path):
    for line in (
        "read_data ../chain.data",
        "dump d all atom 1 /tmp/d",
        "log '/tmp/l'",
        "shell cp a ~/b",
        "shell rm $HOME/b",
    ):
        with pytest.raises(InputError, match=r"line 1 of in\.mine"):
            script(tmp_path, f"{line}\n").check()
    script(tmp_path, "read_data /data/a.data # ../b\nvariable x equal 1.0 / 2\n").check()
    (tmp_path / "more.in").write_text("\nlog /tmp/l\n")
    with pytest.raises(InputError, match=r"line 2 of more\.in writes to '/tmp/l'"):
        script(tmp_path, "include more.in\n").check()


def verdict(kind, bias, scatter, order=None):
    return LadderVerdict(kind, "", order, 0.1, 0.5, 0.0, np.array(bias), np.array(scatter))


def test_advice_takes_the_cheapest_value_that_keeps_the_tolerance():
    ladder = read_ladder("timestep=0.08:0.01:4")
    values = np.array([0.08, 0.04, 0.02, 0.01])
    seconds = np.array([1.0, 2.0, 4.0, 8.0])
    regular = verdict("regular", 1e-2 * (values / 0.08) ** 2, [0.0] * 4, 2.0)
    advice = advise_value(ladder, values, regular, seconds, 1e-3, repeats=False)
    # The value is 0.08 sqrt(0.1) = 0.0253, rounded down to two digits.
    assert advice.value == 0.025
    assert advice.promised_error <= 1e-3
    assert advice.tried
    beyond = advise_value(ladder, values, regular, seconds, 1e-5, repeats=False)
    # For half the tolerance at order 2, the value is 0.01 sqrt(0.5e-5/1.5625e-4) = 0.00179.
    assert beyond.value == 0.0017
    assert not beyond.tried
    assert beyond.promised_error is None


def test_noise_is_met_by_seeds_at_the_cheapest_value():
    ladder = read_ladder("timestep=0.08:0.01:4")
    values = np.array([0.08, 0.04, 0.02, 0.01])
    seconds = np.array([1.0, 2.0, 4.0, 8.0])
    noise = verdict("noise", [4e-3, 2e-3, 1e-3, 5e-4], [1e-2] * 4)
    advice = advise_value(ladder, values, noise, seconds, 1e-2, repeats=True)
    # The number is (3 * 0.01 / (0.01 - 0.004))^2 = 25 runs of 1 s. At 0.04, it would be 15 runs of
    # 2 s.
    assert (advice.value, advice.runs) == (0.08, 25)
    assert advise_value(ladder, values, noise, seconds, 1e-2, repeats=False) is None


def test_an_undecided_verdict_gives_no_advice():
    ladder = read_ladder("timestep=0.08:0.01:4")
    undecided = verdict("cannot tell", [np.inf] * 4, [1e-2] * 4)
    assert advise_value(ladder, np.ones(4), undecided, np.ones(4), 1.0, repeats=True) is None
    assert np.all(np.isinf(undecided.promised))
