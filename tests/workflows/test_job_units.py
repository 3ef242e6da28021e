"""Test that jobs and dumps in LAMMPS's units give the results of the reduced scene."""

import json

import numpy as np
import pytest

from chaincor.analysis.dumps.dump import Dump
from chaincor.lammps_inputs.errors import InputError, SceneError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.units.unit_system import UnitSystem
from chaincor.workflows.job import write_job
from tests.lmp import number, run_lmp, unexpected_warnings

# The units are like argon: its nearest distance in Angstrom, its mass in g/mol, and its 72
# epsilon/sigma^2 in the energy unit of each style.
ARGON = UnitSystem(3.822, 39.948, 0.0511, "metal")
UNITS = [
    ARGON,
    UnitSystem(3.822, 39.948, 1.178, "real"),
    UnitSystem(3.822e-10, 6.634e-26, 0.819, "si"),
    UnitSystem(2.0, 3.0, 5.0, "lj"),
]
SCENES = [
    {"potential": "lj", "speed": 0.4, "tolerance": 1e-9},
    {"potential": "lj", "speed": 0.4, "wall": "reflect", "error": False},
    {"potential": "harmonic", "velocity": 0.05, "masses": (1, 2), "scheme": "order6"},
    {"potential": "toda", "velocity": 0.05, "target_particles": 3, "scheme": "verlet"},
    {
        "potential": "lj",
        "speed": 0.3,
        "target_particles": 2,
        "contact": "power",
        "scheme": "order4",
    },
]


@pytest.mark.slow_cases
@pytest.mark.parametrize("fields", SCENES, ids=lambda f: f["potential"] + str(len(f)))
@pytest.mark.parametrize("units", UNITS, ids=lambda u: u.style)
def test_a_job_in_any_units_gives_the_numbers_of_the_reduced_one(units, fields, tmp_path):
    scene = Scene(particles=6, **fields)
    write_job(scene, tmp_path / "reduced")
    write_job(scene, tmp_path / "job", units=units, explain=True)
    reduced, done = run_lmp(tmp_path / "reduced").stdout, run_lmp(tmp_path / "job")
    assert done.returncode == 0, done.stdout[-2000:]
    assert unexpected_warnings(done.stdout) == []
    # The steps are the same. Results differ by rounding, 1e-16 times coordinates up to 6.
    eta = number(reduced, "restitution")
    assert number(done.stdout, "restitution") == pytest.approx(eta, abs=1e-11)
    assert number(done.stdout, "contacts") == number(reduced, "contacts")
    last = number(reduced, "last_contact_time") * units.time
    assert number(done.stdout, "last_contact_time") == pytest.approx(last, rel=1e-10)
    assert UnitSystem.from_file(tmp_path / "job" / "units.toml") == units


@pytest.fixture(scope="module")
def argon(tmp_path_factory):
    """Return the folder with a reduced job and the job in metal units, each with its dump."""
    folder = tmp_path_factory.mktemp("argon")
    scene = Scene(particles=8, speed=0.4, tolerance=1e-10, dump_frames="contacts")
    for name, units in (("reduced", UnitSystem()), ("metal", ARGON)):
        write_job(scene, folder / name, dump=True, units=units)
        assert run_lmp(folder / name).returncode == 0
    return folder


def analyzed(chaincor, *arguments):
    status, out, err = chaincor("analyze", *map(str, arguments), "--json")
    assert status == 0, err
    return json.loads(out)


def assert_alike(found, reduced):
    assert abs(found["restitution"] - reduced["restitution"]) < 1e-9
    assert found["contacts"] == reduced["contacts"]
    scale = max(reduced["mode_energies"])
    np.testing.assert_allclose(
        found["mode_energies"], reduced["mode_energies"], rtol=0, atol=1e-9 * scale
    )
    assert found["velocity"] == pytest.approx(reduced["velocity"], rel=1e-12)


def test_the_dump_of_a_job_in_metal_units_is_analysed(argon, chaincor):
    reduced = analyzed(chaincor, argon / "reduced")
    found = analyzed(chaincor, argon / "metal")
    assert_alike(found, reduced)
    assert "units" not in reduced
    assert found["units"]["style"] == "metal"
    assert found["units"]["speed"] == pytest.approx(ARGON.length / ARGON.time)
    _, out, _ = chaincor("analyze", str(argon / "metal"))
    assert "in units metal: v0 = 0.690" in out


