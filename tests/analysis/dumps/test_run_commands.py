"""Test that the commands of a run are read from its logs, or otherwise from its scripts."""

import pytest

from chaincor.analysis.dumps.run_commands import RunCommands, is_computed

SCRIPT = "units lj # of the chain\n  mass 1 ${m}\nthermo 5\nfix 2 all wall/reflect xlo 0.0\n"
LOG = "LAMMPS (22 Jul 2025)\nunits lj\nmass 1 ${m}\nmass 1 2.0\nStep Temp\n0 0.1\n"


@pytest.fixture
def files(tmp_path):
    paths = [tmp_path / "log.lammps", tmp_path / "screen.txt", tmp_path / "in.user"]
    for path, text in zip(paths, (LOG, "LAMMPS (22 Jul 2025)\n", SCRIPT), strict=True):
        path.write_text(text)
    return paths


def test_logs_that_repeat_a_command_count_before_scripts(files):
    log, screen, script = files
    commands = RunCommands.read([log, screen], [script])
    found, expanded = commands.named("mass")
    assert expanded
    assert found == {log: [["mass", "1", "${m}"], ["mass", "1", "2.0"]]}
    assert [is_computed(c) for c in found[log]] == [True, False]


def test_scripts_count_where_no_log_has_the_command(files):
    log, screen, script = files
    commands = RunCommands.read([log, screen], [script])
    found, expanded = commands.named("fix")
    assert not expanded
    assert [c[3] for c in found[script]] == ["wall/reflect"]
    assert commands.timestep is None


def test_the_stock_wall_is_seen_in_any_file(files):
    log, screen, script = files
    assert RunCommands.read([log, screen], [script]).stock_wall
    assert not RunCommands.read([log, screen]).stock_wall


def test_continued_lines_are_one_command_and_a_hash_in_quotes_begins_no_comment(tmp_path):
    script, log = tmp_path / "in.user", tmp_path / "log.lammps"
    script.write_text(
        "bond_style harmonic\nbond_coeff 1 &\n  0.5 1.0  # K, r0\n"
        "fix w all &\n  wall/reflect &\n  xlo 0.25\n"
        'fix say all print 10 "# $(step)" screen no\ntimestep &\n 0.01\n'
    )
    commands = RunCommands.read([], [script])
    setup = commands.setup
    assert (setup.spring, setup.walls) == ((0.5, 1.0), {"xlo": "0.25"})
    assert commands.stock_wall
    assert commands.timestep == 0.01
    assert [is_computed(c) for c in commands.named("fix")[0][script]] == [False, True]
    # LAMMPS writes continued lines to its log as one line. The log also has any text that the
    # script prints.
    log.write_text('it prints """ and &\nfix w all wall/reflect xlo 0.5 &\ntimestep 0.02\n')
    commands = RunCommands.read([log], [script])
    assert commands.setup.walls == {"xlo": "0.5"}
    assert commands.timestep == 0.02
