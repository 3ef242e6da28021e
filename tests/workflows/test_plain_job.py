"""Test that the shortest script gives the engine's result in LAMMPS."""

import pytest

from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script_plan import JobWishes
from chaincor.lammps_inputs.units.unit_system import UnitSystem
from chaincor.workflows.collision import collide
from chaincor.workflows.job import job_files, write_job
from tests.lmp import number, run_lmp

SCENES = {
    "default": Scene(particles=10),
    "harmonic": Scene(potential="harmonic", particles=20),
    "masses": Scene(particles=10, masses=(1.0, 2.0)),
    "few steps": Scene(particles=2, timestep=0.1),
    "warm": Scene(particles=6, velocity=0.1, potential="toda", temperature=1e-3),
}


def commands(text):
    return [line for line in text.splitlines() if line.strip() and not line.startswith("#")]


def run_alone(folder, *variables):
    return number(run_lmp(folder, *variables).stdout, "restitution")


@pytest.mark.parametrize("name", SCENES)
def test_lmp_alone_gives_the_number_of_the_stock_wall(tmp_path, name):
    scene = SCENES[name]
    write_job(scene, tmp_path, plain=True)
    assert len(commands((tmp_path / "in.chain").read_text())) <= 25
    given = Scene.from_file(tmp_path / "scene.toml")
    assert (given.wall, given.scheme) == ("reflect", "verlet")
    engine = collide(given)
    # Steps and table are the same. Differences come from the text form of numbers, and from the
    # order in which a thousand kicks are added.
    assert run_alone(tmp_path) == pytest.approx(engine.restitution, abs=1e-9)


def test_warm_bonds_stay_in_their_table(tmp_path):
    # Errors of the stock wall stretch the bonds beyond the range of the reference run.
    scene = Scene(particles=20, speed=0.3, temperature=1e-3, seed=1)
    write_job(scene, tmp_path, plain=True)
    assert 0.0 < run_alone(tmp_path) < 1.0


def test_another_step_from_the_command_line(tmp_path):
    write_job(SCENES["harmonic"], tmp_path, plain=True)
    exact = collide(SCENES["harmonic"].replace(engine="reference")).restitution
    # The error is of first order, with a factor of either sign. A hundredth of the step therefore
    # has at most a hundredth of the largest error.
    coarse = max(abs(run_alone(tmp_path, "-var", "timestep", f"{h}") - exact) for h in (0.05, 0.06))
    fine = abs(run_alone(tmp_path, "-var", "timestep", "0.0005") - exact)
    assert fine < 0.1 * coarse


def test_units_of_a_scene(tmp_path):
    units = UnitSystem(style="metal", length=2.5, mass=40.0, stiffness=1.5)
    write_job(SCENES["harmonic"], tmp_path / "units", plain=True, units=units)
    write_job(SCENES["harmonic"], tmp_path / "plain", plain=True)
    numbers = [run_alone(tmp_path / name) for name in ("units", "plain")]
    # Numbers in other units round differently, which a harmonic chain does not amplify.
    assert numbers[0] == pytest.approx(numbers[1], abs=1e-9)


@pytest.mark.parametrize("name", SCENES)
def test_every_command_is_explained(name):
    plain, explained = (
        job_files(SCENES[name], JobWishes(plain=True, explain=explain))["in.chain"]
        for explain in (False, True)
    )
    assert commands(explained) == commands(plain)
    # The text fits on two pages and takes two minutes to read aloud at 150 words per minute.
    assert len(explained.splitlines()) <= 80
    said = [line for line in explained.splitlines() if line.startswith("#")]
    assert len(" ".join(said).replace("#", "").split()) <= 300


@pytest.mark.parametrize(
    ("fields", "wishes", "line"),
    [
        ({"tolerance": 1e-5}, {}, "cannot use tolerance 1e-05, because it computes no error bar"),
        ({"wall": "event", "timestep": 0.1}, {}, "cannot use wall event"),
        ({"scheme": "order8", "timestep": 0.1}, {}, "cannot use scheme order8"),
        ({"target_particles": 3}, {}, "but the target is free"),
        ({"contact": "power"}, {}, "but the contact is soft"),
        ({}, {"dump": True}, "frames exclude each other. Drop one"),
    ],
)
def test_what_a_plain_script_cannot_do_is_refused(fields, wishes, line):
    with pytest.raises(InputError, match=line) as caught:
        job_files(Scene(particles=5, **fields), JobWishes(plain=True, **wishes))
    assert "\n" not in str(caught.value)
