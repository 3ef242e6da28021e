"""Test chaincor sweep, show, plot and store as users run them."""

import json

import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.sweep_file import read_sweep
from chaincor.workflows.errors import SweepError
from chaincor.workflows.store.results_store import Store

SWEEP = """
store = "out.sqlite"
[scene]
engine = "reference"
potential = "harmonic"
[axes]
particles = [2, 3, 5]
velocity = { from = 0.01, to = 0.1, points = 2, spacing = "log" }
"""


@pytest.fixture
def sweep_file(tmp_path):
    def write(text=SWEEP):
        path = tmp_path / "sweep.toml"
        path.write_text(text)
        return path

    return write


# ---- the file -----------------------------------------------------------------------------------


def points(path, *fields):
    return [tuple(getattr(scene, field) for field in fields) for scene in read_sweep(path).scenes]


def test_axes_are_crossed(sweep_file):
    path = sweep_file("[axes]\nparticles = [10, 20]\nspeed = [0.1, 0.2]")
    assert points(path, "particles", "speed") == [(10, 0.1), (10, 0.2), (20, 0.1), (20, 0.2)]


def test_zipped_axes_move_together(sweep_file):
    path = sweep_file(
        'zip = [["particles", "speed"]]\n'
        '[axes]\nparticles = [10, 20]\nspeed = [0.1, 0.2]\npotential = ["lj", "log"]'
    )
    assert points(path, "particles", "speed", "potential") == [
        (10, 0.1, "lj"),
        (10, 0.1, "log"),
        (20, 0.2, "lj"),
        (20, 0.2, "log"),
    ]


def test_an_axis_of_tables_sets_several_fields(sweep_file):
    path = sweep_file(
        "[axes]\n"
        'bond = [{potential = "lj"}, {potential = "toda", toda_b = 5.0}]\nparticles = [4, 5]'
    )
    assert points(path, "potential", "toda_b") == [("lj", None)] * 2 + [("toda", 5.0)] * 2


@pytest.mark.parametrize(
    ("axis", "values"),
    [
        ("speed = {from = 0.1, to = 0.5, points = 5}", [0.1, 0.2, 0.3, 0.4, 0.5]),
        ('speed = {from = 0.01, to = 1, points = 3, spacing = "log"}', [0.01, 0.1, 1.0]),
        ("speed = {from = 0.1, to = 0.3, step = 0.1}", [0.1, 0.2, 0.3]),
        ("particles = {from = 10, to = 14, step = 2}", [10, 12, 14]),
        ('particles = {from = 2, to = 8, points = 9, spacing = "log"}', [2, 3, 4, 5, 6, 7, 8]),
    ],
)
def test_ranges(sweep_file, axis, values):
    found = [value for (value,) in points(sweep_file(f"[axes]\n{axis}"), axis.split()[0])]
    assert found == pytest.approx(values, rel=1e-15)


def test_seeds_are_whole_numbers_that_no_float_rounds(sweep_file):
    path = sweep_file(
        "[scene]\ntemperature = 1e-4\n"
        "[axes]\nseed = {from = 9007199254740993, to = 9007199254740995}"
    )
    assert points(path, "seed") == [(2**53 + 1,), (2**53 + 2,), (2**53 + 3,)]


