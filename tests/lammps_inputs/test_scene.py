"""Test that each bad scene gives one clear line, and that TOML and hashes are stable."""

import math
import os
import subprocess
import sys
import threading
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chaincor.lammps_inputs.bonds.potentials import POTENTIAL_NAMES, LennardJones, Toda
from chaincor.lammps_inputs.bonds.power_bond import Power
from chaincor.lammps_inputs.bonds.user_bond import UserBond
from chaincor.lammps_inputs.errors import InputError, PotentialError, SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from tests.elsewhere import old_processor

BAD = [
    # fields, what the line must say
    ({"colour": 3}, "unknown key 'colour'. Use one of potential, toda_b"),
    ({"potential": "mie"}, f"expected one of {', '.join(POTENTIAL_NAMES)}"),
    ({"potential": 3}, "expected one of harmonic"),
    ({"particles": 0}, "particles is 0: .*greater than or equal to 1"),
    ({"particles": -5}, "particles is -5"),
    ({"particles": 2.5}, "particles is 2.5: .*integer"),
    ({"particles": True}, "particles is True: expected a whole number"),
    ({"particles": np.True_}, "expected a whole number"),
    ({"velocity": np.array(True)}, "expected a number"),
    ({"velocity": np.complex128(0.1 + 1j)}, "expected a number"),
    ({"velocity": b"0.1"}, "expected a number"),
    ({"particles": 10**9}, "particles is 1000000000"),
    ({"particles": "many"}, "particles is 'many'"),
    ({"particles": None}, "particles is None"),
    ({"speed": math.nan}, "speed is nan: .*finite"),
    ({"speed": math.inf}, "speed is inf"),
    ({"speed": 0.0}, "speed is 0.0: .*greater than 0"),
    ({"speed": -0.4}, "speed is -0.4"),
    ({"speed": True}, "speed is True: expected a number"),
    ({"speed": 1e200}, "the impact velocity would be 1.28489e\\+199"),
    ({"speed": 5e-324}, "the impact velocity would be 0"),
    ({"velocity": math.nan}, "velocity is nan"),
    ({"velocity": -math.inf}, "velocity is -inf"),
    ({"velocity": 1e200}, "the impact velocity would be 1e\\+200"),
    ({"speed": 0.4, "velocity": 0.1}, "speed and velocity are both given. Give one"),
    ({"potential": "harmonic", "speed": 0.4}, "harmonic bond does not have; give velocity"),
    ({"potential": "lj", "toda_b": 5.0}, "toda_b goes with potential 'toda', not 'lj'"),
    ({"potential": "toda", "toda_b": 0.0}, "toda_b is 0.0"),
    ({"potential": "toda", "toda_b": 1e300}, "toda_b is 1e\\+300"),
    ({"potential": "lj", "morse_a": 5.0}, "morse_a goes with potential 'morse', not 'lj'"),
    ({"potential": "lj", "energy": "s^2"}, "energy goes with potential 'formula', not 'lj'"),
    ({"potential": "formula"}, "potential 'formula' needs energy"),
    (
        {"potential": "formula", "energy": "a*s^2", "parameters": {"a": "1"}},
        "a is '1'. Give a number",
    ),
    (
        {"potential": "formula", "energy": "s^2", "parameters": {"a": 1}},
        "does not use the parameter 'a'",
    ),
    ({"potential": "toda", "power_c": 1.0}, "power_c goes with potential 'power'"),
    ({"potential": "power"}, "needs power_order and power_c"),
    ({"potential": "power", "power_order": 3}, "needs power_order and power_c"),
    ({"potential": "power", "power_order": 2, "power_c": 1.0}, "power_order is 2"),
    ({"potential": "power", "power_order": 3, "power_c": 1.0}, "power_c is 1.0. .*negative"),
    ({"potential": "power", "power_order": 4, "power_c": -1.0}, "power_c is -1.0. .*positive"),
    ({"potential": "power", "power_order": 4, "power_c": 1e-320}, "power_c is 1e-320"),
    ({"potential": "table"}, "potential 'table' needs bond_file"),
    ({"potential": "table", "bond_file": "absent.table"}, "cannot read the bond table"),
    ({"potential": "table", "bond_file": "/dev/zero"}, "'/dev/zero': it is no plain file"),
    ({"bond_file": "some.table"}, "bond_file goes with potential 'table'"),
    ({"engine": "gromacs"}, "engine is 'gromacs'"),
    ({"wall": "soft"}, "wall is 'soft'"),
    ({"scheme": "order3"}, "scheme is 'order3'"),
    ({"table": "bicubic"}, "table is 'bicubic'"),
    ({"table_points": 2}, "table_points is 2"),
    ({"tolerance": 0.0}, "tolerance is 0.0"),
    ({"tolerance": 2.0}, "tolerance is 2.0"),
    ({"tolerance": math.nan}, "tolerance is nan"),
    ({"tolerance": 1e-6, "timestep": 0.1}, "tolerance and timestep are both given"),
    ({"tolerance": 1e-6, "wall": "event", "table": "spline"}, "tolerance and wall, table are both"),
    ({"timestep": -0.1}, "timestep is -0.1"),
    ({"timestep": 1.0}, "timestep is 1. Give less than 1: .*unstable"),
    ({"timestep": 5e-8, "masses": (1e4,)}, "timestep is 5e-08. Give 1e-07 or more"),
    ({"wall": "reflect", "scheme": "order6"}, "wall 'reflect' goes with scheme 'verlet'"),
    ({"engine": "reference", "table": "spline"}, "table is for engine 'lammps'"),
    ({"engine": "reference", "wall": "reflect"}, "wall 'reflect' is for engine 'lammps'"),
    ({"dump_frames": 0.0}, "dump_frames is 0.0"),
    ({"error": False}, "error is False, but choosing the numerics needs an error bar"),
    ({"potential": "harmonic", "table": "spline"}, "table is for bond tables"),
    ({"dump_frames": "hits"}, "dump_frames is 'hits': expected a positive number, or 'contacts'"),
    ({"dump_frames": True}, "dump_frames is True: expected a positive number, or 'contacts'"),
    ({"error": "perhaps"}, "error is 'perhaps'"),
    ({"save": 3}, "save is 3"),
]


