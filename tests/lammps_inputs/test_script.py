"""Test rendered inputs: the golden text of each kind, and exact numbers."""

import struct
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from chaincor.lammps_inputs.bond_table import tabulate
from chaincor.lammps_inputs.contact_script import number
from chaincor.lammps_inputs.errors import SceneError
from chaincor.lammps_inputs.numerics import Numerics
from chaincor.lammps_inputs.scene import Scene
from chaincor.lammps_inputs.script import render_job, render_setup
from chaincor.lammps_inputs.script_plan import (
    EndTimes,
    ExpectedEnd,
    JobWishes,
    ScriptedBar,
    ScriptedSteps,
    ScriptPlan,
)

GOLDEN = Path(__file__).parents[1] / "golden"
# These numbers are fixed here, because only the text is under test.
TIMES = EndTimes(quiet=22.0, cap=300.0, look=2.0)
END = ExpectedEnd(last_contact_time=18.25, contacts=9, ending="proved")
BONDS = {
    "harmonic": ({"potential": "harmonic", "velocity": 0.1}, None),
    "lj-spline": ({"potential": "lj", "velocity": 0.05}, "spline"),
    "toda-linear": ({"potential": "toda", "velocity": 0.1}, "linear"),
    "power-spline": (
        {"potential": "power", "power_order": 3, "power_c": -1.0, "velocity": 0.1},
        "spline",
    ),
}


def rendered(scene, table=None, steps=None, plan=None, **wishes):
    plan = ScriptPlan(Numerics.from_scene(scene), table, **{"end": END} | (plan or {}))
    return render_job(
        scene.problem, plan, TIMES, steps, JobWishes(frame_interval=scene.frame_interval, **wishes)
    )


def render(wall, kind, frames=20, **options):
    fields, style = BONDS[kind]
    fields = fields | {"scheme": "verlet", "timestep": 0.0125, "dump_frames": frames}
    scene = Scene(particles=10, wall=wall, **fields)
    table = None if style is None else tabulate(scene.bond, (0.9, 1.1), style, 1001)
    return rendered(scene, table, **options)


def compare(name, text, update):
    path = GOLDEN / name
    if update:
        path.write_text(text)
    assert text == path.read_text(), f"if the change is wanted: pytest --update-golden ({name})"


@pytest.mark.parametrize("wall", ["event", "reflect"])
@pytest.mark.parametrize("kind", BONDS)
def test_golden_job(wall, kind, update_golden):
    compare(f"{wall}-{kind}.in", render(wall, kind), update_golden)


def test_golden_job_with_a_dump(update_golden):
    compare("event-harmonic-dump.in", render("event", "harmonic", dump=True), update_golden)


def test_golden_job_with_a_dump_at_contacts(update_golden):
    text = render("event", "harmonic", contacts=True, dump=True, frames="contacts")
    compare("event-harmonic-dump-contacts.in", text, update_golden)


LINES = {
    "masses": {"masses": (1.0, 3.0)},
    "target": {"masses": (2.0,), "target_particles": 4, "target_masses": (1.0, 0.5)},
    "soft": {"target_particles": 1, "contact": "power", "contact_stiffness": 0.5},
    "soft-wall": {"contact": "power", "contact_exponent": 2.0},
}


@pytest.mark.parametrize("kind", LINES)
def test_golden_job_of_two_bodies(kind, update_golden):
    scene = Scene(
        potential="harmonic",
        particles=10,
        velocity=0.1,
        scheme="verlet",
        timestep=0.0125,
        **LINES[kind],
    )
    text = rendered(scene)
    compare(f"event-harmonic-{kind}.in", text, update_golden)
    guarded = rendered(scene, restartable=True, guards=True, contacts=True)
    compare(f"event-harmonic-{kind}-guarded.in", guarded, update_golden)


STEPS = ScriptedSteps(
    weights=(0.5, 0.25, -0.5, 0.25, 0.5), order=4, citation="nowhere", coarse=0.0125, patience=3.5
)
BAR = ScriptedBar(
    multiples=(1.0, 2.0),
    share=0.5,
    share_alone=1.0,
    table=1e-12,
    rounding=2e-12,
    ending=0.0,
    reference_solution=0.8,
    reference_error=1e-11,
)


def test_golden_job_of_composed_steps(update_golden):
    text = render("event", "lj-spline", steps=STEPS, plan={"bar": BAR, "tolerance": 1e-8})
    compare("event-lj-composed.in", text, update_golden)


def test_golden_job_of_composed_steps_with_every_block(update_golden):
    wishes = {"restartable": True, "guards": True, "contacts": True, "dump": True}
    plan = {"bar": BAR, "tolerance": 1e-8, "fastest": 0.06}
    text = render("event", "lj-spline", steps=STEPS, plan=plan, **wishes)
    compare("event-lj-every-block.in", text, update_golden)


def test_golden_job_of_graded_steps(update_golden):
    scene = Scene(particles=10, velocity=0.05, contact="power", timestep=0.0125)
    steps = replace(STEPS, graded=(1.0, 1.6))
    text = rendered(scene, steps=steps)
    compare("event-lj-graded.in", text, update_golden)


def test_a_job_without_scouting_says_so():
    text = render("event", "lj-spline", plan={"end": None})
    assert "# No reference run could tell when the last contact comes" in text
    assert "end proved" not in text


@pytest.mark.parametrize("kind", ["harmonic", "lj-spline"])
def test_golden_setup_for_python(kind, update_golden):
    fields, style = BONDS[kind]
    scene = Scene(particles=10, **fields)
    table = None if style is None else tabulate(scene.bond, (0.9, 1.1), style, 1001)
    text = render_setup(Numerics.from_scene(scene), table, "/tmp/folder")
    compare(f"setup-{kind}.in", text, update_golden)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_keep_their_bits(value):
    assert struct.pack("d", float(number(value))) == struct.pack("d", value)


def test_a_folder_that_lammps_would_interpret_is_refused():
    numerics = Numerics.from_scene(Scene(potential="harmonic"))
    for folder in ("/tmp/with space", "/tmp/$x", '/tmp/"', "/tmp/a#b"):
        with pytest.raises(SceneError, match="Set TMPDIR"):
            render_setup(numerics, None, folder)