def test_an_axis_takes_the_place_of_what_contradicts_it(sweep_file):
    path = sweep_file("[scene]\nvelocity = 0.1\ntolerance = 1e-4\n[axes]\nspeed = [0.1]")
    assert points(path, "speed", "velocity") == [(0.1, None)]
    path = sweep_file('[scene]\ntolerance = 1e-4\n[axes]\nscheme = ["verlet"]')
    assert points(path, "scheme", "tolerance") == [("verlet", None)]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("particles = 10", "put fields of the scene under"),
        ("[axes]\ncolour = [1]", "not a field"),
        ("[axes]\nspeed = 1.0", "Give a list"),
        ("[axes]\nspeed = []", "Give a list"),
        ("[axes]\nspeed = {from = 1.0, to = 2.0}", "points or step"),
        ("[axes]\nspeed = {from = 1.0, to = 2.0, points = 2, base = 2}", "points or step"),
        ('[axes]\nspeed = {from = -1.0, to = 2.0, points = 2, spacing = "log"}', "above zero"),
        ("[axes]\nspeed = {from = 1.0, to = 2.0, step = -0.1}", "a step that leads"),
        ("[axes]\nspeed = {from = 1.0, to = 2.0, step = 0}", "a step that leads"),
        ("[axes]\nseed = {from = 1.0, to = 2.0}", "two whole numbers"),
        ("[axes]\nseed = {from = 2, to = 1}", "two whole numbers"),
        ("[axes]\nseed = {from = 1, to = 9, points = 3}", "two whole numbers"),
        ("[axes]\nspeed = {from = 0.1, to = inf, points = 2}", "finite numbers"),
        ("[axes]\nspeed = {from = true, to = 1.0, points = 2}", "finite numbers"),
        ('[axes]\nspeed = {from = 0.1, to = 1.0, points = 2, spacing = "cubic"}', "linear, or log"),
        ("[axes]\nspeed = {from = 0.1, to = 1.0, points = 2.5}", "a whole number"),
        (
            "[axes]\nspeed = {from = 0.1, to = 1.0, points = 4000000000}\n"
            "velocity = {from = 0.1, to = 1.0, points = 4000000000}",
            "16000000000000000000 points. Give at most 4611686018427387904",
        ),
        (
            "[axes]\nparticles = {from = 2, to = 1e9, points = 100000000}",
            "at most 10000000 values",
        ),
        ("zip = 3", "Give lists of axes"),
        ('zip = ["speed"]', "Give lists of axes"),
        ('zip = [["speed", "particles"]]\n[axes]\nspeed = [1.0]\nparticles = [2, 3]', "lengths"),
        ('zip = [["speed"], ["speed"]]\n[axes]\nspeed = [1.0]', "List each axis once"),
        ('[scene]\ndump = "a.dump"', "one place"),
        ("scene = 3", "Give a table"),
        ("arrays = 3", "true or false"),
        ("details = 3", "true or false"),
        ("store = 3", "Give the name of a file"),
    ],
)
def test_nonsense_is_refused_by_name(sweep_file, text, said):
    with pytest.raises(SweepError, match=said):
        read_sweep(sweep_file(text))


def test_a_point_that_is_no_scene_is_named(chaincor, sweep_file):
    path = sweep_file("[axes]\nparticles = [10, 0]")
    status, _, error = chaincor("sweep", path)
    assert status == 2
    assert "point 2 (particles = 0)" in error
    assert "Traceback" not in error


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "[axes]\nparticles = [3, 4]\nbond = [{particles = 5}, {speed = 0.1}]",
            "axes 'particles' and 'bond' both set particles",
        ),
        (
            'zip = [["a", "b"]]\n[axes]\na = [{speed = 0.1}]\nb = [{speed = 0.2, particles = 3}]',
            "axes 'a' and 'b' both set speed",
        ),
        (
            "[axes]\nparameters.a = [1]\nbond = [{parameters = {a = 1, D = 1}}]",
            r"axes 'bond' and 'parameters\.a' both set parameters\.a",
        ),
        (
            "[axes]\nx = [{parameters = {a = 1}}]\ny = [{parameters = {D = 1}}]",
            "axes 'x' and 'y' both set parameters",
        ),
        ('[axes]\n"parameters.a" = [1]\nparameters.a = [2]', "given twice, with quotes"),
        ('[axes]\nbond = [{arrays = "a.npz"}]', "'arrays' in a sweep would write every point"),
    ],
)
def test_of_two_values_for_one_field_none_is_dropped_silently(sweep_file, text, said):
    with pytest.raises(SweepError, match=said):
        read_sweep(sweep_file(text))