def test_a_number_that_python_cannot_print_is_named():
    with pytest.raises(
        SceneError, match="particles is an object of type int: input should be less"
    ):
        Scene(particles=10**5000)


@pytest.mark.parametrize(("fields", "line"), BAD, ids=[str(fields)[:60] for fields, _ in BAD])
def test_bad_input_is_one_clear_line(fields, line):
    with pytest.raises(InputError, match=line) as caught:
        Scene(**fields)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_status == 2


anything = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.lists(st.integers(), max_size=2),
    st.sampled_from(["lj", "toda", "log", "power", "harmonic", "reflect", "order4", 1e-160, 1e140]),
)


@settings(max_examples=400)
@given(st.dictionaries(st.sampled_from(sorted(Scene.model_fields)), anything, max_size=5))
def test_no_input_escapes_validation(fields):
    try:
        scene = Scene(**fields)
    except InputError as error:
        lines = str(error).splitlines()
        mistakes = error.mistakes if isinstance(error, SceneError) else ()
        assert len(lines) == 1 + len(mistakes)
    else:
        lines = [f"{scene.label} at {scene.impact_velocity}"]
        assert 0.0 < scene.impact_velocity < math.inf
        assert scene.bond.energy(0.0) == 0.0
    assert all(len(line) < 500 for line in lines)


