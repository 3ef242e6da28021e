"""Test that grids of jobs are written, run by the array script, killed, collected, resumed."""

import csv
import os
import re
import subprocess

import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.lammps.library import lmp_environment
from chaincor.workflows.grids import grid
from chaincor.workflows.grids.collect import collect_grid
from chaincor.workflows.grids.grid import folder_name, write_grid
from chaincor.workflows.grids.submission import SCHEDULERS, Submission
from chaincor.workflows.scripted import plan_script
from chaincor.workflows.store.export import to_pandas
from chaincor.workflows.store.results_store import Store
from tests.lmp import LMP

# This program kills LAMMPS once in each job named in KILL, after it has written a restart file.
# LAMMPS sleeps at this point, so that it cannot finish before it is killed.
KILLER = """#!/bin/bash
for name in $KILL; do
    if [ "$(basename "$PWD")" = "$name" ] && [ ! -e killed ]; then
        touch killed
        sed "s/^variable saved_at .*/&\\nshell sleep 600/" in.chain > in.slow
        setsid {lmp} -in in.slow -var restart 1 &
        until grep -qs saved_at chain.state; do sleep 0.01; done
        kill -9 -- -$!
        wait $!
        exit 137
    fi
done
exec {lmp} "$@"
"""


def submit(grid, *kill):
    wrapper = grid / "lmp.sh"
    wrapper.write_text(KILLER.replace("{lmp}", str(LMP)))
    wrapper.chmod(0o755)
    environment = lmp_environment() | {"LMP": str(wrapper), "RESTART": "1", "KILL": " ".join(kill)}
    done = subprocess.run([grid / "submit.bash"], env=environment, timeout=600, check=False)
    return done.returncode


def script_of(scheduler, folders, written=None, **options):
    (script,) = Submission(scheduler, **options).scripts(folders, written).values()
    return script


def write_sweep(path, text):
    path.write_text(text)
    return str(path)


@pytest.mark.slow
def test_a_grid_is_collected_named_resubmitted_and_complete(chaincor, tmp_path):
    killed, broken = [2, 5], 3
    sweep = write_sweep(
        tmp_path / "sweep.toml",
        '[scene]\ntolerance = 1e-8\n[axes]\npotential = ["lj", "toda"]\nparticles = [4]\n'
        "speed = [0.2, 0.3, 0.4]\n",
    )
    grid, store = tmp_path / "jobs", tmp_path / "results.sqlite"
    assert chaincor("inputs", sweep, "-o", str(grid), "--submit", "bash")[0] == 0
    with (grid / "manifest.csv").open() as file:
        rows = list(csv.DictReader(file))
    count = len(rows)
    names = [row["folder"] for row in rows]
    assert {job.state for job in collect_grid(grid)} == {"missing"}

    script = grid / names[broken - 1] / "in.chain"
    text = script.read_text()
    script.write_text(text.replace("comm_modify ", "comm_modyfy "))
    assert submit(grid, *(names[k - 1] for k in killed)) == 1
    status, out, _ = chaincor("collect", str(grid), "-o", str(store))
    assert status == 1
    assert f"{count - len(killed) - 1} done, 1 failed, {len(killed)} unfinished" in out
    for k in killed:
        assert f"unfinished {names[k - 1]}: it was stopped: submit it again" in out
    assert f"failed     {names[broken - 1]}: ERROR: Unknown command: comm_modyfy" in out

    script.write_text(text)
    finished = {name: (grid / name / "log.lammps").stat().st_mtime_ns for name in names}
    assert submit(grid) == 0
    again = [
        k
        for k, name in enumerate(names, 1)
        if (grid / name / "log.lammps").stat().st_mtime_ns != finished[name]
    ]
    assert again == sorted([*killed, broken])
    status, out, _ = chaincor("collect", str(grid), "-o", str(store), "--json")
    assert status == 0
    assert f'"done": {count}' in out

    table = to_pandas(store)
    assert len(table) == count
    assert (table.restitution_error <= 1e-8).all()
    assert table.tolerance_met.all()
    # A killed job that is resumed gives the result of a job that was not killed.
    whole = tmp_path / "whole"
    write_grid([Scene(**fields(rows[k - 1])) for k in killed], ["speed"], whole)
    submit(whole)
    for job in collect_grid(whole):
        with Store(store) as kept:
            found = kept.find(job.scene)
        assert found.restitution == pytest.approx(job.row.restitution, abs=1e-12)
    assert chaincor("show", str(store))[0] == 0
    assert chaincor("plot", str(store), "-o", str(tmp_path / "curve.png"))[0] == 0