def test_the_dump_of_two_bodies_in_metal_units_is_analysed(tmp_path, chaincor):
    scene = Scene(potential="toda", velocity=0.05, particles=6, target_particles=3, dump_frames=50)
    found = {}
    for name, units in (("reduced", UnitSystem()), ("metal", ARGON)):
        write_job(scene, tmp_path / name, dump=True, units=units)
        assert run_lmp(tmp_path / name).returncode == 0
        found[name] = analyzed(chaincor, tmp_path / name)
        # A single run shows only the error from its dump's format. The comparison uses the
        # tolerance, 1e-6.
        status, out, err = chaincor("validate", "--against", str(tmp_path / name))
        assert status == 0, out + err
    metal, reduced = found["metal"], found["reduced"]
    assert metal["units"]["style"] == "metal"
    for name in ("restitution", "velocity", "velocity_after", "target_velocity_after"):
        assert metal[name] == pytest.approx(reduced[name], rel=1e-9)
    _, out, _ = chaincor("analyze", str(tmp_path / "metal"))
    assert f"in units metal: v0 = {0.05 * ARGON.length / ARGON.time:.6g}" in out


def test_the_motion_in_metal_units_is_written_in_the_chains_own(argon, tmp_path, chaincor):
    for name in ("reduced", "metal"):
        analyzed(chaincor, argon / name, "--xyz", tmp_path / f"{name}.xyz")
    motions = [
        [line.split() for line in (tmp_path / f"{name}.xyz").read_text().splitlines()]
        for name in ("reduced", "metal")
    ]
    assert [len(line) for line in motions[0]] == [len(line) for line in motions[1]]
    for ours, theirs in zip(*motions, strict=True):
        if ours[0] == "Ar":
            numbers = [[float(word) for word in line[1:]] for line in (ours, theirs)]
            # Conversion of units rounds coordinates up to 8, and the steps propagate this rounding.
            assert numbers[1] == pytest.approx(numbers[0], abs=1e-9)


def write_others(source, path, digits):
    """Write the dump in another user's form: towards +x, wall at 55, reversed ids."""
    with path.open("w") as file:
        for frame in Dump(source):
            x, v = frame.column("x"), frame.column("vx")
            file.write(f"ITEM: TIMESTEP\n{frame.step}\nITEM: NUMBER OF ATOMS\n{x.size}\n")
            file.write("ITEM: BOX BOUNDS ff ff ff\n-1e4 1e4\n-1 1\n-1 1\n")
            file.write("ITEM: ATOMS id x vx v_time\n")
            time = frame.column("v_time")[0]
            for k in range(x.size):
                numbers = (55.0 - x[k], -v[k], time)
                file.write(f"{x.size - k} {' '.join(f'{n:.{digits}g}' for n in numbers)}\n")


OTHERS = ["--wall", "55", "--direction", "+x", "--length", "auto", "--mass", "39.948"]
OTHERS += ["--stiffness", "0.0511", "--units", "metal", "--potential", "lj"]


def test_the_dump_of_other_people_is_analysed(argon, chaincor, tmp_path):
    write_others(argon / "metal" / "dump.lammpstrj", tmp_path / "theirs.lammpstrj", 17)
    found = analyzed(chaincor, tmp_path, *OTHERS)
    assert_alike(found, analyzed(chaincor, argon / "reduced"))
    assert found["units"]["length"] == pytest.approx(ARGON.length, rel=1e-13)


def test_few_digits_of_a_wall_that_is_elsewhere_are_in_the_error(argon, chaincor, tmp_path):
    write_others(argon / "metal" / "dump.lammpstrj", tmp_path / "theirs.lammpstrj", 6)
    found = analyzed(chaincor, tmp_path, *OTHERS)
    exact = analyzed(chaincor, argon / "reduced")["restitution"]
    assert 0.0 < abs(found["restitution"] - exact) <= found["data_error"]


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (["--units", "metal"], "--units metal is given without --length"),
        (["--length", "long"], "--length is 'long'. Give a number or auto"),
        (["--length", "-1"], "units.length is '-1.0'. Give a positive number"),
        (["--wall", "nan"], "--wall is nan"),
        (["--units", "lj"], "sets units metal, but units lj are given"),
    ],
)
def test_units_without_sense_are_refused(argon, options, line, chaincor):
    status, out, err = chaincor("analyze", str(argon / "metal"), *options)
    assert (status, out, err.count("\n")) == (2, "", 1)
    assert line in err