def test_defaults_of_a_bare_scene():
    scene = Scene()
    assert (scene.label, scene.particles, scene.engine) == ("lj", 100, "lammps")
    assert scene.impact_velocity == 0.4 * LennardJones().natural_speed
    assert not scene.explicit
    assert Scene(potential="harmonic").impact_velocity == 0.1
    assert Scene(potential="toda").bond == Toda(10.0)
    assert Scene(potential="power", power_order=4, power_c=2.0).bond == Power(4, 2.0)


def test_a_scene_is_frozen():
    scene = Scene()
    with pytest.raises(ValueError, match="frozen"):
        scene.particles = 5


def test_replace_validates_anew():
    assert Scene(particles=7).replace(speed=0.1).particles == 7
    with pytest.raises(SceneError, match="both given"):
        Scene(velocity=0.1).replace(speed=0.1)


# ---- TOML ----------------------------------------------------------------------------------------

positive = st.floats(1e-6, 0.9)
paths = st.text("abcXYZ019_- ./'\"\\é", min_size=1, max_size=12).map(Path)


@st.composite
def scenes(draw):
    bond = draw(
        st.sampled_from(
            [
                {},
                {"potential": "lj"},
                {"potential": "log"},
                {"potential": "harmonic"},
                {"potential": "toda", "toda_b": 2.5},
                {"potential": "power", "power_order": 3, "power_c": -1.5},
            ]
        )
    )
    fields = dict(bond)
    if draw(st.booleans()):
        harmonic = bond.get("potential") == "harmonic"
        fields["velocity" if harmonic or draw(st.booleans()) else "speed"] = draw(positive)
    optional = {
        "particles": st.integers(1, 10**6),
        "dump": paths,
        "arrays": paths,
        "dump_frames": positive | st.just("contacts"),
        "error": st.booleans(),
        "save": paths,
    }
    numerics = {
        "wall": st.just("event"),
        "scheme": st.sampled_from(["verlet", "order4", "order6", "order8"]),
        "timestep": positive,
        "table": st.sampled_from(["linear", "spline"]),
        "table_points": st.integers(10, 10**6),
    }
    optional |= draw(st.sampled_from([numerics, {"tolerance": positive}]))
    for name, values in optional.items():
        if draw(st.booleans()):
            fields[name] = draw(values)
    if bond.get("potential") == "harmonic":  # never has a table
        fields = {k: v for k, v in fields.items() if k not in ("table", "table_points")}
    if not set(numerics) & set(fields):  # then an error bar chooses them
        fields.pop("error", None)
    return Scene(**fields)


@given(scenes())
def test_toml_round_trip(scene):
    again = Scene.from_toml(scene.to_toml())
    assert again == scene
    assert again.model_fields_set == scene.model_fields_set
    assert again.sha256 == scene.sha256
    assert again.to_toml() == scene.to_toml()


@pytest.mark.parametrize(
    "text",
    [
        f"particles = {'9' * 5000}",
        f"particles = 0x1{'0' * 5000}",
        f"masses = [1, {2**70}]",
        f"parameters = {{ a = {2**70} }}",
    ],
)
def test_integers_that_toml_does_not_have_are_one_line(text):
    with pytest.raises(SceneError, match=r"^here.* integer of .*Give .*at most 64") as caught:
        Scene.from_toml(text, "here")
    assert len(str(caught.value)) < 200


def test_the_first_of_many_mistakes_are_listed():
    text = "\n".join(f"key{i} = 1" for i in range(50_000))
    with pytest.raises(SceneError) as caught:
        Scene.from_toml(text, "here")
    assert len(caught.value.mistakes) == 20


@pytest.mark.parametrize(("key", "value"), [("temperature", 5e-324), ("contact_stiffness", 5e-324)])
def test_numbers_whose_powers_are_none_are_refused(key, value):
    contact = {"contact": "power"} if key == "contact_stiffness" else {}
    with pytest.raises(SceneError, match=rf"{key} is (4\.94066|5)e-324[.:]"):
        Scene(**{key: value}, **contact)