def fields(row):
    return {
        "potential": row["potential"],
        "particles": int(row["particles"]),
        "speed": float(row["speed"]),
        "tolerance": 1e-8,
    }


def test_a_point_without_a_job_is_named(chaincor, tmp_path):
    sweep = write_sweep(
        tmp_path / "sweep.toml",
        '[scene]\npotential = "harmonic"\nparticles = 4\n[axes]\nvelocity = [0.1, 0.9]\n',
    )
    status, out, err = chaincor("inputs", sweep, "-o", str(tmp_path / "jobs"))
    assert status == 1
    assert "1 jobs in" in out
    assert "no job for 0002_velocity=0.9: particles of a harmonic chain pass through" in err
    jobs = collect_grid(tmp_path / "jobs")
    assert sorted(job.state for job in jobs) == ["missing", "refused"]


def test_a_grid_that_names_no_tolerance_was_asked_for_the_usual_one(chaincor, tmp_path):
    scene = Scene(particles=3, speed=0.3, masses=(1, 4))
    write_grid([scene], [], tmp_path)
    assert submit(tmp_path) == 0
    (job,) = collect_grid(tmp_path)
    assert [job.row.columns[name] for name in ("tolerance", "tolerance_met")] == [1e-6, True]
    status, out, _ = chaincor("collect", tmp_path, "-o", tmp_path / "results.sqlite")
    assert status == 0
    assert out.startswith("1 jobs: 1 done; results in ")
    with Store(tmp_path / "results.sqlite") as kept:
        assert kept.find(scene).restitution == job.row.restitution
    # The residual is relative to the momentum of masses 1, 4, 1. LAMMPS changes momentum only by
    # rounding.
    assert job.row.columns["momentum_residual"] < 1e-12
    log = tmp_path / "0001" / "log.lammps"
    worse = [
        "restitution_error = 1e-3" if line.startswith("restitution_error = ") else line
        for line in log.read_text().splitlines()
    ]
    log.write_text("\n".join(worse))
    (job,) = collect_grid(tmp_path)
    assert job.row.columns["tolerance_met"] is False
    # One log is of an older job that was resumed in its second run, and one is of no job.
    lost = [line for line in worse if not line.startswith("contacts = ")]
    wrong = ["contacts = 3", "restitution = -7.5", "restitution_error = 0.1"]
    for lines, words in (
        (lost, "lacks the contacts of its first run"),
        (wrong, "restitution = -7.5"),
    ):
        log.write_text("\n".join([*lines, ""]))
        (job,) = collect_grid(tmp_path)
        assert job.state == "unfinished"
        assert words in job.words


