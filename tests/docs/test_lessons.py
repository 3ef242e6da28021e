"""Test that lessons need only chaincor, and that the course matches its description."""

import ast
import re
import runpy
import sys
import tomllib

import numpy as np
import pytest

from chaincor.lammps_inputs.bonds.potentials import Harmonic, Toda
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.lessons import prepared
from chaincor.workflows.lessons.exercise import LESSONS, exercises_of
from chaincor.workflows.lessons.notebooks import lesson_pages
from tests.docs.documents import ROOT

PAGES = lesson_pages()
COURSE = ROOT / "docs" / "course"
TUTORIALS = [page for name, page in PAGES.items() if name != "class"]


def python_blocks(text):
    return re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("name", PAGES)
def test_a_lesson_imports_only_what_comes_with_chaincor(name):
    blocks = python_blocks(PAGES[name].read_text())
    own = {match[1] for block in blocks if (match := re.match(r"# (\w+)\.py\n", block))}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    required = {re.split(r"[<>=]", line)[0].lower() for line in project["dependencies"]}
    found = set()
    for block in blocks:
        for node in ast.walk(ast.parse(block)):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                found.add(node.module.split(".")[0])
    assert {n.lower() for n in found - own - {"chaincor"} - sys.stdlib_module_names} <= required


@pytest.mark.parametrize("lesson", LESSONS)
def test_each_exercise_that_is_checked_is_asked_and_solved_where_its_number_is(lesson):
    text = TUTORIALS[lesson - 1].read_text()
    asked = re.findall(r"^\*\*(\d)\.\*\*", text, re.MULTILINE)
    assert asked == [str(number) for number in range(1, len(asked) + 1)]
    for name in exercises_of(lesson):
        number = name.split(".")[1]
        part = text.split(f"**{number}.**")[1].split(f"**{int(number) + 1}.**")[0]
        assert f'check("{name}", ...)' in part.split("<details>")[0]
        assert re.search(rf'assert check\(\s*"{name}"', part.split("<details>")[1])


def test_times_add_up_to_what_the_first_page_says():
    minutes = [
        int(re.search(r"^\*Time: (\d+) minutes", page.read_text(), re.MULTILINE)[1])
        for page in TUTORIALS
    ]
    assert 180 <= sum(minutes) <= 240
    assert "eight lessons take three to four hours" in (ROOT / "docs" / "index.md").read_text()


def test_the_plan_of_the_class_fills_its_minutes_and_names_its_checks():
    plan = (COURSE / "ninety_minutes.md").read_text()
    rows = re.findall(r"^\| (\d+)–(\d+) \|.*\|([^|]*)\|$", plan, re.MULTILINE)
    assert [int(begin) for begin, _, _ in rows] == [0, *(int(end) for _, end, _ in rows[:-1])]
    assert rows[-1][1] == "90"
    planned = set(re.findall(r"\d\.\d", " ".join(checks for _, _, checks in rows)))
    assert planned == set(re.findall(r'check\("(\d\.\d)"', PAGES["class"].read_text()))
    slides = len(re.findall(r"^#", (COURSE / "slides" / "index.md").read_text(), re.MULTILINE))
    assert f"| {slides} |" in plan  # the last row shows the last slide


def test_there_are_ten_projects():
    assert len(re.findall(r"^\d+\. ★", (COURSE / "projects.md").read_text(), re.MULTILINE)) == 10


def test_lesson_5_says_the_shares_that_its_figure_shows():
    speeds, *etas = np.loadtxt(prepared("cor_curves.csv"), delimiter=",", unpack=True)
    text = PAGES["5_nonlinear"].read_text()
    slow = re.search(r"At ([\d.]+) v\* the chains keep (\d+) or (\d+) %", text)
    assert float(slow[1]) == speeds[0]
    assert {int(slow[2]), int(slow[3])} == {round(100.0 * eta[0]) for eta in etas}
    least = re.search(r"They keep the least near 0\.8 v\*: (\d+) to (\d+) %", text)
    shares = sorted(round(100.0 * eta.min()) for eta in etas)
    assert [int(least[1]), int(least[2])] == [shares[0], shares[-1]]
    # The picture and its alternative text begin with these values.
    first = re.search(r"all fall from (0\.\d\d) or (0\.\d\d) to", text)
    assert {float(first[1]), float(first[2])} == {round(eta[0], 2) for eta in etas}


def test_lesson_1_says_from_which_step_on_its_chain_explodes_and_what_e_is():
    text = PAGES["1_first_collision"].read_text()
    # Verlet steps are stable up to 2/omega, and the highest mode of ten has omega = 2 sin(9 pi/20).
    said = float(re.search(r"with a step above ([\d.]+) the energy of this chain grows", text)[1])
    assert said == round(1.0 / np.sin(9.0 * np.pi / 20.0), 4)
    # Many texts give the ratio of speeds, e, and this course its square, eta.
    speeds = re.search(r"Many texts call the ratio of speeds, e = √η = (0\.\d+), by the same", text)
    share = re.search(r"leaves with (\d+\.\d) % of its translational energy", text)
    assert float(speeds[1]) ** 2 == pytest.approx(0.01 * float(share[1]), abs=1e-3)