def test_toml_is_flat_with_underscores():
    text = Scene(potential="toda", toda_b=10.0, particles=20, speed=0.4).to_toml()
    assert tomllib.loads(text) == {
        "potential": "toda",
        "toda_b": 10.0,
        "particles": 20,
        "speed": 0.4,
    }


@pytest.mark.parametrize(
    "text",
    ["particles = ", "particles = 3\nparticles = 4", "= 3", "a" * 5 + "[", "x = " + "[" * 99],
)
def test_what_is_not_toml_is_one_line(text):
    with pytest.raises(SceneError, match=r"scene is not valid TOML") as caught:
        Scene.from_toml(text)
    assert "\n" not in str(caught.value)


def test_nan_and_infinity_in_toml():
    for value in ("nan", "inf", "-inf"):
        with pytest.raises(SceneError, match="velocity is"):
            Scene.from_toml(f"velocity = {value}")


def test_scene_files(tmp_path):
    with pytest.raises(SceneError, match="No such file"):
        Scene.from_file(tmp_path / "absent.toml")
    with pytest.raises(SceneError, match="it is a folder"):
        Scene.from_file(tmp_path)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match="UnicodeDecodeError"):
        Scene.from_file(tmp_path / "binary.toml")


def test_a_bond_file_lies_beside_its_scene(tmp_path, monkeypatch):
    rows = "\n".join(f"{k} {0.9 + 0.1 * k} 0 {0.1 - 0.1 * k}" for k in range(4))
    (tmp_path / "own.table").write_text(f"OWN\nN 4\n\n{rows}\n")
    (tmp_path / "scene.toml").write_text(
        'potential = "table"\nbond_file = "own.table"\nvelocity = 0.01\n'
    )
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    assert Scene.from_file("../scene.toml").bond.stiffness == pytest.approx(1.0)


def test_an_object_cannot_be_written_as_toml():
    with pytest.raises(SceneError, match="'lj' is a Python object"):
        Scene(potential=LennardJones()).to_toml()


# ---- hash ----------------------------------------------------------------------------------------


def test_hash_is_the_same_in_every_version_and_on_every_machine():
    # Stores find results by this hash, so a change here would invalidate all stores.
    assert Scene(potential="harmonic", particles=10, velocity=0.1, tolerance=1e-8).sha256 == (
        "005466a9e5f36fee4dca2b3b383af9c2ab9e055059e4ca09c66a29f52340ca4e"
    )


@pytest.mark.parametrize(
    ("fields", "crossing"),
    [({}, 20.0), ({"masses": (100,)}, 200.0), ({"target_particles": 50}, 50.0)],
)
def test_frames_are_counted_while_sound_crosses_the_longer_body(fields, crossing):
    scene = Scene(particles=20, dump_frames=10.0, **fields)
    assert scene.frame_interval == pytest.approx(crossing / 10.0, rel=1e-15)
    assert scene.replace(dump_frames="contacts").frame_interval is None


def test_hash_follows_meaning_not_spelling():
    base = Scene(potential="toda", speed=0.4)
    same = [
        Scene(potential="toda", toda_b=10.0, particles=100, engine="lammps"),
        Scene(potential="toda", tolerance=1e-6),
        Scene(potential="toda", velocity=base.impact_velocity),
        base.replace(dump="here", save="there", arrays="a.npz", dump_frames=5.0),
    ]
    assert {scene.sha256 for scene in same} == {base.sha256}
    other = [
        base.replace(particles=99),
        base.replace(toda_b=9.0),
        base.replace(speed=0.41),
        base.replace(engine="reference"),
        base.replace(tolerance=1e-7),
        base.replace(wall="reflect"),
        base.replace(scheme="order4"),
    ]
    assert len({scene.sha256 for scene in [base, *other]}) == len(other) + 1