def test_bonds_of_an_axis_name_all_their_fields(chaincor, tmp_path):
    sweep = write_sweep(
        tmp_path / "sweep.toml",
        "[scene]\nparticles = 3\nspeed = 0.2\n"
        '[axes]\nbond = [{ potential = "lj" }, { potential = "toda", toda_b = 5 }]\n',
    )
    assert chaincor("inputs", sweep, "-o", str(tmp_path / "jobs"))[0] == 0
    with (tmp_path / "jobs" / "manifest.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["potential"], row["toda_b"]) for row in rows] == [("lj", ""), ("toda", "5.0")]


def test_a_grid_is_not_overwritten_unasked(tmp_path):
    scenes = [Scene(potential="harmonic", particles=3, velocity=0.1, scheme="verlet")]
    write_grid(scenes, [], tmp_path)
    (tmp_path / "0001" / "log.lammps").write_text("restitution = 1\nrestitution_error = 1\n")
    with pytest.raises(InputError, match=r"has manifest\.csv, submit\.bash, 0001 already"):
        write_grid(scenes, [], tmp_path)
    write_grid(scenes, [], tmp_path, replace_existing=True)
    # The result of the older job must not be taken for that of the new job.
    assert [job.state for job in collect_grid(tmp_path)] == ["missing"]


@pytest.mark.parametrize("contacts", ["1e25", "nan", "inf", "-3", "0", "2.5"])
def test_a_log_whose_contacts_are_no_count_is_named(chaincor, tmp_path, contacts):
    (tmp_path / "grid.toml").write_text("[axes]\nparticles = [2]\n")
    jobs = tmp_path / "jobs"
    assert chaincor("inputs", tmp_path / "grid.toml", "-o", jobs)[0] == 0
    (folder,) = jobs.glob("0001*")
    log = f"contacts = {contacts}\nrestitution = 1\nrestitution_error = 1e-9\n"
    (folder / "log.lammps").write_text(log)
    status, out, _ = chaincor("collect", jobs, "-o", tmp_path / "results.sqlite")
    assert status == 1
    assert "1 unfinished" in out
    assert f"its log says contacts = {float(contacts):g}, which is no whole number" in out


@pytest.mark.parametrize("there", ["submit.bash", "0001/in.chain"])
def test_files_of_a_users_own_are_no_grid_to_write_over(tmp_path, there):
    own = tmp_path / there
    own.parent.mkdir(exist_ok=True)
    own.write_text("mine")
    scenes = [Scene(potential="harmonic", particles=3, velocity=0.1, scheme="verlet")]
    with pytest.raises(InputError, match=r"already\. Give another folder"):
        write_grid(scenes, [], tmp_path)
    assert own.read_text() == "mine"
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == [own]


@pytest.mark.parametrize(
    ("row", "wrong"),
    [
        ("1", "another number of fields"),
        ("1,0001,3,,more", "another number of fields"),
        ("1,../0001,3,", "no folder of the grid"),
        ("1,,3,", "no folder of the grid"),
        ("1,..,3,", "no folder of the grid"),
        ("1,0001,3,\n2,0001,4,", "an earlier row has"),
    ],
)
def test_a_damaged_row_of_a_manifest_is_named(chaincor, tmp_path, row, wrong):
    (tmp_path / "manifest.csv").write_text(f"number,folder,particles,refusal\n{row}\n")
    status, out, err = chaincor("collect", tmp_path, "-o", tmp_path / "s.sqlite")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert f"row 1 has {wrong}" in err or wrong in err
    assert not (tmp_path / "s.sqlite").exists()


RUN = Scene(
    potential="harmonic", particles=2, velocity=0.1, engine="lammps", scheme="verlet", timestep=0.01
)
# With eta = 0.81, two particles take up 2 * 0.1 * (1 + 0.9) = 0.38 of momentum.
LOG = f"""LAMMPS (22 Jul 2025)
contacts = 2
last_contact_time = 1.5
momentum_change = 0.38
wall_impulse = 0.38
scene = {RUN.sha256}
restitution = 0.81
restitution_error = 1e-7
"""
OTHER = (
    LOG.replace(RUN.sha256, "0" * 64)
    .replace("0.81", "0.64")
    .replace("contacts = 2", "contacts = 9")
)


def write_one_job(grid, log=LOG, asked="", manifest="1,job,0.1,\n"):
    job = grid / "job"
    job.mkdir(parents=True)
    (grid / "manifest.csv").write_text(f"number,folder,velocity,refusal\n{manifest}")
    (job / "scene.toml").write_text(RUN.to_toml())
    own = 'potential = "harmonic"\nparticles = 2\nvelocity = 0.1\ntolerance = 1e-4\n'
    (job / "asked.toml").write_text(asked or own)
    (job / "log.lammps").write_text(log)
    return collect_grid(grid)[0]


@pytest.mark.parametrize("before", ["", LOG.replace("0.81", "0.5"), OTHER, OTHER[:-80], "\0\n"])
@pytest.mark.parametrize("after", ["Total wall time: 0:00:01\n", OTHER[:-80], "WARNING: no\n"])
def test_the_last_whole_result_of_a_log_is_collected(tmp_path, before, after):
    job = write_one_job(tmp_path, before + LOG + after)
    assert (job.state, job.words) == ("done", "")
    columns = job.row.columns
    assert (columns["restitution"], columns["contacts"]) == (0.81, 2)
    assert job.scene.engine == "lammps"


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        (
            {"asked": 'potential = "harmonic"\nparticles = 2\nvelocity = 0.2\n'},
            "disagree on velocity",
        ),
        ({"asked": "particles = 2\nvelocity = 0.1\n"}, "disagree on potential"),
        ({"asked": RUN.replace(masses=(1.0, 2.0)).to_toml()}, "disagree on masses"),
        ({"asked": RUN.replace(timestep=0.02).to_toml()}, "disagree on timestep"),
        ({"manifest": "1,job,0.2,\n"}, "velocity = 0.1, and its row in manifest.csv '0.2'"),
        ({"log": LOG + OTHER}, "its log is of another scene"),
        ({"log": LOG + "restitution = 0.5\nrestitution_error = 0\n"}, "another scene"),
        ({"log": LOG[:-3]}, "it was stopped"),
        (
            {"log": LOG.replace("0.81", "0.82")},
            "restitution = 0.82, but its momentum_change gives 0.81",
        ),
        ({"log": LOG.replace("1e-7", "inf")}, "restitution_error = inf"),
        ({"log": LOG.replace("1.5", "-inf")}, "last_contact_time = -inf"),
        ({"log": LOG.replace("contacts = 2", "contacts = 2.5")}, "contacts = 2.5"),
    ],
)
def test_a_result_of_another_collision_is_not_collected(tmp_path, changed, words):
    job = write_one_job(tmp_path, **changed)
    assert (job.state, job.row) == ("unfinished", None)
    assert words in job.words


