"""Test parameters of a formula as axes of a sweep and as columns of its store."""

import json

import numpy as np
import pytest

from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.campaign.points import scenes_of
from chaincor.workflows.campaign.sweep_file import read_sweep
from chaincor.workflows.errors import SweepError
from chaincor.workflows.store.query import query_rows
from chaincor.workflows.store.results_store import Store

BASE = '[scene]\npotential = "formula"\nenergy = "D*(1-exp(-a*s))^2"\nparticles = 3\n'


def sweep_of(tmp_path, text):
    path = tmp_path / "sweep.toml"
    path.write_text(text)
    return read_sweep(path)


@pytest.mark.parametrize(
    "axis",
    [
        "parameters.a = [4, 6.0, 8]",
        '"parameters.a" = [4, 6, 8]',
        "parameters = { a = [4, 6, 8] }",
        "parameters.a = { from = 4, to = 8, points = 3 }",
    ],
)
def test_a_parameter_is_an_axis(tmp_path, axis):
    sweep = sweep_of(tmp_path, f"{BASE}parameters = {{ D = 0.0139 }}\n[axes]\n{axis}\n")
    assert sweep.axes == {"parameters.a": 3}
    assert [scene.parameters for scene in sweep.scenes] == [
        {"D": 0.0139, "a": a} for a in (4.0, 6.0, 8.0)
    ]


@pytest.mark.parametrize("key", ["speed", "velocity"])
def test_points_that_share_their_parts_give_the_scenes_that_each_gives_alone(tmp_path, key):
    axes = f"{key} = [0.01, 1, 0.3, 1e130]\ntolerance = [1e-4, 1e-6]\ncompression = [0.0, 0.1]"
    sweep = sweep_of(tmp_path, f'[scene]\nparticles = 3\nengine = "reference"\n[axes]\n{axes}\n')
    points = [sweep.scenes.point(k) for k in range(len(sweep.scenes))]
    valid = [
        point for point in points if point.fields[key] < 1e3 or not point.fields["compression"]
    ]
    for found, point in zip(scenes_of(valid), valid, strict=True):
        alone = point.scene()
        assert (found, found.canonical_json) == (alone, alone.canonical_json)
        assert found.collision_sha256 == alone.collision_sha256
        assert found.problem.impact_velocity == alone.impact_velocity
        for name in ("velocities", "largest_speed", "is_standard", "heaviest_pair"):
            both = [getattr(scene.line, name) for scene in (found, alone)]
            assert np.array_equal(*both), name


def test_a_wrong_speed_is_named_with_its_point(tmp_path):
    sweep = sweep_of(tmp_path, '[scene]\nengine = "reference"\n[axes]\nspeed = [0.1, -0.2]\n')
    with pytest.raises(SceneError, match=r"point 2 \(speed = -0.2\): speed is -0.2"):
        scenes_of([sweep.scenes.point(k) for k in range(2)])


def test_parameters_move_together_and_override(tmp_path):
    sweep = sweep_of(
        tmp_path,
        'zip = [["parameters.a", "parameters.D"]]\n'
        f"{BASE}parameters = {{ D = 1.0, a = 1.0 }}\n"
        "[axes]\nparameters.a = [5, 10]\nparameters.D = [0.02, 0.005]\n",
    )
    assert [scene.bond.stiffness for scene in sweep.scenes] == pytest.approx([1.0, 1.0], rel=1e-14)


def test_what_is_no_parameter_is_refused(tmp_path):
    sweep = sweep_of(tmp_path, f"{BASE}[axes]\nparameters.a = [4]\n")
    with pytest.raises(
        SceneError, match=r"point 1 .parameters\.a = 4.: energy .* uses 'D', an unknown parameter"
    ):
        sweep.scenes[0]
    with pytest.raises(SweepError, match=r"axis 'parameter\.a' is not a field"):
        sweep_of(tmp_path, f'{BASE}[axes]\n"parameter.a" = [4]\n')


def test_hash_follows_the_formula_not_its_spelling():
    fields = {"potential": "formula", "particles": 5, "velocity": 0.1}
    base = Scene(energy="D*(1-exp(-a*s))^2", parameters={"D": 0.0139, "a": 6}, **fields)
    same = Scene(energy="D * (1 - exp(-a*s))**2", parameters={"a": 6.0, "D": 0.0139}, **fields)
    assert same.sha256 == base.sha256
    assert base.replace(parameters={"D": 0.0139, "a": 7.0}).sha256 != base.sha256
    assert base.replace(energy="D*(1-exp(-a*s))^4 + a*s^2").sha256 != base.sha256
    assert Scene.from_toml(base.to_toml()) == base
    morse = Scene(potential="morse", speed=0.4)
    assert morse.sha256 == morse.replace(morse_a=6.0).sha256
    assert morse.sha256 != morse.replace(morse_a=5.0).sha256


def test_columns_and_plots_of_a_store(tmp_path, make_attempt, chaincor):
    path = tmp_path / "store.sqlite"
    with Store(path) as store:
        store.record(
            [
                make_attempt(
                    Scene(
                        potential="formula",
                        energy="D*(1-exp(-a*s))^2",
                        parameters={"D": 0.01, "a": a},
                        particles=3,
                        velocity=v,
                    ),
                    0.5 + v,
                )
                for a in (4.0, 6.0)
                for v in (0.1, 0.2)
            ]
        )
        rows = query_rows(store, ["parameters.a", "velocity"], where=["parameters.a>5"])
        assert sorted(rows) == [(6.0, 0.1), (6.0, 0.2)]
        ((text, parameters, a),) = set(query_rows(store, ["energy", "parameters", "morse_a"])[:1])
        assert text == "D * (1 - exp(-a * s)) ** 2"
        assert json.loads(parameters).keys() == {"D", "a"}
        assert a is None
    curves = tmp_path / "curves.png"
    status, _, err = chaincor("plot", path, "--x", "velocity", "-o", curves)
    assert status == 0, err
    assert curves.stat().st_size > 1000
