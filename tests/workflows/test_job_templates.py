"""Test that users' templates run in LAMMPS, and that unsuitable ones are refused."""

import re
from pathlib import Path

import pytest

from chaincor.lammps_inputs.errors import InputError, SceneError
from chaincor.lammps_inputs.own_templates.own_template import OwnTemplate, parse_settings
from chaincor.lammps_inputs.own_templates.rules import check_commands, check_whole
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script_plan import JobWishes
from chaincor.workflows.job import job_files, write_job
from tests.lmp import number, run_lmp

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples" / "templates"
VERLET = Scene(particles=5, speed=0.4, scheme="verlet")


def own(block, commands, head="", **settings):
    return OwnTemplate(
        f'{{% extends "job.in.j2" %}}\n{head}\n'
        f"{{% block {block} %}}\n{commands}\n{{% endblock %}}\n",
        {name: str(value) for name, value in settings.items()},
    )


@pytest.mark.parametrize("scheme", ["verlet", "order6"])
@pytest.mark.slow_cases
def test_a_compute_of_ones_own(scheme, tmp_path):
    scene = VERLET.replace(scheme=scheme)
    write_job(scene, tmp_path / "plain")
    template = OwnTemplate.from_file(EXAMPLES / "energy.in.j2")
    write_job(scene, tmp_path / "own", template=template, explain=True)
    plain, mine = run_lmp(tmp_path / "plain").stdout, run_lmp(tmp_path / "own").stdout
    total = number(mine, "kinetic_energy") + number(mine, "potential_energy")
    # The total energy is the initial energy; the steps conserve it to 1e-3, a part of h^2.
    assert total == pytest.approx(2.5 * scene.impact_velocity**2, rel=1e-3)
    for name in ("restitution", "restitution_error"):
        assert number(mine, name) == number(plain, name)


def test_thermo_output(tmp_path):
    template = OwnTemplate.from_file(EXAMPLES / "thermo.in.j2", ("every=100",))
    write_job(VERLET, tmp_path, template=template)
    done = run_lmp(tmp_path)
    assert done.returncode == 0
    rows = re.findall(r"^ +([0-9]+00) +(\S+) +(\S+) +(\S+) +(\S+) *$", done.stdout, re.MULTILINE)
    energies = [float(row[-1]) for row in rows]
    assert len(energies) > 10
    assert energies == pytest.approx([2.5 * VERLET.impact_velocity**2] * len(energies), rel=1e-3)


@pytest.mark.slow
def test_a_background_that_drags(tmp_path):
    etas = {}
    for friction in ("0.0", "1e-4", "2e-4"):
        template = OwnTemplate.from_file(EXAMPLES / "drag.in.j2", (f"friction={friction}",))
        write_job(VERLET, tmp_path / friction, template=template)
        done = run_lmp(tmp_path / friction)
        assert done.returncode == 0, done.stdout[-2000:]
        etas[friction] = number(done.stdout, "restitution")
    write_job(VERLET, tmp_path / "plain")
    assert etas["0.0"] == number(run_lmp(tmp_path / "plain").stdout, "restitution")
    # The loss is proportional to a weak friction.
    lost, twice = (etas["0.0"] - etas[friction] for friction in ("1e-4", "2e-4"))
    assert lost > 1e-4
    assert twice == pytest.approx(2.0 * lost, rel=0.02)