def test_a_folder_without_a_manifest_is_no_grid(chaincor, tmp_path):
    status, out, err = chaincor("collect", str(tmp_path), "-o", str(tmp_path / "s.sqlite"))
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "has no manifest.csv" in err


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--particles", "5", "-o", "jobs"], "--particles is for a scene"),
        (["--dry-run"], "--dry-run is for a scene"),
        (["--site", "absent", "-o", "jobs"], "the site file 'absent' cannot be read"),
    ],
)
def test_what_a_sweep_has_no_use_for_is_refused(options, line, chaincor, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_sweep(tmp_path / "sweep.toml", "[axes]\nspeed = [0.1, 0.2]\n")
    status, out, err = chaincor("inputs", "sweep.toml", *options)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert line in err
    assert not (tmp_path / "jobs").exists()


@pytest.mark.slow
def test_processes_write_the_same_grid(tmp_path, monkeypatch):
    scenes = [Scene(particles=3, speed=0.1 * k, tolerance=1e-4) for k in range(1, 7)]
    # At this point, particles pass through each other, so that it has no job.
    scenes.insert(2, Scene(potential="harmonic", particles=5, velocity=0.9))
    written = {}
    for least in (100, 2):
        monkeypatch.setattr(grid, "_LEAST_FOR_PROCESSES", least)
        monkeypatch.setattr(grid, "_PART", 2)
        folder = tmp_path / str(least)
        refusals = write_grid(scenes, ["speed"], folder)
        files = sorted(path for path in folder.rglob("*") if path.is_file())
        texts = {str(path.relative_to(folder)): path.read_text() for path in files}
        texts = {name: text.replace(str(folder), "") for name, text in texts.items()}
        assert [number for number, refusal in enumerate(refusals.values()) if refusal] == [2]
        written[least] = refusals, texts
    assert written[2] == written[100]
    assert sum(name.endswith("in.chain") for name in written[2][1]) == 6


def test_submit_is_for_sweeps(chaincor, tmp_path):
    status, _, err = chaincor("inputs", "--submit", "pbs", "-o", str(tmp_path / "job"))
    assert status == 2
    assert "--submit, --site, --jobs-per-task and --at-once work only with a sweep file" in err


@pytest.mark.parametrize("scheduler", SCHEDULERS)
def test_submit_scripts_are_bash_with_the_lines_of_the_site(scheduler, tmp_path):
    script = tmp_path / "submit"
    script.write_text(script_of(scheduler, ["a", "b"], site="module load lammps"))
    subprocess.run(["bash", "-n", script], check=True)
    lines = script.read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line and not line.startswith("#"))
    assert lines[0] == "#!/bin/bash"
    assert lines[first] == "module load lammps"
    array = {"slurm": "#SBATCH --array=1-2", "pbs": "#PBS -J 1-2", "bash": None}[scheduler]
    assert array is None or array in lines[:first]


