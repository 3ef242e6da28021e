"""Test results as text, as an HTML table, and as pictures on given axes."""

import dataclasses
import io
import math
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image

from chaincor.analysis.figures.style import new_figure
from chaincor.analysis.modes import kinetic_mode_energies
from chaincor.analysis.observables import TERMS, rows_of
from chaincor.analysis.showing.numbers import root_of_known
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.errors import RunError
from chaincor.workflows.showing.table import ResultTable
from chaincor.workflows.showing.terms import ALL_TERMS
from chaincor.workflows.showing.text import closing, describe_result, heading

SCENES = {
    "lammps": Scene(particles=10),
    "reference": Scene(particles=10, engine="reference"),
    "target": Scene(particles=6, target_particles=3, velocity=0.05, engine="reference"),
    "warm": Scene(
        particles=6, velocity=0.1, potential="toda", temperature=1e-3, engine="reference"
    ),
    "broken": Scene(particles=20, speed=1.5, tolerance=1e-4, engine="reference"),
}
PICTURES = ("world_lines", "spectrum", "energy", "contacts")


def test_the_root_of_eta_has_no_digits_that_its_error_drowns():
    # The error of e = sqrt(eta) is that of eta divided by 2 e or, for an eta near zero, the square
    # root of that of eta.
    result = collide(SCENES["reference"])
    e = result.kinematic_restitution
    for error, digits in ((None, 6), (1e-9, 6), (2e-3, 4), (0.1, 2)):
        shown = dataclasses.replace(result, restitution_error=error)
        assert rows_of(shown)[1][1] == f"e   = {e:.{digits}f}"
    assert root_of_known(1e-4, 1e-4) == "0.000"


@pytest.fixture(scope="module", params=SCENES)
def result(request):
    return collide(SCENES[request.param])


@pytest.fixture(scope="module")
def plain():
    return collide(SCENES["reference"])