def test_the_class_says_whose_numbers_its_checks_have_and_which_chain_its_walls_meet():
    text = PAGES["class"].read_text()
    assert "check 3.2 is exercise 2 of lesson 3" in text
    assert "particles=20" in (COURSE / "make_data.py").read_text()
    assert "another one, of 20 particles with Lennard-Jones bonds" in text


def mirrored(bond, n, v0, step, time):
    """Yield u and v after each Verlet step with the wall that lesson 3 describes, from t = 0."""
    u, v = np.zeros(n), np.full(n, -v0)

    def force():
        return -np.diff(bond.force(np.diff(u)), prepend=0.0, append=0.0)

    f = force()
    for _ in range(round(time / step)):
        v = v + 0.5 * step * f
        u = u + step * v
        if u[0] < 0.0:
            u[0], v[0] = -u[0], -v[0]
        f = force()
        v = v + 0.5 * step * f
        yield u, v


def test_lesson_3_describes_the_wall_of_lammps_and_its_jumps_of_energy():
    text = PAGES["3_timestep_and_wall"].read_text()
    exact = float(re.search(r"eta = (0\.\d+)", PAGES["class"].read_text())[1])
    rows = re.findall(r"^\| (0\.0\d+) \| (\S+) \| (\S+) \|$", text, re.MULTILINE)
    assert len(rows) == 3
    for step, jump, error in np.array(rows, dtype=float):
        states = list(mirrored(Harmonic(), 10, 0.1, step, 19.0))
        energies = [0.5 * np.sum(v**2) + 0.5 * np.sum(np.diff(u) ** 2) for u, v in states]
        eta = (states[-1][1].mean() / 0.1) ** 2
        # The page shows two digits.
        assert max(abs(np.array(energies) / 0.05 - 1.0)) == pytest.approx(jump, abs=6e-5)
        assert abs(eta - exact) == pytest.approx(error, abs=6e-5)
        if step == 0.01:
            # The class page shows this number as LAMMPS prints it. Rounding grows to some 1e-13.
            printed = re.search(r"^restitution = (0\.90\d+)", PAGES["class"].read_text(), re.M)
            assert eta == pytest.approx(float(printed[1]), abs=1e-12)


def test_the_far_end_of_the_toda_chain_turns_before_sound_arrives():
    text = PAGES["class"].read_text()
    sound = re.search(r"in a time of (\d+)\.", text)[1]
    turns = re.search(r"The far end reverses at a time of about (\d+)", text)[1]
    bond = Toda()
    ends = [v[-1] for _, v in mirrored(bond, 30, 1.1 * bond.natural_speed, 0.02, 18.0)]
    assert int(sound) == 30 - 1
    assert 0.02 * np.argmax(np.array(ends) > 0.0) == pytest.approx(int(turns), abs=0.5)


def test_lesson_3_counts_contacts_of_a_hundred_particles_as_run_does():
    text = PAGES["3_timestep_and_wall"].read_text()
    assert "A chain of a hundred particles has more than eighty contacts" in text
    contacts = [
        collide(Scene(engine="reference", **bond), tolerance=1e-4).contacts
        for bond in ({}, {"potential": "harmonic"})
    ]
    assert contacts == [84, 87]
    # The first page shows the 84 contacts that `chaincor run` prints.
    assert "contacts               84, the last" in (ROOT / "README.md").read_text()


@pytest.mark.slow
def test_data_made_beforehand_are_what_a_computer_gives():
    speeds, lj, toda, log = np.loadtxt(prepared("cor_curves.csv"), delimiter=",", unpack=True)
    for k in (0, 9, 17):
        for name, etas in (("lj", lj), ("toda", toda), ("log", log)):
            scene = Scene(potential=name, speed=speeds[k], engine="reference")
            # Each result has an error of up to 1e-6.
            assert abs(collide(scene, tolerance=1e-6).restitution - etas[k]) < 2e-6
    sizes, lost, contacts = np.loadtxt(prepared("lengths.csv"), delimiter=",", unpack=True)
    springs = Scene(potential="harmonic", particles=int(sizes[3]), engine="reference")
    result = collide(springs, tolerance=1e-6)
    assert abs(1.0 - result.restitution - lost[3]) < 2e-6
    assert result.contacts == contacts[3]


@pytest.mark.slow
def test_data_of_the_two_walls_are_made_by_the_script():
    made = runpy.run_path(str(COURSE / "make_data.py"))["timestep_and_wall"]()
    columns = np.loadtxt(prepared("timestep_and_wall.csv"), delimiter=",", unpack=True)
    # Rounding may shift a contact within its step, which changes only the last digits.
    for given, name in zip(columns, ("timestep", "reflect", "event"), strict=True):
        np.testing.assert_allclose(made[name], given, rtol=1e-3)
