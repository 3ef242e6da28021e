"""Test that faults in students' scripts are named, and that LAMMPS judges the rest."""

import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.job import write_job
from chaincor.workflows.lessons import check_script
from chaincor.workflows.lessons.script_check import _RUN as RUN

PARTS = [
    "1. units and box",
    "2. atoms and bonds",
    "3. springs",
    "4. motion and wall",
    "5. output and run",
]
SCRIPT = """
units           lj
boundary        f f f
atom_style      bond
bond_style      harmonic
read_data       chain.data
bond_coeff      1 0.5 1.0
velocity        all set -0.1 0.0 0.0
fix             move all nve
fix             stop all wall/reflect xlo 0.0
timestep        0.01
thermo          100
variable        restitution equal (vcm(all,x)/0.1)^2
run             2500
print           "restitution = $(v_restitution)"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("mine")
    write_job(Scene(potential="harmonic", particles=10), path, plain=True)
    return path


@pytest.fixture
def report_on(folder):
    def report(script):
        (folder / "in.mine").write_text(script)
        return check_script(folder / "in.mine")

    return report


def said(report):
    return {name: " ".join(faults) for name, faults in report.parts.items() if faults}


def test_a_whole_script_is_right_and_so_is_the_plain_one(folder, report_on):
    for report in (report_on(SCRIPT), check_script(folder / "in.chain")):
        assert report
        assert said(report) == {}
        assert list(report.parts) == [*PARTS, RUN]
        assert repr(report).count("right") == 6


def test_an_empty_script_has_five_empty_parts_and_is_not_run(report_on):
    report = report_on("# only a heading\n")
    assert not report
    assert report.parts == dict.fromkeys(PARTS, ("nothing yet",))


# Each case changes or omits a line, and gives the faulty part and a piece of the message.
FAULTS = [
    ("units           lj\n", "", 0, "write `units lj`"),
    ("units           lj", "units real", 0, "`units real`: the chain has no units"),
    ("boundary        f f f\n", "", 0, "the box is then periodic"),
    ("boundary        f f f", "boundary p f f", 0, "periodic in x"),
    ("atom_style      bond\n", "", 1, "no `atom_style`"),
    ("atom_style      bond", "atom_style atomic", 1, "has no bonds"),
    ("read_data       chain.data\n", "", 1, "`read_data chain.data`"),
    (
        "chain.data",
        "nothing.data",
        1,
        "no file `nothing.data` in mine0, the folder",
    ),
    ("bond_style      harmonic\n", "", 2, "bonds have no force"),
    ("bond_coeff      1 0.5 1.0\n", "", 2, "no `bond_coeff`"),
    ("1 0.5 1.0", "1 1.0 1.0", 2, "a stiffness of 1 needs K = 0.5"),
    ("1 0.5 1.0", "1 0.5 1.1", 2, "R0 is 1.1"),
    ("1 0.5 1.0", "1 1 0.5", 2, "K and R0 are exchanged"),
    ("1 0.5 1.0", "1 stiff", 2, "a type and two numbers"),
    ("1 0.5 1.0", "1 1 0.5 1.0", 2, "a type and two numbers"),
    ("fix             move all nve\n", "", 3, "no integrator"),
    ("all nve", "all nvt temp 1 1 1", 3, "exchanges energy with a heat bath"),
    ("all nve\n", "all nve\nfix again all nve\n", 3, "two integrators"),
    ("fix             stop all wall/reflect xlo 0.0\n", "", 3, "no wall"),
    ("xlo 0.0", "xhi 0.0", 3, "wrong side (xhi)"),
    ("xlo 0.0", "x 0.0", 3, "`x` is no face of the box"),
    ("xlo 0.0", "xlo 1.0", 3, "stands at x = 1.0"),
    ("all wall/reflect xlo 0.0", "all wall/harmonic xlo 0.0 1 1 1", 3, "soft wall"),
    ("timestep        0.01\n", "", 4, "no `timestep`: LAMMPS then takes steps of 0.005"),
    ("timestep        0.01", "time_step 0.01", 4, "write `timestep`"),
    ("thermo          100\n", "", 4, "no `thermo`"),
    ("run             2500\n", "", 4, "no `run`"),
    # Words in the lesson's table that stand for a value.
    ("run             2500", "run N", 4, "`run N`: write the number of steps in place of N"),
    ("1 0.5 1.0", "1 K 1.0", 2, "write half the stiffness of a bond in place of K"),
    ("1 0.5 1.0", "1 0.5 R0", 2, "write the length of a bond at rest in place of R0"),
    ("chain.data", "FILE", 1, "write the name of the data file in place of FILE"),
    ("xlo 0.0", "FACE 0.0", 3, "write the side of the box that the wall closes in place of FACE"),
    ("xlo 0.0", "xlo PLACE", 3, "write the wall's x in place of PLACE"),
    ('print           "restitution = $(v_restitution)"\n', "", 4, "nothing prints the result"),
    # Misspelt commands are named as they are written.
    ("units  ", "Units  ", 0, "`Units` is no command of LAMMPS: write `units`"),
    ("boundary", "boundry", 0, "`boundry` is no command of LAMMPS: write `boundary`"),
    ("atom_style", "atomstyle", 1, "write `atom_style`"),
    ("read_data ", "readdata ", 1, "write `read_data`"),
    ("bond_coeff", "bond_coef", 2, "write `bond_coeff`"),
    # A fix has a name, a group and a style.
    ("fix             move all nve", "fix all nve", 3, "`fix all nve` lacks its name"),
    ("fix             move all nve", "fix move nve all", 3, "names its style before its group"),
    ("fix             move all nve", "fix move nve", 3, "`fix move nve` lacks its name"),
    ("stop all wall/reflect", "all wall/reflect", 3, "write `fix NAME all wall/reflect xlo 0.0`"),
    ("move all", "move mobile", 3, "there is no group mobile"),
    ("wall/reflect", "wall/reflct", 3, "is another fix: the hard wall is `wall/reflect`"),
    ("xlo 0.0", "xlo", 3, "names no face and place"),
    ("stop all", "move all", 3, "two fixes have the name move"),
    ("f f f", "fff", 0, "give one letter each for x, y and z"),
    ("run             2500", "run STEPS", 4, "write the number of steps in place of STEPS"),
    # Commas and semicolons that are copied with a command.
    ("units           lj", "units lj,", 0, "`units lj,` ends with a comma: delete it"),
    ("run             2500", "run 2500;", 4, "`run 2500;` ends with a semicolon: delete it"),
    (
        "run             2500",
        "run, 2500",
        4,
        "by spaces only, so delete each comma",
    ),
    ("f f f", "f, f, f", 0, "by spaces only, so delete each comma"),
    ("/0.1)^2", "/0.1)^2,", 4, "(vcm(all,x)/0.1)^2,` ends with a comma"),
    ('_restitution)"', '_restitution)",', 4, "ends with a comma"),
    # Decimal commas, fractions and other notations.
    ("timestep        0.01", "timestep 0,01", 4, "write a decimal point, 0.01"),
    ("/0.1)", "/0,1)", 4, "write a decimal point, 0.1"),
    ("1 0.5 1.0", "1 0,5 1", 2, "write a decimal point, 0.5"),
    ("1 0.5 1.0", "1 1/2 1", 2, "give a type and two numbers, and no fraction"),
    ("1 0.5 1.0", "0.5 1 1", 2, "the first number is the type of the bonds"),
    ("timestep        0.01", "timestep=0.01", 4, "`timestep=0.01`: write a space in place of `=`"),
    ("fix             move", "Fix move", 3, "`Fix` is no command of LAMMPS: write `fix`"),
    ("units  ", "1 units  ", 0, "delete `1` at the beginning of the line"),
    ("wall/reflect", "wall reflect", 3, "write `wall/reflect` as one word"),
    ("thermo          100", "thermo 0.01", 4, "give a whole number of steps"),
    ("all nve\nfix             stop", "all nve, fix stop", 3, "write each command on its own line"),
]


@pytest.mark.parametrize(("line", "other", "part", "piece"), FAULTS)
def test_what_a_script_lacks_is_said_at_its_part(report_on, line, other, part, piece):
    assert SCRIPT.count(line) == 1
    found = said(report_on(SCRIPT.replace(line, other)))
    assert set(found) == {PARTS[part]}
    assert piece in found[PARTS[part]]
    assert "must stand before" not in found[PARTS[part]]


def test_what_comes_too_late_is_said(report_on):
    move = "fix             move all nve\n"
    wall = "fix             stop all wall/reflect xlo 0.0\n"
    moved = SCRIPT.replace(move, "").replace(wall, "") + move + wall
    assert said(report_on(moved))[PARTS[3]].count("too late") == 2
    units = "units           lj\n"
    assert "before `read_data`" in said(report_on(SCRIPT.replace(units, "") + units))[PARTS[0]]
    run = "run             2500\n"
    late = said(report_on(SCRIPT.replace("timestep        0.01\n", "") + "timestep 0.01\n"))
    assert "`timestep` must stand before `run`" in late[PARTS[4]]
    early = "timestep 0.01\n" + SCRIPT.replace("timestep        0.01\n", "")
    assert "`timestep` must stand after `units`" in said(report_on(early))[PARTS[4]]
    coeff = "bond_coeff      1 0.5 1.0\n"
    early = SCRIPT.replace(coeff, "").replace("bond_style ", coeff + "bond_style ")
    assert "`bond_style` must stand before" in said(report_on(early))[PARTS[2]]
    assert "`bond_coeff` must stand after `read_data`" in said(report_on(early))[PARTS[2]]
    assert "`fix` must stand after `read_data`" in said(report_on(move + SCRIPT))[PARTS[3]]
    style = "bond_style      harmonic\n"
    early = style + SCRIPT.replace(style, "")
    assert "`bond_style` must stand after `atom_style`" in said(report_on(early))[PARTS[2]]
    assert "`print` stands before `run`" in said(report_on(SCRIPT.replace(run, "") + run))[PARTS[4]]


# Only the run shows these faults.
RUNS = [
    ("run             2500", "run 500", "too short: it ends at t = 5"),
    ("timestep        0.01", "timestep 1.02", "the step is too long"),
    ("$(v_restitution)", "$restitution", "the value of a variable as `$(v_NAME)`"),
    ("timestep        0.01", "timestep 1.5", 'stopped with "Bond atoms 1 2 missing'),
    ("$(v_restitution)", "$(restitution)", "as `v_NAME`"),
    ("/0.1)^2", "/0.1)**2", "write a power as `^`"),
    ("chain.data", "$(0)", "write `read_data chain.data`"),
    ("set -0.1", "set 0.1", "flies away from the wall"),
    ("(vcm(all,x)/0.1)^2", "-vcm(all,x)/0.1*-1.0", "e, the ratio of speeds"),
    ("(vcm(all,x)/0.1)^2", "0.5", "prints 0.5, but its velocities give 0.9"),
    ("thermo          100", "thermos 100\nthermo 100", "stopped at `thermos 100`"),
    ("set -0.1", "set 0.0", "at rest before the first step"),
    ("0.01", "0.03", "is 0.8592 instead of 0.9071: LAMMPS's wall needs a far shorter step"),
    ("thermo ", "fix drag all viscous 0.1\nthermo ", "look for another force or fix"),
    ("$(v_restitution)", "v_restitution", "`restitution = v_restitution` is printed as text"),
    ('"restitution = $(v_restitution)"', "restitution = 1", "write the text of `print` in quotes"),
    ("equal", "index", "a formula is `variable NAME equal FORMULA`"),
    (
        "variable        restitution equal",
        "variable eta equal",
        "no earlier `variable`",
    ),
    (
        "read_data  ",
        "group first id 1\nread_data  ",
        "write this command after `read_data`",
    ),
    ("style      bond", "style full", "the columns of chain.data"),
    ("coeff      1", "coeff 2", "all particles and bonds of chain.data have type 1"),
    ("run             2500", "run 2.5e3", "write a whole number"),
]


@pytest.mark.slow_cases
@pytest.mark.parametrize(("line", "other", "piece"), RUNS)
def test_what_only_the_run_shows_is_said(report_on, line, other, piece):
    found = said(report_on(SCRIPT.replace(line, other)))
    assert set(found) == {RUN}
    assert piece in found[RUN]


@pytest.mark.slow_cases
def test_messages_name_the_data_file_of_the_script(folder, tmp_path):
    data = (folder / "chain.data").read_text()
    (tmp_path / "tight.data").write_text(data.replace("-600 600 xlo", "-0.5 9.3 xlo"))
    for name, piece in [
        ("tight.data", "an atom left the box, whose size stands in tight.data"),
        ("other.data", "write `read_data tight.data`"),
    ]:
        (tmp_path / "in.mine").write_text(SCRIPT.replace("chain.data", name))
        assert piece in repr(check_script(tmp_path / "in.mine"))


# These scripts are right, but differ from the lesson's script.
OTHER = [
    ("xlo 0.0", "xlo $(0)"),
    ("xlo 0.0", "xlo 0.0 units box"),
    ("xlo 0.0", "xlo 0.0 xhi 100"),
    ("xlo 0.0", "xlo 0.0\nfix behind all wall/reflect xhi 100"),
    ("1 0.5 1.0", "1 $(1/2) 1.0"),
    ("1 0.5 1.0", "* 5e-1 1 # half the stiffness"),
    ("bond_style      harmonic", "bond_style      harmonic # springs"),
    ("f f f", "s s s"),
    ("f f f", "f p p"),
    ("style      bond", "style      molecular"),
    ("fix             stop all", "group first id 1\nfix stop first"),
    ("fix             move all", "group chain type 1\nfix move chain"),
    ("fix             move", "run 0\nfix move"),
    ("run             2500", "run 1000\nrun 1500"),
    ("run             2500", "run $(25/0.01)"),
    ("$(v_restitution)", "${restitution}"),
    ("(vcm(all,x)/0.1)^2", "(vcm(all, x) / 0.1) ^ 2"),
    ("wall/reflect xlo", "wall/reflect &\n    xlo"),
    ("\n", "\r\n"),
]
VARIABLES = [
    ("xlo 0.0", "xlo ${x}", "variable x index 0.0"),
    ("xlo 0.0", "xlo ${x}", "variable x equal 1-1"),
    ("xlo 0.0", "xlo v_x", "variable x equal 0.0"),
    ("1 0.5 1.0", "1 ${k} 1.0", "variable k equal 1/2"),
]


@pytest.mark.slow_cases
@pytest.mark.parametrize(("line", "other"), OTHER)
def test_a_right_script_may_be_written_otherwise(report_on, line, other):
    assert line in SCRIPT
    assert said(report_on(SCRIPT.replace(line, other))) == {}


@pytest.mark.slow_cases
@pytest.mark.parametrize(("line", "other", "variable"), VARIABLES)
def test_a_variable_stands_for_its_value(report_on, line, other, variable):
    assert report_on(f"{variable}\n{SCRIPT.replace(line, other)}")


def test_the_command_prints_the_report_and_fails_for_a_fault(folder, report_on, chaincor):
    assert report_on(SCRIPT)
    status, out, _ = chaincor("check-script", str(folder / "in.mine"))
    assert (status, out.count("right")) == (0, 6)
    (folder / "in.mine").write_text(SCRIPT.replace("xlo", "xhi"))
    status, out, err = chaincor("check-script", str(folder / "in.mine"))
    assert (status, err) == (1, "")
    assert "4. motion and wall  the wall is on the wrong side" in out


def test_a_script_that_cannot_be_read_is_one_line(tmp_path, chaincor):
    with pytest.raises(InputError, match="cannot be read: No such file"):
        check_script(tmp_path / "none")
    (tmp_path / "binary").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="it is not a text file"):
        check_script(tmp_path / "binary")
    status, out, err = chaincor("check-script", str(tmp_path / "none"))
    assert (status, out) == (2, "")
    assert "Traceback" not in err
