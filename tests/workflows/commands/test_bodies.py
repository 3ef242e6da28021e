"""Test sweeps and plots over masses, targets and contacts."""

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.sweep_file import read_sweep
from chaincor.workflows.errors import SweepError
from chaincor.workflows.store.query import query_rows
from chaincor.workflows.store.results_store import Store

HEAD = 'store = "s.sqlite"\n[scene]\nparticles = 4\nengine = "reference"\ntolerance = 1e-6\n'


@pytest.fixture
def sweep_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def write(text):
        path = tmp_path / "s.toml"
        path.write_text(HEAD + text)
        return path

    return write


def test_a_list_of_lists_is_an_axis_and_a_list_under_scene_one_value(sweep_file):
    sweep = read_sweep(
        sweep_file(
            "target_masses = [1, 2]\n[axes]\nmasses = [[1, 2], [1, 3], [4]]\n"
            "target_particles = { from = 2, to = 6, step = 2 }\n"
        )
    )
    assert sweep.axes == {"masses": 3, "target_particles": 3}
    assert [(s.masses, s.target_particles, s.target_masses) for s in sweep.scenes][:4] == [
        ((1.0, 2.0), 2, (1.0, 2.0)),
        ((1.0, 2.0), 4, (1.0, 2.0)),
        ((1.0, 2.0), 6, (1.0, 2.0)),
        ((1.0, 3.0), 2, (1.0, 2.0)),
    ]


def test_other_axes(sweep_file):
    sweep = read_sweep(
        sweep_file(
            'contact = "power"\n[axes]\n'
            'contact_stiffness = { from = 0.1, to = 10, points = 3, spacing = "log" }\n'
            "contact_exponent = [1, 1.5]\ncompression = [0.0, 0.01]\n"
        )
    )
    assert len({scene.sha256 for scene in sweep.scenes}) == 12
    assert sweep.scenes[11].contact_stiffness == 10.0
    # A range gives numbers, each of which is the mass of all particles.
    heavy = read_sweep(
        sweep_file("target_particles = 1\n[axes]\ntarget_masses = { from = 1, to = 9, points = 3 }")
    )
    assert [scene.target_masses for scene in heavy.scenes] == [(1.0,), (5.0,), (9.0,)]


@pytest.mark.parametrize("axis", ["[1, 2]", "[[1, 2], 3]", "[true]"])
def test_an_axis_of_numbers_is_refused_where_a_value_is_a_list(sweep_file, axis):
    with pytest.raises(SweepError, match=r"Give a list of lists, such as \[\[1, 2\], \[1, 3\]\]"):
        read_sweep(sweep_file(f"[axes]\nmasses = {axis}\n"))


def test_files_are_looked_for_beside_the_sweep_file(sweep_file, tmp_path, monkeypatch):
    (tmp_path / "m.txt").write_text("1 2 3 4")
    (tmp_path / "s.csv").write_text("strain\n0\n0\n0.01\n0\n")
    path = sweep_file('initial = "s.csv"\n[axes]\nmasses = ["1,2", "m.txt", [5]]\n')
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    masses = [scene.masses for scene in read_sweep(path).scenes]
    assert masses == [(1.0, 2.0), (1.0, 2.0, 3.0, 4.0), (5.0,)]
    assert read_sweep(path).scenes[0].initial_state.strains[1] == 0.01


@pytest.mark.slow
def test_a_sweep_over_a_mass_ratio_is_a_curve(sweep_file, chaincor, monkeypatch):
    drawn = {}
    from chaincor.analysis.figures import store_plots

    original = store_plots.plot_curves

    def keep(curves, *names, **options):
        drawn.update(curves)
        return original(curves, *names, **options)

    monkeypatch.setattr(store_plots, "plot_curves", keep)
    path = sweep_file(
        '[axes]\nmasses = [[1, 0.5], [1, 1], [1, 2], [1, 4]]\npotential = ["lj", "toda"]\n'
    )
    status, _, err = chaincor("sweep", str(path), "--workers", "1")
    assert status == 0, err
    plot = ("plot", "s.sqlite", "--x", "masses.2", "--y", "kinematic_restitution")
    status, _, err = chaincor(*plot)
    assert status == 0, err
    # The curve includes the chain of equal masses, which stores save without masses.
    assert set(drawn) == {"potential = lj", "potential = toda"}
    x, y = drawn["potential = lj"]
    assert x == [0.5, 1.0, 2.0, 4.0]
    with Store("s.sqlite") as store:
        for ratio, e in zip(x, y, strict=True):
            scene = Scene(particles=4, masses=[1, ratio], engine="reference", tolerance=1e-6)
            assert store.get(scene).result["kinematic_restitution"] == e
        assert len(query_rows(store, ["masses"], where=["masses="])) == 2
    drawn.clear()
    status, _, err = chaincor(*plot[:2], "--x", "speed", "--where", "potential=lj")
    assert (status, len(drawn)) == (0, 4), err
    assert "masses = 1.0, 4.0" in drawn
    status, _, err = chaincor(*plot[:2], "--x", "masses")
    assert status == 2
    assert "that of particle 2 is masses.2" in err


def test_chains_of_other_periods_are_other_curves(tmp_path, make_attempt, monkeypatch, chaincor):
    monkeypatch.chdir(tmp_path)
    common = {"potential": "harmonic", "velocity": 0.1, "particles": 6}
    lists = ([1, 2], [1, 3], [1, 2, 1], [1, 3, 1])
    with Store("s.sqlite") as store:
        store.record(
            [make_attempt(Scene(**common, masses=m), 0.1 * k) for k, m in enumerate(lists, 1)]
        )
    drawn = {}
    from chaincor.analysis.figures import store_plots

    original = store_plots.plot_curves
    monkeypatch.setattr(
        store_plots, "plot_curves", lambda c, *n, **o: (drawn.update(c), original(c, *n, **o))[1]
    )
    status, _, err = chaincor("plot", "s.sqlite", "--x", "masses.2")
    assert status == 0, err
    found = sorted((tuple(x), tuple(np.round(y, 6))) for x, y in drawn.values())
    assert found == [
        ((2.0, 3.0), (0.1, 0.2)),
        ((2.0, 3.0), (0.3, 0.4)),
    ]


def test_curves_whose_values_begin_alike_are_named_in_full(
    tmp_path, make_attempt, monkeypatch, chaincor
):
    monkeypatch.chdir(tmp_path)
    common = {"potential": "harmonic", "particles": 8}
    attempts = [
        make_attempt(Scene(**common, masses=[1, 2, 3, 4, 5, 6, 7, last], velocity=v), 0.1 * v)
        for last in (8, 9)
        for v in (0.1, 0.2)
    ]
    with Store("s.sqlite") as store:
        store.record(attempts)
    drawn = {}
    from chaincor.analysis.figures import store_plots

    original = store_plots.plot_curves
    monkeypatch.setattr(
        store_plots, "plot_curves", lambda c, *n, **o: (drawn.update(c), original(c, *n, **o))[1]
    )
    status, _, err = chaincor("plot", "s.sqlite", "--x", "velocity")
    assert status == 0, err
    assert [label[-3:] for label in sorted(drawn)] == ["8.0", "9.0"]