REFUSED = {
    "nve": ("fixes", "fix mine all nve", "would move twice"),
    "npt": ("fixes", "fix mine all nvt temp 1 1 1", "would move twice"),
    "wall": ("fixes", "fix mine all wall/reflect xlo 0.0", "a second wall transfers"),
    "far wall": ("fixes", "fix mine all wall/lj93 xhi 50 1 1 2", "a second wall transfers"),
    "langevin": ("fixes", "fix mine all langevin 1 1 1 4711", "from a thermostat"),
    "rescale": ("fixes", "fix mine all temp/rescale 1 1 1 0.1 1", "from a thermostat"),
    "halt": ("fixes", "fix mine all halt 1 v_time > 5", "finds the wall by its own `fix halt`"),
    "replaced": ("fixes", "fix motion all ave/time 1 1 1 v_now", "uses the name motion"),
    "unfix": ("fixes", "unfix motion", "uses the name motion"),
    "minimize": ("setup", "minimize 0 0 1 1", "although no time passes"),
    "run": ("setup", "run 1000", "runs the time steps"),
    "later": ("setup", 'if "1 == 1" then "minimize 0 0 1 1"', "although no time passes"),
    "deeper": ("setup", "if 1 then \"if 1 then 'minimize 0 0 1 1'\"", "although no time passes"),
    "hidden": ("setup", "variable c string minimize\n${c} 0 0 1 1", "must not contain a variable"),
    "in if": (
        "setup",
        'variable c string "shell ls"\nif "1" then "${c}"',
        "must not contain a variable",
    ),
    "continued": ("setup", "mini&\nmize 0 0 1 1", "although no time passes"),
    "shell": ("setup", "shell touch here", "runs LAMMPS alone"),
    "python": ("setup", "python f source here 'print(1)'", "runs LAMMPS alone"),
    "variable": ("setup", "variable root equal 0.0", "uses the name root"),
    "label": ("setup", "label flight", "uses the name flight"),
    "file": ("setup", "jump other.in", "only within its own file"),
    "force": ("fixes", "fix mine all addforce 1e-3 0 0", "set other_forces = true"),
    "step": ("setup", "timestep 0.1", "sets the time step"),
}


@pytest.mark.parametrize("case", REFUSED)
@pytest.mark.slow_cases
def test_what_a_job_cannot_live_with_is_refused_by_name(case):
    block, commands, line = REFUSED[case]
    with pytest.raises(SceneError, match=re.escape(line)):
        job_files(VERLET, JobWishes(template=own(block, commands)))


PLAIN = "label flight\nfix motion all nve\nthermo_style custom step\n"


@pytest.mark.parametrize(
    ("commands", "line"),
    [
        ("set atom 1 vx 5.0", "may only measure, print and add declared forces"),
        ("mass * 2.0", "may only measure"),
        ("change_box all x scale 2", "may only measure"),
        ("SHELL touch x", "may only measure"),
        ("if 1 then 'set group all x 0'", "may only measure"),
        ("if 0 then 'print a' elif '1 == 1' 'mass 1 2'", "may only measure"),
        ("pair_style lj/cut 2.5", "set other_forces = true"),
        ("fix f all bond/break 1 1 1.1", "set other_forces = true"),
        ("fix f all unknown/style", "set other_forces = true"),
        ("fix f all setforce/omp 0 0 0", "set other_forces = true"),
        ("fix f all nve/omp", "would move twice"),
        ("variable s string setforce\nfix f all ${s} 0 0 0", "its style must not contain"),
        ("fix ${x} all ave/time 1 1 1 v_x", "its name must not contain"),
        ("fix_modify motion energy yes", "uses the name motion"),
        ("jump SELF flight", "uses the name flight"),
        ("thermo_modify lost ignore", "must not lose particles"),
    ],
)
def test_a_template_changes_no_physics(commands, line):
    with pytest.raises(SceneError, match=re.escape(line)):
        check_commands(PLAIN + commands, PLAIN, composed=False, other_forces=False)


@pytest.mark.parametrize(
    "commands",
    [
        "if '1 == 0' then 'print a' elif '1 == 1' 'print b' else 'print c'",
        "fix m all ave/time 1 1 1 v_x file e.txt\nthermo_style custom step etotal",
        "dump d all custom 10 frames/d.*.gz id x\ndump_modify d sort id",
        'print "a / b" file result_${velocity}.txt',
        "variable r equal x[1]/2\nlabel mine\njump SELF mine",
    ],
)
def test_a_template_measures_and_prints(commands):
    check_commands(PLAIN + commands, PLAIN, composed=True, other_forces=False)
    check_whole(f"{commands}\nrun 1")