class Cells(HTMLParser):
    """Parser that collects the texts of table cells and the tags that are not closed."""

    def __init__(self, text):
        super().__init__()
        self.open, self.texts, self.titles = [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        assert tag not in ("img", "link", "script")
        if tag != "br":
            self.open.append(tag)
        self.titles += [value for name, value in attributes if name == "title"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        self.texts.append(text)


def test_three_lines(result):
    lines = repr(result).splitlines()
    assert len(lines) == 3
    assert lines[0] == ", ".join(heading(result))
    assert f"eta = {result.restitution:.4f}"[:-1] in lines[1]
    assert f"{result.contacts} contacts, the last at t = " in lines[1]
    assert lines[2].startswith(f"run by {result.engine}: ")
    assert lines[2].endswith(f"end {result.ending}")


def test_a_tolerance_that_is_not_met_is_said(plain):
    missed = dataclasses.replace(plain, tolerance_met=False, reason="rounding is larger")
    for shown in (repr(missed), missed._repr_html_()):
        assert "NOT MET: rounding is larger" in shown


def test_the_table_holds_what_the_command_prints(result):
    cells = Cells(result._repr_html_())
    assert cells.open == []
    printed = [
        *heading(result),
        *(text for row in rows_of(result) for text in row),
        *closing(result),
    ]
    assert cells.texts == printed
    assert [TERMS[name] for name, _ in rows_of(result)] == cells.titles


def test_an_open_end_says_no_more_than_is_known(plain):
    # The end may be open because of late contacts that depend on the last digits, although all
    # pieces recede.
    doubted = dataclasses.replace(plain, ending="open")
    assert dict(rows_of(doubted))["end"] == (
        "open: another contact may still come; the error bar allows for it"
    )


def test_a_step_is_called_h_whatever_the_scheme(plain):
    assert ", H = 0.01" in closing(dataclasses.replace(plain, scheme="verlet", timestep=0.01))[0]
    assert "time step H" in ALL_TERMS["setting"]


def test_text_from_a_scene_is_no_html(plain):
    odd = dataclasses.replace(plain, potential="<script>alert(1)</script>")
    assert "<script>alert(1)</script> bonds" in Cells(odd._repr_html_()).texts[0]


def test_every_term_that_is_printed_is_explained(result):
    printed = [name for name, _ in rows_of(result)]
    assert set(printed) <= set(TERMS)
    assert all(f"{name:22} " in describe_result(result) for name in printed)


@pytest.mark.parametrize("picture", PICTURES)
@pytest.mark.slow_cases
def test_pictures_go_into_the_axes_given(result, picture):
    figure, ax = new_figure()
    assert getattr(result.plot, picture)(ax=ax) is ax
    assert figure.axes == [ax]
    assert ax.has_data()
    assert ax.get_xlabel()
    figure.draw_without_rendering()


@pytest.mark.parametrize("picture", PICTURES)
def test_pictures_of_their_own_say_what_collided(plain, picture):
    ax = getattr(plain.plot, picture)()
    assert "$n$ = 10" in ax.figure.get_suptitle()


def test_history_is_the_motion(result):
    history = result.history
    assert history is result.history, "carried out once"
    states = result.trajectory(400)
    assert np.array_equal(history.displacements, [state.displacements for state in states])
    assert np.array_equal(history.velocities, [state.velocities for state in states])
    assert np.array_equal(history.series_times, [state.time for state in states])
    target = result.target_history
    assert (target is None) == (result.target_particles is None)
    if target is not None:
        assert np.array_equal(target.displacements, [s.target_displacements for s in states])
        assert np.array_equal(target.velocities, [s.target_velocities for s in states])
        # Without a wall, one body gains the momentum that the other loses.
        both = history.momentum + target.momentum
        np.testing.assert_allclose(both, both[0], rtol=1e-9)
    # The motion conserves energy. The tolerance is wider than that of eta, because single frames
    # have larger errors.
    bodies = [body for body in (history, result.target_history) if body is not None]
    energy = np.sum([body.translation + body.vibration for body in bodies], axis=0)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-3)
    if result.target_particles is None:
        # After the last contact, the translational energy is constant: eta times that at impact.
        before = 0.5 * result.particles * result.velocity**2
        assert history.translation[-1] / before == pytest.approx(
            result.restitution, abs=result.restitution_error + 1e-9
        )


def test_energy_starts_whole(result):
    ax = result.plot.energy()
    top = ax.collections[-1].get_paths()[0].vertices[:, 1].max()
    assert top == pytest.approx(1.0, abs=1e-3)
    # Before the first contact, all energy of a cold chain is translational.
    translation = ax.collections[0].get_paths()[0].vertices
    if result.temperature is None:
        assert translation[:, 1].max() == pytest.approx(1.0, abs=1e-6)


def test_a_list_of_results_is_a_table(plain):
    slow = collide(Scene(potential="harmonic", particles=3, engine="reference"))
    missed = dataclasses.replace(plain, tolerance_met=False, reason="", potential="<b>")
    many = ResultTable([plain, slow, missed])
    lines = [line.split() for line in repr(many).splitlines()]
    assert lines[0] == ["bonds", "particles", "v0", "eta", "e", "contacts", "end"]
    assert lines[1][:4] == ["lj", "10", "0.4", "v*"]
    assert lines[1][4] == f"{plain.restitution:.8f}"
    assert lines[2][:3] == ["harmonic", "3", "0.1"]
    assert repr(many).endswith("tolerance not met")
    texts = Cells(many._repr_html_()).texts
    assert len(texts) == 4 * 7
    assert texts[21] == "<b>"
    assert repr(ResultTable()) == "[]"


def test_a_free_target_is_in_the_picture():
    ax = collide(SCENES["target"]).plot.world_lines()
    lowest = min(line.get_ydata().min() for line in ax.get_lines())
    assert lowest < -1.9  # the last of three particles is two bond lengths behind the contact
    assert ax.get_ylabel().startswith("position")


def test_of_a_broken_chain_kinetic_energies_are_drawn():
    broken = collide(SCENES["broken"])
    assert broken.fragments > 1
    ax = broken.plot.spectrum()
    (drawn,) = (line.get_ydata() for line in ax.get_lines())
    energy = 0.5 * 20 * broken.velocity**2
    np.testing.assert_allclose(drawn, kinetic_mode_energies(broken.velocities)[1:] / energy)
    assert "kinetic" in ax.get_ylabel()


@pytest.mark.slow
def test_a_moving_picture(plain, tmp_path):
    moving = plain.plot.animate(pictures=3)
    assert "data:image/gif;base64," in moving._repr_html_()
    with Image.open(io.BytesIO(moving.data)) as image:
        assert image.n_frames == 3
    assert moving.save(tmp_path / "a.gif").read_bytes() == moving.data
    assert plain.plot.animate(tmp_path / "b.gif", pictures=2) == tmp_path / "b.gif"
    with pytest.raises(InputError, match=r"Give a name that ends in \.gif or \.mp4"):
        plain.plot.animate(tmp_path / "b.png")


def test_what_cannot_be_drawn_is_refused_in_one_line(plain):
    with pytest.raises(InputError, match=r"quantity is 'forces'\. Use intervals or speeds"):
        plain.plot.contacts("forces")
    with pytest.raises(InputError, match=r"the number of pictures is 0\. Give a whole number"):
        plain.plot.animate(pictures=0)
    with pytest.raises(InputError, match=r"magnification is nan\. Give a positive finite"):
        plain.plot.world_lines(magnification=math.nan)
    alone = collide(Scene(particles=1, engine="reference"))
    with pytest.raises(InputError, match="a single particle has no modes"):
        alone.plot.spectrum()
    for picture in ("world_lines", "energy", "contacts"):
        assert getattr(alone.plot, picture)().get_xlabel()
    fast = collide(Scene(particles=5, speed=1e7, engine="reference"))
    assert fast.plot.contacts("speeds").has_data()
    with pytest.raises(RunError, match="bonds have no motion to show"):
        fast.plot.world_lines()
    by_hand = dataclasses.replace(plain, replay=None)
    with pytest.raises(InputError, match="Use a result of collide"):
        _ = by_hand.scene
    with pytest.raises(InputError, match="Use a result of collide"):
        by_hand.plot.world_lines()
    assert plain.scene is plain.replay.scene


def in_python(code):
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.mark.slow
def test_pyplot_is_not_needed_and_knows_the_figure_where_it_is_in_use():
    scene = "collide(Scene(potential='harmonic', particles=3, engine='reference'))"
    code = f"""
import sys
from chaincor import Scene, collide
plot = {scene}.plot
plot.spectrum()
print("matplotlib.pyplot" in sys.modules)
import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
size = plt.rcParams["font.size"], plt.rcParams["axes.grid"]
figure = plot.spectrum().figure
print(plt.figure(plt.get_fignums()[0]) is figure)
print(size == (plt.rcParams["font.size"], plt.rcParams["axes.grid"]))
"""
    assert in_python(code) == ["False", "True", "True"]


CELLS = (
    "from chaincor import Scene, collide\n"
    "result = collide(Scene(potential='harmonic', particles=3, engine='reference'))\nresult",
    "ax = result.plot.spectrum()\nax.set_title('mine');",
    # Before matplotlib 3.10, a notebook shows figures of pyplot only after the cell with the first
    # figure.
    "import matplotlib.pyplot as plt\nplt.close(plt.figure())",
    "ax = result.plot.spectrum()",
    "figure, ax = plt.subplots()\nresult.plot.spectrum(ax=ax);",
    "many = collide([result.scene] * 3)\nmany",
    "result.plot.animate(pictures=2)",
)


@pytest.mark.slow
def test_a_notebook_shows_each_figure_once():
    nbformat, nbclient = pytest.importorskip("nbformat"), pytest.importorskip("nbclient")
    pytest.importorskip("ipykernel")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(text) for text in CELLS])
    nbclient.NotebookClient(notebook, timeout=300).execute()
    shown = [[set(output.get("data", output)) for output in c.outputs] for c in notebook.cells]
    assert shown[0] == [{"text/plain", "text/html"}]
    for cell in (1, 3, 4):
        assert shown[cell] == [{"image/png", "text/plain"}]
    bar, table = notebook.cells[5].outputs
    assert "3 of 3 collisions" in bar["data"]["text/html"]
    assert table["data"]["text/html"].count("<tr>") == 4
    bar, moving = notebook.cells[6].outputs
    assert "2 of 2 pictures" in bar["data"]["text/html"]
    assert "image/gif" in moving["data"]["text/html"]


@pytest.mark.parametrize(
    "fields",
    [
        {"potential": "harmonic", "particles": 10},
        {"potential": "lj", "particles": 20, "speed": 0.9},
        {"potential": "toda", "particles": 15, "masses": (1.0, 2.0)},
    ],
)
def test_bond_lengths_are_the_extremes_within_what_is_said(fields):
    found = collide(Scene(engine="reference", **fields))
    # Steps are so short that bond lengths at their ends are within 1e-6 of the extremes.
    fine = collide(
        Scene(engine="reference", scheme="order8", timestep=0.004, error=False, **fields)
    )
    assert fine.bond_error < 1e-5
    for name in ("bond_min", "bond_max"):
        off = abs(getattr(found, name) - getattr(fine, name))
        assert 1e-5 < off <= found.bond_error < 2e-2
    assert f"+- {found.bond_error:.1g}" in describe_result(found)


def test_the_theory_of_springs_is_drawn_for_springs_alone(plain):
    def lines(**fields):
        found = collide(Scene(particles=20, engine="reference", **fields))
        return len(found.plot.spectrum().lines)

    assert lines(potential="harmonic") == 2
    assert lines(potential="lj", speed=0.9) == 1