def test_axes_that_never_set_a_field_at_one_point_may_share_it(sweep_file):
    path = sweep_file(
        'zip = [["a", "b"]]\n[axes]\n'
        "a = [{speed = 0.1}, {particles = 3}]\nb = [{particles = 4}, {speed = 0.2}]"
    )
    assert points(path, "particles", "speed") == [(4, 0.1), (3, 0.2)]


def test_parameters_as_an_axis_are_tables(sweep_file):
    path = sweep_file(
        '[scene]\npotential = "formula"\nenergy = "D*(1-exp(-a*s))^2"\n'
        "[axes]\nparameters = [{D = 1, a = 6}, {D = 2, a = 6}]"
    )
    assert points(path, "parameters") == [({"D": 1.0, "a": 6.0},), ({"D": 2.0, "a": 6.0},)]


# ---- the commands -------------------------------------------------------------------------------


def test_dry_run_computes_and_writes_nothing(chaincor, sweep_file, tmp_path):
    status, out, _ = chaincor("sweep", sweep_file(), "--dry-run")
    assert status == 0
    assert "points       6 (3 particles x 2 velocity)" in out
    assert not (tmp_path / "out.sqlite").exists()
    status, out, _ = chaincor("sweep", sweep_file(), "--dry-run", "--json")
    forecast = json.loads(out)
    assert len(forecast["points"]) == forecast["to_compute"]["points"] == 6


def test_a_forecast_counts_each_collision_once(chaincor, sweep_file):
    path = sweep_file("[scene]\nparticles = 2\n[axes]\nspeed = [0.1, 0.2, 0.1]\n")
    assert "\nto compute   2, into" in chaincor("sweep", path, "--dry-run")[1]


def test_a_forecast_of_a_large_sweep_is_made_from_a_sample(chaincor, sweep_file):
    small, large = (
        json.loads(
            chaincor(
                "sweep",
                sweep_file(SWEEP.replace("points = 2,", f"points = {n},")),
                "--dry-run",
                "--json",
            )[1]
        )
        for n in ("2000", "20000000")
    )
    assert (small["number_of_points"], large["number_of_points"]) == (6000, 60_000_000)
    assert (small["to_compute"]["sample"], large["to_compute"]["sample"]) == (None, 2000)
    few, many = small["to_compute"], large["to_compute"]
    # The two sweeps have equal shares of the three lengths; costs vary little along the other axis.
    for name in ("points", "seconds", "disk_bytes"):
        assert many[name] == pytest.approx(10_000 * few[name], rel=0.05)
    assert len(large["points"]) < 10_000


@pytest.mark.slow
def test_a_sweep_from_file_to_plots(chaincor, sweep_file, tmp_path):
    path, store = sweep_file(), tmp_path / "out.sqlite"
    status, out, error = chaincor("sweep", path, "--shard", "1/2", "--json", "--workers", "1")
    assert (status, json.loads(out)["computed"], error) == (0, 3, "")
    shard = tmp_path / "out.shards" / "1-of-2.sqlite"
    assert json.loads(out)["store"] == str(shard)
    assert chaincor("store", "merge", store, shard.parent)[0] == 0
    status, out, _ = chaincor("sweep", path, "--json", "--workers", "1")
    assert (status, json.loads(out)["computed"], json.loads(out)["found"]) == (0, 3, 3)
    assert "nothing to compute: 6" in chaincor("sweep", path)[1]

    status, out, _ = chaincor("show", store, "--where", "particles=2", "--columns", "restitution")
    assert out.split() == ["restitution", "1", "1"]  # two particles lose no energy
    rows = json.loads(chaincor("show", store, "--json")[1])
    assert (rows["count"], len(rows["rows"])) == (6, 6)
    assert "2 of 6 rows" in chaincor("show", store, "--limit", 2)[1]

    assert chaincor("plot", store, "--x", "velocity", "--by", "particles")[0] == 0
    assert store.with_suffix(".png").stat().st_size > 5000
    heat = tmp_path / "heat.png"
    status, *_ = chaincor(
        "plot", store, "--x", "velocity", "--y", "particles", "--colour", "restitution", "-o", heat
    )
    assert status == 0
    assert heat.stat().st_size > 5000

    assert ": 6 rows (6 added, " in chaincor("store", "merge", tmp_path / "all.sqlite", store)[1]
    assert chaincor("store", "export", store, tmp_path / "all.csv")[0] == 0
    assert len((tmp_path / "all.csv").read_text().splitlines()) == 7