@pytest.mark.parametrize(
    ("command", "line"),
    [
        ('print "x" file /tmp/x', "only files in its own folder"),
        ("print 'x' append ../x", "only files in its own folder"),
        ("print 'shell ls' file in.chain", "would replace a file of the job"),
        ("print 'shell ls' file ./chain.state", "would replace a file of the job"),
        ("print 'shell ls' file in${x}", "would replace a file of the job"),
        ("print 'shell ls' file ${x}", "must begin with a letter"),
        ("print 'shell ls' ${option} x", "its options must not contain a variable"),
        ("variable f string in.chain", "names a file of the job"),
        ("if 1 then 'print x file ~/x'", "only files in its own folder"),
        ("fix f all print 1 'x' file a/../../x", "only files in its own folder"),
        ("fix f all ave/time 1 1 1 v_x file log.lammps", "would replace a file of the job"),
        ("dump d all atom 1 |cat", "only files in its own folder"),
        ("dump d all atom 1 'x`ls`.gz'", "only files in its own folder"),
        ("dump d all atom 1 x;ls", "must begin with a letter or digit and contain no other"),
        ("write_data chain.data", "would replace a file of the job"),
        ("write_dump all atom /tmp/x", "only files in its own folder"),
        ("variable f getenv HOME", "depends on its own files alone"),
        ("variable f file names.txt", "reads no other scripts"),
        ("variable f python g", "runs LAMMPS alone"),
        ("fix f all colvars x.in", "runs LAMMPS alone"),
    ],
)
def test_a_template_stays_in_the_folder_of_the_job(command, line):
    for check in (
        lambda: check_commands(PLAIN + command, PLAIN, composed=False, other_forces=True),
        lambda: check_whole(f"{command}\nrun 1"),
    ):
        with pytest.raises(SceneError, match=re.escape(line)):
            check()


def test_a_drag_needs_steps_that_only_go_forward():
    template = OwnTemplate.from_file(EXAMPLES / "drag.in.j2", ("friction=1e-3",))
    with pytest.raises(SceneError, match="Give --scheme verlet"):
        job_files(VERLET.replace(scheme="order4"), JobWishes(template=template))


FOR = "{% for i in range(99999) %}"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("plain text", "extends nothing and has no run command"),
        ('{% extends "other.j2" %}', "extends or includes a file other"),
        (
            '{% extends "job.in.j2" %}{% block setup %}{% include "/etc/passwd" %}{% endblock %}',
            "inc",
        ),
        ('{% extends "job.in.j2" %}{% block setup %}{{ absent }}{% endblock %}', "'absent' is und"),
        ('{% extends "job.in.j2" %}{% block setup %}', "cannot be rendered, line 1"),
        (
            '{% extends "job.in.j2" %}{% block setup %}{{ "".__class__ }}{% endblock %}',
            "forbidden operation",
        ),
        ('{% extends "job.in.j2" %}{% block setup %}{{ 1 / 0 }}{% endblock %}', "division by zero"),
        ("{% macro m() %}{{ m() }}{% endmacro %}run 1\n{{ m() }}", "maximum recursion depth"),
        ("run 1\n{{ 'x' * 10**15 }}", "cannot be rendered: it needs more than 1000 MB"),
        (f"{FOR}{FOR}{{% endfor %}}{{% endfor %}}run 1", "more than 200,000 rounds"),
        (
            f"{FOR[:-2]}recursive %}}{{{{ loop(range(9)) if loop.depth < 9 }}}}{{% endfor %}}",
            "200,000 rounds",
        ),
        (
            "{% macro m(n) %}{% if n %}{{ m(n - 1) }}{{ m(n - 1) }}{% endif %}{% endmacro %}"
            "{{ m(99) }}",
            "200,000 rounds",
        ),
    ],
)
def test_a_template_that_is_none_is_refused_in_one_line(text, line):
    with pytest.raises(SceneError, match=re.escape(line)) as refused:
        job_files(VERLET, JobWishes(template=OwnTemplate(text)))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("given", "line"),
    [
        (("x=1", "x=2"), "each name once"),
        (("x",), "Write NAME=VALUE"),
        (("X=1",), "small letters"),
        (("x=a b",), "a plain word"),
        (("x=$(1)",), "a plain word"),
        (("x=1\nshell",), "a plain word"),
        (("x=",), "a plain word"),
    ],
)
def test_settings_are_numbers_and_words(given, line):
    with pytest.raises(SceneError, match=line):
        parse_settings(given)


def test_settings_are_used_or_refused():
    with pytest.raises(SceneError, match="does not use --set every"):
        job_files(VERLET, JobWishes(template=own("setup", "", every=3)))
    with pytest.raises(SceneError, match="--set velocity is a value of the job itself"):
        job_files(VERLET, JobWishes(template=own("setup", "{{ velocity }}", velocity=3)))