@pytest.mark.slow
def test_each_key_of_physics_and_numerics_changes_the_hash(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("one.csv").write_text("strain,velocity\n0.01,-0.1\n0,-0.1\n")
    Path("two.csv").write_text("strain,velocity\n0.02,-0.1\n0,-0.1\n")
    for name, stiffness in (("one", 1.0), ("two", 2.0)):
        strains = np.linspace(-0.5, 0.5, 21)
        rows = [
            f"{k} {1 + s:.17g} {stiffness * s * s / 2:.17g} {-stiffness * s:.17g}\n"
            for k, s in enumerate(strains, 1)
        ]
        Path(f"{name}.table").write_text("T\nN 21\n\n" + "".join(rows))
    cold = {"potential": "lj", "particles": 2, "velocity": 0.1}
    table = {**cold, "potential": "table", "bond_file": "one.table"}
    power = {**cold, "potential": "power", "power_order": 4, "power_c": 1.0}
    formula = {**cold, "potential": "formula", "energy": "s^2/2+c*s^4", "parameters": {"c": 1.0}}
    hertz = {**cold, "potential": "hertz", "engine": "reference", "damping": 0.1}
    soft = {**cold, "contact": "power", "contact_stiffness": 1.0}
    steps = {**cold, "scheme": "verlet", "timestep": 0.01, "table_points": 100}
    # For each key: the fields of a scene, and a value of the key that is not the default.
    others = {
        "potential": (cold, "harmonic"),
        "toda_b": ({**cold, "potential": "toda"}, 9.0),
        "morse_a": ({**cold, "potential": "morse"}, 9.0),
        "power_order": (power, 6),
        "power_c": (power, 2.0),
        "hertz_exponent": (hertz, 2.0),
        "damping": (hertz, 0.2),
        "damping_law": (hertz, "dashpot"),
        "bond_file": (table, "two.table"),
        "energy": (formula, "s^2/2+c*s^6"),
        "parameters": (formula, {"c": 2.0}),
        "particles": (cold, 3),
        "masses": ({**cold, "masses": (1.0, 3.0)}, (1.0, 2.0)),
        "diameters": ({**hertz, "diameters": (1.0, 3.0)}, (1.0, 2.0)),
        "target_particles": ({**cold, "target_particles": 3}, 2),
        "target_masses": ({**cold, "target_particles": 2, "target_masses": (1.0, 3.0)}, (1.0, 2.0)),
        "contact": (hertz, "hard"),
        "contact_stiffness": (soft, 2.0),
        "contact_exponent": (soft, 2.0),
        "initial": ({**cold, "velocity": None, "initial": "one.csv"}, "two.csv"),
        "compression": ({**cold, "compression": 0.02}, 0.01),
        "temperature": ({**cold, "temperature": 1e-6}, 1e-5),
        "seed": ({**cold, "temperature": 1e-5}, 2),
        "speed": ({**cold, "velocity": None}, 0.3),
        "velocity": (cold, 0.2),
        "engine": (cold, "reference"),
        "tolerance": (cold, 1e-7),
        "wall": (steps, "reflect"),
        "scheme": (steps, "order4"),
        "timestep": (steps, 0.02),
        "table": (steps, "linear"),
        "table_points": (steps, 200),
        "error": (steps, False),
    }
    outputs = {"dump", "dump_frames", "save", "arrays"}
    assert set(others) == set(Scene.model_fields) - outputs
    for key, (fields, value) in others.items():
        given = {name: each for name, each in fields.items() if each is not None}
        assert Scene(**given).sha256 != Scene(**{**given, key: value}).sha256, key


_HASHES = """
import numpy as np
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.bonds.user_bond import UserBond

own = UserBond(lambda s: np.exp(-s) - 1.0 + s, lambda s: np.expm1(-s))
for fields in (
    *({"potential": name} for name in ("lj", "toda", "log")),
    *({"potential": "toda", "toda_b": 0.7 * k, "speed": 0.1 * k} for k in range(1, 6)),
    *({"potential": "power", "power_order": 4, "power_c": 0.3 * k} for k in range(1, 6)),
    {"potential": own, "velocity": 0.1},
):
    print(Scene(**fields).sha256)
"""


@pytest.mark.slow
def test_hashes_are_those_of_another_processor():
    # If hashes differed, a store would not recognise its collisions on another node of a cluster.
    def hashes(environment):
        command = [sys.executable, "-c", _HASHES]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        return done.stdout.split()

    here = os.environ | {"PYTHONPATH": str(Path(__file__).parents[2])}
    assert len(set(hashes(here))) == 14
    assert hashes(here | old_processor()) == hashes(here)


def test_hash_of_objects_follows_their_force():
    def user(stiffening):
        return UserBond(
            lambda s: 0.5 * s**2 + 0.25 * stiffening * s**4, lambda s: -s - stiffening * s**3
        )

    one = Scene(potential=user(1.0), velocity=0.1)
    assert one.sha256 == Scene(potential=user(1.0), velocity=0.1).sha256
    assert one.sha256 != Scene(potential=user(2.0), velocity=0.1).sha256
    assert (
        Scene(potential=Toda(5.0), velocity=0.1).sha256
        != Scene(potential=Toda(6.0), velocity=0.1).sha256
    )


def test_hash_of_a_bond_file_follows_its_content(tmp_path):
    def scene(name, slope):
        rows = "\n".join(f"{k} {0.9 + 0.1 * k} 0 {slope * (0.1 - 0.1 * k)}" for k in range(4))
        (tmp_path / name).write_text(f"OWN\nN 4\n\n{rows}\n")
        return Scene(potential="table", bond_file=tmp_path / name, velocity=0.01)

    assert scene("a.table", 1.0).sha256 == scene("b.table", 1.0).sha256
    assert scene("a.table", 1.0).sha256 != scene("c.table", 2.0).sha256


# ---- numerics ------------------------------------------------------------------------------------


def test_numerics_complete_a_scene():
    bare = Numerics.from_scene(Scene())
    assert (bare.wall, bare.scheme, bare.timestep, bare.table) == ("event", "order6", 0.1, "spline")
    stock = Numerics.from_scene(Scene(wall="reflect"))
    assert (stock.wall, stock.scheme, stock.timestep) == ("reflect", "verlet", 0.005)
    assert Numerics.from_scene(Scene(scheme="order8")).timestep == 0.2
    given_ = Numerics.from_scene(Scene(timestep=0.03, table="linear", table_points=500))
    assert (given_.timestep, given_.table, given_.table_points) == (0.03, "linear", 500)


def test_impossible_parameters_name_the_option():
    with pytest.raises(PotentialError, match="toda_b is 1e-200"):
        Scene(potential="toda", toda_b=1e-200)


@pytest.mark.parametrize(
    ("scene", "shown"),
    [
        (
            Scene(),
            "Scene(potential='lj', particles=100, speed=0.4, engine='lammps', tolerance=1e-06)",
        ),
        (
            Scene(potential="harmonic", scheme="verlet", dump="motion.dump"),
            "Scene(potential='harmonic', particles=100, scheme='verlet', dump='motion.dump', "
            "velocity=0.1, engine='lammps')",
        ),
    ],
)
def test_a_scene_shows_what_it_means(scene, shown):
    assert repr(scene) == str(scene) == shown


@pytest.mark.parametrize(
    "fields",
    [
        {},
        {"potential": "toda", "velocity": 0.3, "masses": (1.0, 2.0), "engine": "reference"},
        {"temperature": 1e-3, "seed": 4, "target_particles": 2},
        {"wall": "reflect", "timestep": 0.01, "error": False, "particles": 7},
        {"potential": "power", "power_order": 4, "power_c": 2.0, "tolerance": 1e-3},
    ],
)
def test_what_a_scene_shows_makes_it_again(fields):
    scene = Scene(**fields)
    assert eval(repr(scene)).sha256 == scene.sha256


def test_many_masses_are_shown_in_a_line():
    scene = Scene(masses=(1.0, 2.5) * 50)
    assert "masses='1, 2.5, 1, ... (100 in all)'" in repr(scene)


def test_all_mistakes_of_a_scene_are_said_at_once(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text("particles = 0\npartcles = 5\nspeed = -1.0\n")
    with pytest.raises(SceneError) as refused:
        Scene.from_file(file)
    head, *lines = str(refused.value).splitlines()
    assert head == f"{file}: 3 mistakes:"
    assert [line.strip().split(":")[0] for line in lines] == [
        "particles is 0",
        "speed is -1.0",
        "unknown key 'partcles'; did you mean 'particles'?",
    ]


def test_fields_that_do_not_go_together_are_all_named():
    with pytest.raises(SceneError) as refused:
        Scene(toda_b=5.0, speed=0.4, velocity=0.1, contact_exponent=2.0, seed=3, timestep=9.0)
    assert [mistake.split()[0] for mistake in refused.value.mistakes] == [
        "toda_b",
        "contact_exponent",
        "speed",
        "seed",
        "timestep",
    ]


def test_what_follows_from_a_mistake_is_no_mistake_of_its_own():
    # Without its parameters there is no bond, so that the compression cannot be checked.
    with pytest.raises(SceneError, match=r"^potential 'power' needs power_order and power_c$"):
        Scene(potential="power", compression=0.5)


@pytest.mark.parametrize(
    ("name", "message"),
    [("Lennard-Jones", "did you mean 'lj'"), ("todda", "did you mean 'toda'")],
)
def test_potentials_of_other_names_are_suggested(name, message):
    with pytest.raises(SceneError, match=message):
        Scene(potential=name)


def test_potentials_are_known_in_capitals():
    assert Scene(potential="LJ").sha256 == Scene(potential="lj").sha256


def test_a_byte_order_mark_is_no_mistake(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_bytes(b"\xef\xbb\xbfparticles = 4\n")
    assert Scene.from_file(path) == Scene(particles=4)
    assert Scene.from_toml(path.read_text(encoding="utf-8")) == Scene(particles=4)


@pytest.mark.parametrize("kind", ["device", "folder", "large"])
def test_scene_files_that_may_not_end_are_refused(tmp_path, kind):
    path = tmp_path / "scene.toml"
    if kind == "device":
        path = Path("/dev/zero")
    elif kind == "folder":
        path.mkdir()
    else:
        with path.open("wb") as file:
            file.truncate(200_000_000)
    with pytest.raises(SceneError, match=r"cannot read the scene file .*: it is .*in TOML"):
        Scene.from_file(path)


def test_a_scene_may_come_through_a_pipe(tmp_path):
    # A shell's <(...) gives such a pipe.
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_text, args=("particles = 4\n",))
    writer.start()
    try:
        assert Scene.from_file(pipe) == Scene(particles=4)
    finally:
        writer.join()


@pytest.mark.parametrize("name", ["all_particles", "slow_stiffness", "comes_moving"])
def test_attributes_that_moved_to_the_problem_are_deprecated(name):
    scene = Scene(particles=3)
    with pytest.warns(DeprecationWarning, match=rf"Use Scene\.problem\.{name}"):
        assert getattr(scene, name) == getattr(scene.problem, name)


def test_a_copy_with_changed_fields_keeps_nothing_of_the_original() -> None:
    scene = Scene(particles=3, velocity=0.1)
    original = scene.problem.particles, scene.sha256
    changed = scene.model_copy(update={"particles": 5})
    assert (changed.problem.particles, changed.sha256) == (
        5,
        Scene(particles=5, velocity=0.1).sha256,
    )
    assert (scene.model_copy().problem.particles, scene.sha256) == original
    with pytest.raises(SceneError, match="particles is -3"):
        scene.model_copy(update={"particles": -3})