@pytest.mark.slow
def test_failures_are_counted_and_set_the_exit_status(chaincor, sweep_file, tmp_path):
    path = sweep_file('[scene]\npotential = "harmonic"\n[axes]\nvelocity = [0.9]\nparticles = [5]')
    status, out, _ = chaincor("sweep", path, "--workers", "1")
    assert (status, "1 failed" in out) == (1, True)
    status, out, _ = chaincor("sweep", path)
    assert (status, "were not repeated" in out) == (1, True)
    rows = json.loads(
        chaincor("show", tmp_path / "sweep.sqlite", "--columns", "failure", "--json")[1]
    )
    assert rows["rows"] == [{"failure": "CrossingError"}]


@pytest.mark.parametrize(
    "arguments",
    [
        ("sweep", "none.toml"),
        ("sweep", "{file}", "--shard", "3/2"),
        ("sweep", "{file}", "--shard", "x"),
        ("sweep", "{file}", "--scheduler", "tcp://h:1", "--workers", "2"),
        ("show", "none.sqlite"),
        ("plot", "none.sqlite"),
        ("store", "merge", "a.sqlite", "none.sqlite"),
        ("store", "export", "none.sqlite", "a.csv"),
    ],
)
def test_bad_input_is_one_line_and_status_2(chaincor, sweep_file, arguments):
    path = sweep_file()
    status, out, error = chaincor(*(a.format(file=path) for a in arguments))
    assert (status, out) == (2, "")
    assert error.startswith("chaincor: ")
    assert error.count("\n") == 1


def test_a_limit_beyond_all_numbers_of_the_store_shows_all(chaincor, tmp_path, make_attempt):
    path = tmp_path / "s.sqlite"
    with Store(path) as store:
        store.record([make_attempt(Scene(potential="lj", particles=n)) for n in (2, 3)])
    heads = chaincor("show", path)[1].splitlines()[0].split()
    assert "toda_b" not in heads
    with Store(path) as store:
        store.record([make_attempt(Scene(potential="toda", particles=2, toda_b=b)) for b in (3, 9)])
    heads, *rows = (line.split() for line in chaincor("show", path)[1].splitlines())
    assert sorted(row[heads.index("toda_b")] for row in rows if row[0] == "toda") == ["3", "9"]
    for limit in (2**63, 10**30):
        status, out, error = chaincor(
            "show", path, "--limit", limit, "--columns", "particles, speed"
        )
        assert (status, error, len(out.splitlines())) == (0, "", 5)
    status, out, error = chaincor("show", path, "--limit", 1, "--columns", "particles")
    assert (status, out.splitlines()[-1]) == (0, "1 of 4 rows; --limit 0 shows all")
    status, out, error = chaincor("show", path, "--where", "particles=9", "--json")
    assert (status, json.loads(out)["rows"]) == (0, [])


def test_jobs_that_cannot_be_kept_are_refused_before_anything_fails(chaincor, sweep_file, tmp_path):
    path = sweep_file("[axes]\nparticles = [3]")
    (tmp_path / "kept").write_text("mine")
    status, _, error = chaincor("sweep", path, "--keep-jobs", tmp_path / "kept", "--workers", 1)
    assert (status, "is a file. Give another path" in error) == (2, True)
    with Store(tmp_path / "sweep.sqlite") as store:
        assert len(store) == 0