def test_a_dry_run_prints_the_script_and_writes_nothing(chaincor, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    template = str(EXAMPLES / "thermo.in.j2")
    arguments = ["inputs", "--particles", "4", "--scheme", "verlet", "--dry-run"]
    arguments += ["--template", template, "--set", "every=50"]
    status, out, _ = chaincor(*arguments)
    assert status == 0
    assert "thermo          50\n" in out
    assert list(tmp_path.iterdir()) == []
    status, _, err = chaincor(*arguments, "-o", "job")
    assert (status, err.count("\n")) == (2, 1)
    status, _, err = chaincor("inputs", "--set", "every=50", "--dry-run")
    assert (status, err.count("\n")) == (2, 1)


WHOLE = """\
units {{ units }}
boundary f f f
atom_style bond
comm_modify cutoff {{ cutoff }}
bond_style {{ bond_style }}
read_data {{ data_file }}
bond_coeff 1 {{ bond_coeff }}
velocity all set -{{ velocity }} 0 0
fix motion all nve
{{ wall }}
timestep {{ timestep }}
run {{ steps }}
print "restitution = $((vcm(all,x)/{{ velocity }})^2:%.15g)"
print "mine = {{ mine }}, until {{ duration }}"
"""


@pytest.mark.parametrize("potential", ["lj", "harmonic"])
def test_a_whole_script_of_ones_own_gives_what_the_plain_one_gives(potential, tmp_path):
    scene = Scene(particles=5, potential=potential)
    write_job(scene, tmp_path / "plain", plain=True)
    write_job(scene, tmp_path / "own", template=OwnTemplate(WHOLE, {"mine": "7"}))
    plain, mine = run_lmp(tmp_path / "plain").stdout, run_lmp(tmp_path / "own").stdout
    assert number(mine, "restitution") == number(plain, "restitution")
    assert "mine = 7, until " in mine


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("shell ls", "'shell ls', but a job runs LAMMPS alone"),
        ('if "1" then "python f invoke"', "'python f invoke', but a job runs LAMMPS alone"),
        ("if \"1\" then \"if '1' then 'shell ls'\"", "'shell ls', but a job runs LAMMPS alone"),
        ('"if" 1 then "shell ls"', "'shell ls', but a job runs LAMMPS alone"),
        ('run ${n} every ${k} "shell ls"', "'shell ls', but a job runs LAMMPS alone"),
        ('if 1 then "print a\\" "shell ls" "print b\\"', "'shell ls', but a job runs LAMMPS alone"),
        ("if 1 then \u201cshell ls\u201d", "its special characters as quotes"),
        ("\ufeffshell ls", "its special characters as quotes, spaces or"),
        ("{{ 'if 1 then &\\0' }}\n\"shell ls\"", "its special characters as quotes, spaces or"),
        ("{{ 'if 1 then\\v' }}\"shell ls\"", "'shell ls', but a job runs LAMMPS alone"),
        (
            "partition yes 1 shell ls",
            "'partition yes 1 shell ls', but a job runs in a single partition",
        ),
        ("print 'one", "a quote is not closed"),
        ("geturl http://localhost/in.other", "a job runs LAMMPS alone"),
        ("mdi engine", "a job runs LAMMPS alone"),
        ("fix f all external pf/array 1", "a job runs LAMMPS alone"),
        ("fix f all ipi localhost 1", "a job runs LAMMPS alone"),
        ('fix f "all" "external" pf/array 1', "a job runs LAMMPS alone"),
        ("jump other.in", "only within its own file"),
        ("${command} 1", "must not contain a variable"),
        ("run {{ stepz }}", "'stepz' is undefined"),
        ('{% include "plain.in.j2" %}', "extends or includes a file other"),
    ],
)
def test_what_a_whole_script_may_not_do_is_refused(text, line):
    with pytest.raises(SceneError, match=re.escape(line)):
        job_files(Scene(particles=3), JobWishes(template=OwnTemplate(f"{text}\nrun 1\n")))


def test_a_whole_script_is_of_a_rigid_wall_and_takes_no_blocks():
    whole = OwnTemplate("run {{ steps }}")
    with pytest.raises(SceneError, match="the target is free"):
        job_files(Scene(particles=3, target_particles=2), JobWishes(template=whole))
    with pytest.raises(InputError, match="a template that is a whole script and gua"):
        job_files(Scene(particles=3), JobWishes(template=whole, guards=True))


def test_a_block_that_the_job_has_not_is_refused():
    with pytest.raises(SceneError, match=r"block 'typo', which the job lacks.*fixes"):
        job_files(VERLET, JobWishes(template=own("typo", "fix mine all viscous 1")))