@pytest.mark.parametrize(
    ("scheduler", "variable"), [("slurm", "SLURM_ARRAY_TASK_ID"), ("pbs", "PBS_ARRAY_INDEX")]
)
def test_an_array_task_runs_its_own_folder(scheduler, variable, tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    (tmp_path / "manifest.csv").write_text("number,folder,refusal\n")
    script = tmp_path / "submit"
    script.write_text(script_of(scheduler, ["a", "b"]))
    environment = os.environ | {"LMP": "echo ran", variable: "2"}
    subprocess.run(["bash", script], check=True, env=environment, cwd=tmp_path)
    assert (tmp_path / "b" / "screen.txt").read_text() == "ran -in in.chain -var restart 20\n"
    assert list((tmp_path / "a").iterdir()) == []


def test_names_of_folders_hold_nothing_of_a_users_text():
    scene = Scene(
        potential="formula", energy="0.5*$(s)^2".replace("$", ""), particles=2, velocity=0.1
    )
    assert folder_name(scene, ["energy", "velocity"], 12) == "0012_energy=0.5--s--2_velocity=0.1"


# Like sbatch and qsub, the test runs a copy of the script in a folder of the scheduler.
FAKE_SCHEDULERS = {
    "slurm": ("SLURM_ARRAY_TASK_ID", "SLURM_SUBMIT_DIR"),
    "pbs": ("PBS_ARRAY_INDEX", "PBS_O_WORKDIR"),
}


@pytest.mark.slow_cases
@pytest.mark.parametrize("scheduler", FAKE_SCHEDULERS)
@pytest.mark.parametrize("submitted_from", [".", "jobs", "elsewhere"])
def test_array_jobs_find_their_folders_wherever_they_are_submitted(
    chaincor, tmp_path, scheduler, submitted_from
):
    sweep = write_sweep(tmp_path / "grid.toml", "[axes]\nparticles = [2, 3]\n")
    jobs = tmp_path / "jobs"
    assert chaincor("inputs", sweep, "-o", jobs, "--submit", scheduler)[0] == 0
    spool = tmp_path / "spool"
    spool.mkdir()
    (tmp_path / "elsewhere").mkdir()
    copy = spool / "job_script"
    copy.write_text((jobs / f"submit.{scheduler}").read_text())
    task, folder = FAKE_SCHEDULERS[scheduler]
    place = tmp_path / submitted_from
    environment = os.environ | {"LMP": "echo ran", task: "2", folder: str(place)}
    subprocess.run(["bash", copy], check=True, env=environment, cwd=place)
    assert [path.parent.name for path in jobs.glob("*/screen.txt")] == ["0002_particles=3"]


def test_array_jobs_without_their_folders_say_so(tmp_path):
    script = tmp_path / "submit"
    script.write_text(script_of("slurm", ["a"], tmp_path / "gone"))
    done = subprocess.run(["bash", script], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == (
        "the folder of the jobs is not found: set JOBS to the folder of manifest.csv\n"
    )


@pytest.mark.slow
def test_a_log_of_another_run_is_not_collected(chaincor, tmp_path):
    sweep = write_sweep(
        tmp_path / "grid.toml",
        "[scene]\nparticles = 3\ntolerance = 1e-4\n[axes]\nspeed = [0.5, 0.7]\n",
    )
    jobs, store = tmp_path / "jobs", tmp_path / "results.sqlite"
    assert chaincor("inputs", sweep, "-o", jobs)[0] == 0
    assert submit(jobs) == 0
    first, second = sorted(jobs.glob("000*"))
    assert {job.state for job in collect_grid(jobs)} == {"done"}

    own = (second / "log.lammps").read_text()
    run = [LMP, "-in", "in.chain", "-var", "velocity", "0.03", "-screen", "none"]
    subprocess.run(run, cwd=second, env=lmp_environment(), check=True)
    other = (second / "log.lammps").read_text()
    for log, words in (
        (other, "its log is of a run at another velocity or step"),
        ((first / "log.lammps").read_text(), "its log is of another scene"),
        (unnamed(other), "its log is of another scene"),
        (unnamed((first / "log.lammps").read_text()), "its log is of another scene"),
    ):
        (second / "log.lammps").write_text(log)
        status, out, _ = chaincor("collect", jobs, "-o", store)
        assert status == 1
        assert "1 done" in out
        assert words in out
    # Logs of chaincor 0.1 did not name the scene.
    (second / "log.lammps").write_text(unnamed(own))
    assert {job.state for job in collect_grid(jobs)} == {"done"}


def unnamed(log):
    return "\n".join(line for line in log.splitlines() if "scene = " not in line)


@pytest.mark.parametrize(
    ("scheduler", "limit", "array"), [("slurm", 1000, "--array="), ("pbs", 10_000, "-J ")]
)
def test_arrays_are_split_at_the_limit_of_the_scheduler(scheduler, limit, array):
    folders = [f"{k:05d}" for k in range(2 * limit + 1)]
    single = Submission(scheduler, at_once=50).scripts(folders)
    assert list(single) == [f"submit-{k}.{scheduler}" for k in (1, 2, 3)]
    first, second, third = single.values()
    assert f"{array}1-{limit}%50\n" in first
    assert f"{array}1-{limit}%50\n" in second
    assert array not in third or f"{array}1-1%50\n" in third
    found = [line.strip() for text in single.values() for line in text.splitlines()]
    assert [line for line in found if line in set(folders)] == folders
    several = Submission(scheduler, jobs_per_task=3).scripts(folders)
    assert list(several) == [f"submit.{scheduler}"]
    assert f"{array}1-{-(-len(folders) // 3)}\n" in several[f"submit.{scheduler}"]


@pytest.mark.parametrize("scheduler", FAKE_SCHEDULERS)
def test_a_task_runs_its_jobs_even_if_one_fails(scheduler, tmp_path):
    names = ["a", "b", "c", "d", "e"]
    for name in names:
        (tmp_path / name).mkdir()
    (tmp_path / "manifest.csv").write_text("number,folder,refusal\n")
    script = tmp_path / "submit"
    script.write_text(script_of(scheduler, names, jobs_per_task=2))
    lmp = tmp_path / "lmp.sh"
    lmp.write_text('#!/bin/bash\necho ran\n[ "$(basename "$PWD")" != c ]\n')
    lmp.chmod(0o755)
    for number, status, ran in ((1, 0, "ab"), (2, 1, "abcd"), (3, 0, "abcde")):
        environment = os.environ | {"LMP": str(lmp), FAKE_SCHEDULERS[scheduler][0]: str(number)}
        done = subprocess.run(["bash", script], env=environment, cwd=tmp_path, check=False)
        assert done.returncode == status
        assert sorted(path.parent.name for path in tmp_path.glob("*/screen.txt")) == list(ran)


@pytest.mark.slow_cases
@pytest.mark.parametrize("scheduler", FAKE_SCHEDULERS)
def test_a_submitted_grid_runs_task_by_task(chaincor, tmp_path, scheduler):
    """Submit to a stand-in for sbatch or qsub, which copies the script and runs each task."""
    sweep = write_sweep(
        tmp_path / "grid.toml",
        "[scene]\nparticles = 3\ntolerance = 1e-4\n[axes]\nspeed = [0.1, 0.2, 0.3, 0.4, 0.5]\n",
    )
    jobs = tmp_path / "jobs"
    options = ["--submit", scheduler, "--jobs-per-task", "2", "--at-once", "2"]
    status, out, _ = chaincor("inputs", sweep, "-o", jobs, *options)
    script = jobs / f"submit.{scheduler}"
    assert (status, out.splitlines()[1]) == (0, f"run them: {script}")
    text = script.read_text()
    first, last, at_once = re.search(r"(?:--array=|-J )(\d+)-(\d+)%(\d+)", text).groups()
    assert (first, last, at_once) == ("1", "3", "2")
    spool = tmp_path / "spool"
    spool.mkdir()
    (spool / "job_script").write_text(text)
    task, folder = FAKE_SCHEDULERS[scheduler]
    for number in range(int(first), int(last) + 1):
        environment = lmp_environment() | {"LMP": str(LMP), task: str(number), folder: str(jobs)}
        subprocess.run(["bash", spool / "job_script"], env=environment, cwd=spool, check=True)
    status, out, _ = chaincor("collect", jobs, "-o", tmp_path / "results.sqlite")
    assert (status, out.split(";")[0]) == (0, "5 jobs: 5 done")


def test_similar_jobs_share_their_tables(tmp_path):
    scenes = [Scene(particles=4, tolerance=1e-4, speed=0.3 + 0.001 * k) for k in range(40)]
    write_grid(scenes, ["speed"], tmp_path)
    tables = {path.name for path in (tmp_path / "tables").iterdir()}
    # Speeds differ by 13 %. Each end of the range, and the number of rows, changes by at most one
    # step of 25 %. Three changes give four tables.
    assert len(tables) <= 4
    jobs = list(tmp_path.glob("00*"))
    assert {path.name for job in jobs for path in job.iterdir()} == {
        *("asked.toml", "chain.data", "in.chain", "scene.toml")
    }
    read = [re.findall(r'"\.\./tables/(\S+)"', (job / "in.chain").read_text()) for job in jobs]
    assert all(len(each) == 1 for each in read)
    assert {name for each in read for name in each} == tables


def test_a_shared_table_is_at_least_as_exact_as_a_job_needs():
    for potential in ("lj", "toda", "log"):
        for speed in (0.01, 0.3, 0.7):
            scene = Scene(potential=potential, particles=4, tolerance=1e-6, speed=speed)
            own, shared = (plan_script(scene, shared_table=wish) for wish in (False, True))
            # Margins are some bins wide, and more rows make bins smaller.
            assert shared.table.lengths[0] <= own.table.lengths[0] + 6 * own.table.spacing
            assert shared.table.longest >= own.table.longest - 6 * own.table.spacing
            assert shared.bar.table <= 1e-6


def test_jobs_per_task_is_for_arrays(chaincor, tmp_path):
    sweep = write_sweep(tmp_path / "grid.toml", "[axes]\nparticles = [2, 3]\n")
    status, out, err = chaincor("inputs", sweep, "-o", tmp_path / "jobs", "--jobs-per-task", "2")
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert "--jobs-per-task is for slurm and pbs. Use --at-once for bash" in err