@pytest.mark.parametrize(
    ("table", "line"),
    [
        (
            {"length": 1.0},
            "units has no mass and no stiffness and no style. Give",
        ),
        (
            {"size": 1, "length": 1, "mass": 1, "stiffness": 1, "style": "si"},
            "has 'size', which",
        ),
        ({"length": 0, "mass": 1, "stiffness": 1, "style": "si"}, "units.length is '0'"),
        ({"length": 1, "mass": True, "stiffness": 1, "style": "si"}, "units.mass is 'True'"),
        ({"length": 1, "mass": 1, "stiffness": 1, "style": "cgs"}, "units.style is 'cgs'"),
    ],
)
def test_a_table_of_units_is_checked(table, line):
    with pytest.raises(SceneError) as refused:
        UnitSystem.from_fields(table)
    assert line in str(refused.value)


def test_a_file_of_units_without_their_table_is_refused(tmp_path):
    """Require the table [units], without which the keys would be ignored."""
    path = tmp_path / "units.toml"
    path.write_text('length = 3.822\nmass = 39.948\nstiffness = 0.0511\nstyle = "metal"\n')
    with pytest.raises(SceneError, match=r"has no table \[units\]\. Add \[units\] with length"):
        UnitSystem.from_file(path)


def test_units_come_from_the_scene_file(chaincor, tmp_path):
    scene = tmp_path / "argon.toml"
    scene.write_text("particles = 4\nscheme = 'order4'\n" + ARGON.to_toml())
    assert chaincor("inputs", str(scene), "-o", str(tmp_path / "job"))[0] == 0
    assert "units           metal" in (tmp_path / "job" / "in.chain").read_text()
    status, _, err = chaincor("run", str(scene))  # the run command ignores units
    assert (status, err.count("\n")) == (2, 1)


@pytest.mark.parametrize(
    ("fields", "line"),
    [
        (
            {"length": 1e200},
            r"units\.length is 1e\+200 in units of style lj. Give units between 1e-100",
        ),
        ({"length": 1e90}, r"the unit of energy of \[units\] is 1e\+180"),
        ({"mass": 1e-90, "stiffness": 1e-90, "length": 1e90}, None),
        ({"mass": 1e-300}, r"units\.mass is 1e-300"),
        ({"length": 5e-324}, r"units\.length is 4\.94066e-324"),
        ({"length": 10**400}, r"units\.length is '1000*'. Give a positive number"),
    ],
)
def test_units_whose_squares_are_no_numbers_are_refused(fields, line):
    given = {"length": 1.0, "mass": 1.0, "stiffness": 1.0, "style": "lj"} | fields
    if line is None:
        assert UnitSystem.from_fields(given).energy == pytest.approx(1e90)
        return
    with pytest.raises(SceneError, match=line):
        UnitSystem.from_fields(given)


@pytest.mark.parametrize("length", [1e-49, 1e49])
def test_a_job_in_far_units_gives_the_numbers_of_the_reduced_one(length, tmp_path):
    scene = Scene(particles=4, speed=0.4, tolerance=1e-6)
    write_job(scene, tmp_path / "reduced")
    write_job(scene, tmp_path / "job", units=UnitSystem(length, 1.0, 1.0, "lj"))
    etas = [number(run_lmp(tmp_path / name).stdout, "restitution") for name in ("reduced", "job")]
    assert etas[1] == pytest.approx(etas[0], abs=1e-11)


def test_a_velocity_in_the_units_of_the_job_is_named(tmp_path):
    scene = Scene(potential="lj", particles=3, velocity=690.0)
    with pytest.raises(InputError, match=r"in units metal, give velocity = 51\.[0-9]+$"):
        write_job(scene, tmp_path, units=ARGON)
