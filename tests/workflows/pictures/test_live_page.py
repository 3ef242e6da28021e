"""Test that the live page is self-contained and legible, and computes what collide computes."""

import json
import re
from html.parser import HTMLParser

import pytest

from chaincor.analysis.figures import style
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.pictures.live_page import live_page
from tests.workflows.pictures.browser import Browser, find_chromium
from tests.workflows.pictures.live_scenes import PROMISE, SCENES, page_scene, reference

needs_browser = pytest.mark.skipif(find_chromium() is None, reason="no Chromium on this machine")


@pytest.fixture(scope="module")
def page():
    return live_page(12)


@pytest.fixture(scope="module")
def browser(page, tmp_path_factory):
    path = tmp_path_factory.mktemp("live") / "page.html"
    path.write_text(page, encoding="utf-8")
    with Browser() as browser:
        browser.path = path
        yield browser


@pytest.fixture
def opened(browser):
    """Return a function that opens the page from its file; check that it reports no error."""

    def open_page(fragment="", width=1280, height=900, dark=False):
        browser.complaints.clear()
        browser.show(width, height, dark)
        browser.open(browser.path, fragment)
        return browser

    yield open_page
    assert browser.complaints == []


class Elements(HTMLParser):
    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


def test_nothing_is_loaded_from_elsewhere(page):
    assert not re.search(r"(src|href)\s*=\s*[\"']|url\(|https?://|import\s|fetch\(", page)


def test_every_control_has_a_label_and_every_picture_a_name(page):
    elements = Elements()
    elements.feed(page)
    labels = {attrs["for"] for tag, attrs in elements.found if tag == "label"}
    controls = [attrs for tag, attrs in elements.found if tag in ("input", "select")]
    assert len(controls) > 10
    for attrs in controls:
        assert attrs["id"] in labels or attrs.get("aria-label"), attrs
    names = {attrs["id"] for _, attrs in elements.found if "id" in attrs}
    pictures = [attrs for tag, attrs in elements.found if tag == "canvas"]
    assert len(pictures) == 6
    for attrs in pictures:
        assert attrs["role"] == "img"
        assert {attrs["aria-labelledby"], attrs["aria-describedby"]} <= names
    assert len({attrs["aria-describedby"] for attrs in pictures}) == 6
    assert ("html", {"lang": "en"}) in elements.found


def luminance(colour):
    """Return the relative luminance of #rrggbb as defined by WCAG 2."""
    parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_text_stands_out_in_light_and_dark(page):
    themes = re.findall(r"\{([^{}]*--ink:[^}]*)\}", page)
    assert len(themes) == 3
    # The dark theme is equal whether the user or the system chooses it.
    assert themes[1].split() == themes[2].split()
    for theme in themes:
        colours = dict(re.findall(r"--([\w-]+): (#\w{6})", theme))
        for ground in ("paper", "panel"):
            for name in ("ink", "faint", "accent", "mark"):
                pair = luminance(colours[ground]), luminance(colours[name])
                # WCAG 2 requires a contrast of 4.5 for text.
                assert (max(pair) + 0.05) / (min(pair) + 0.05) >= 4.5, (name, ground)


def test_colours_are_those_of_the_figures(page):
    for name in ("blue", "orange", "green", "vermilion", "purple", "sky"):
        assert f"--{name}: {getattr(style, name.upper())};" in page


IDLE = "document.body.dataset.state === 'idle' && shown.curve.length > 0"


def text_of(browser, name):
    return browser.evaluate(f"find({name!r}).textContent")


@needs_browser
@pytest.mark.slow
def test_the_page_computes_from_its_file(opened):
    browser = opened("#potential=toda&particles=6&speed=0.5&toda_b=4")
    browser.wait(IDLE)
    assert re.match(r"0\.[\d\u2009]+ ± \d·10⁻", text_of(browser, "eta"))
    assert text_of(browser, "ending").startswith("Proved that")
    said = r"Time step ([\d.e-]+); the run before, with ([\d.e-]+), gives the error bar"
    step, before = re.match(said, text_of(browser, "progress")).groups()
    assert float(before) == pytest.approx(2.0 * float(step), rel=1e-2)  # three digits are shown
    assert text_of(browser, "command") == (
        "chaincor run --engine reference --potential toda --toda-b 4 --particles 6 --speed 0.5"
    )
    assert browser.evaluate("shown.curve.length") == 40
    eta = browser.evaluate("shown.run.restitution")
    on_curve = browser.evaluate("shown.curve.find((p) => p.speed === 0.5).restitution")
    assert on_curve == pytest.approx(eta, abs=2e-6)


# Colours of the legends, and of the background of axes and curves.
COLOURS = """[...document.querySelectorAll('.key i, canvas')].map(
    (part) => getComputedStyle(part).backgroundColor)"""


@needs_browser
@pytest.mark.slow
def test_forced_colours_keep_legends_and_the_ground_of_pictures(opened):
    browser = opened("#potential=harmonic&particles=10&velocity=0.1")
    browser.wait(IDLE)
    # The user chooses the light theme, while the system forces light letters on black.
    browser.evaluate("document.documentElement.dataset.theme = 'light'")
    normal = browser.evaluate(COLOURS)
    scheme = {"name": "prefers-color-scheme", "value": "dark"}
    forced = {"name": "forced-colors", "value": "active"}
    browser.call("Emulation.setEmulatedMedia", features=[scheme, forced])
    try:
        body = browser.evaluate("getComputedStyle(document.body).backgroundColor")
        assert body == "rgb(0, 0, 0)"
        assert browser.evaluate(COLOURS) == normal
        assert len(set(normal)) > 4
        # All six pictures have the background of the page.
        assert normal.count("rgb(255, 255, 255)") == 6
    finally:
        browser.call("Emulation.setEmulatedMedia", features=[])


VISIBLE = "document.body.innerText"


@needs_browser
@pytest.mark.slow
def test_a_class_sees_the_restitution_only_when_it_asks(opened):
    browser = opened("#potential=harmonic&particles=10&velocity=0.1&eta=hidden")
    browser.wait(IDLE)
    # The chain returns with 90.7 % of the energy and 95.2 % of the speed.
    hidden = f"!/90.7|0.907|0.952|same at every speed/.test({VISIBLE})"
    assert browser.evaluate(hidden)
    browser.evaluate("find('ask').click()")
    assert browser.evaluate(f"{VISIBLE}.includes('90.7 %') && {VISIBLE}.includes('0.952')")
    # The next collision, and its link, hide the restitution again.
    browser.evaluate("find('particles').value = 20; change()")
    browser.wait("location.hash.includes('particles=20')")
    browser.wait(IDLE)
    assert browser.evaluate("location.hash").endswith("&eta=hidden")
    assert browser.evaluate("find('eta').offsetWidth") == 0


@needs_browser
@pytest.mark.slow
def test_each_picture_is_described_by_what_it_shows(opened):
    browser = opened("#potential=harmonic&particles=10&velocity=0.1")
    browser.wait(IDLE)
    words = browser.evaluate(
        "Array.from(document.querySelectorAll('canvas'),"
        " (c) => find(c.getAttribute('aria-describedby')).textContent)"
    )
    assert all(words)
    assert len(set(words)) == 6
    assert "9 times, the last time at 18.7" in text_of(browser, "world-words")
    assert "translation has 90.7 %" in text_of(browser, "energy-words")


@needs_browser
@pytest.mark.slow
def test_no_number_stands_under_a_chain_that_is_drawn_larger(opened):
    browser = opened("#potential=harmonic&particles=10&velocity=0.1")
    # The script records the texts in the picture of the chain at the width of a phone.
    texts = (
        "(() => { const found = [], pen = CanvasRenderingContext2D.prototype;"
        "const write = pen.fillText; pen.fillText = function (text, x, y, most) {"
        "found.push([text, Math.min(this.measureText(text).width, most ?? 1e9), x]); };"
        "chainPicture.forget(); seek(6); pen.fillText = write; return found; })()"
    )
    browser.show(375, 800)
    browser.wait(IDLE)
    found = browser.evaluate(texts)
    assert [text for text, *_ in found if text.isdigit() and text not in "012"] == []
    assert "position" in [text for text, *_ in found]
    assert "displacements drawn 5.2 times as large" in text_of(browser, "chain-scale")


@needs_browser
@pytest.mark.slow
def test_keys_move_time_and_the_address_follows(opened):
    browser = opened("#potential=lj&particles=5&speed=0.5")
    browser.wait(IDLE)
    browser.evaluate("play(false); document.activeElement.blur(); seek(shown.run.film.times[0])")
    browser.press("End", 35)
    assert browser.evaluate("state.time === shown.run.film.times.at(-1)")
    browser.press("ArrowLeft", 37)
    assert browser.evaluate("state.time < shown.run.film.times.at(-1)")
    # Both key presses come in one call, so that the film cannot end in between.
    space = "document.body.dispatchEvent(new KeyboardEvent('keydown', {key: ' ', bubbles: true}))"
    states = browser.evaluate(f"[{space}, state.playing, {space}, state.playing]")
    assert states[1::2] == [True, False]
    browser.evaluate("find('speed').value = 0.25; change()")
    browser.wait("location.hash.includes('speed=0.25')")
    browser.evaluate("find('theme').click()")
    assert browser.evaluate("document.documentElement.dataset.theme") == "dark"
    browser.evaluate("find('theme').click()")
    assert browser.evaluate("document.documentElement.dataset.theme") == "light"
    browser.evaluate("localStorage.clear()")


@needs_browser
@pytest.mark.slow
def test_a_long_computation_can_be_stopped(opened):
    browser = opened("#potential=lj&particles=500&speed=1.6")
    browser.wait("document.body.dataset.state === 'working'")
    browser.evaluate("find('stop').click()")
    assert text_of(browser, "progress") == "Stopped."
    assert browser.evaluate("document.body.dataset.state") == "idle"


@needs_browser
@pytest.mark.slow
def test_what_cannot_be_is_said(opened):
    browser = opened("#potential=harmonic&particles=8&velocity=0.9")
    browser.wait("!find('refusal').hidden")
    assert "pass through each other" in text_of(browser, "refusal")
    browser.evaluate("find('speed').value = 'x'; change()")
    browser.wait("find('refusal').textContent.startsWith('Impact speed is')")
    browser.evaluate("find('speed').value = 0.2; change()")
    browser.wait("find('refusal').hidden && find('eta').textContent.includes('±')")


@needs_browser
@pytest.mark.slow
def test_bonds_that_break_look_broken(opened):
    browser = opened("#potential=lj&particles=20&speed=1.5")
    browser.wait(IDLE)
    assert browser.evaluate("shown.run.fragments") == 2
    assert not browser.evaluate("find('break-key').hidden")
    assert "breaks at 1 bond" in text_of(browser, "verdict")


@needs_browser
@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True])
def test_a_phone_need_not_scroll_sideways(opened, dark):
    browser = opened("#particles=5&temperature=0.001&target_particles=3", 390, 844, dark)
    browser.wait(IDLE)
    assert browser.evaluate("document.documentElement.scrollWidth") == 390
    assert browser.evaluate("find('seed').offsetWidth > 0 && find('target_masses').offsetWidth > 0")
    ground = browser.evaluate("getComputedStyle(document.body).backgroundColor")
    assert ground == ("rgb(20, 23, 28)" if dark else "rgb(255, 255, 255)")


@needs_browser
@pytest.mark.slow
@pytest.mark.parametrize("name", SCENES)
def test_thirty_scenes_against_collide(browser, name):
    if browser.evaluate("location.protocol") != "file:":
        browser.open(browser.path)
    scene = json.dumps(page_scene(SCENES[name]))
    found = browser.evaluate(
        "new Promise((resolve, refuse) => { const worker = makeWorker();"
        "worker.onmessage = ({ data }) => { if (data.kind === 'refused') refuse(data.message);"
        "if (data.done) { worker.terminate(); resolve({ eta: data.run.restitution,"
        "error: data.run.error, contacts: data.run.contacts.length }); } };"
        f"worker.postMessage({{ id: 1, task: 'collide', scene: {scene} }}); }})"
    )
    expected = reference(name)
    # The error bar is far below the accuracy of the page.
    assert expected.restitution_error < 0.03 * PROMISE
    difference = abs(found["eta"] - expected.restitution)
    assert difference <= PROMISE
    assert difference <= found["error"] + expected.restitution_error
    assert found["contacts"] == expected.contacts


@needs_browser
@pytest.mark.slow
def test_bonds_are_as_long_as_the_program_says(opened):
    browser = opened("#potential=lj&particles=20&speed=0.9")
    browser.wait(IDLE)
    words = text_of(browser, "facts")
    found = re.search(r"up to the last contact: (0\.\d+) to (1\.\d+)", words)
    scene = Scene(particles=20, speed=0.9, engine="reference", scheme="order8", timestep=0.05)
    expected = collide(scene)
    # The tolerance covers bond lengths between steps of the program and the page, and half a unit
    # of the page's last digit. After the last contact, a bond reaches 1.25 while the page still
    # follows the chain.
    room = 2.0 * expected.bond_error + 5e-4
    assert float(found[1]) == pytest.approx(expected.bond_min, abs=room)
    assert float(found[2]) == pytest.approx(expected.bond_max, abs=room)
    assert room < 0.01


@needs_browser
@pytest.mark.slow
def test_the_saved_state_of_a_warm_chain_gives_the_program_the_same_collision(
    opened, tmp_path, monkeypatch, chaincor
):
    browser = opened("#potential=lj&particles=12&speed=0.4&masses=1,2&temperature=0.0003&seed=5")
    browser.wait(IDLE)
    assert text_of(browser, "command-label").startswith("The same collision")
    command = text_of(browser, "command")
    state = browser.evaluate("fetch(find('first-state').href).then((file) => file.text())")
    (tmp_path / "state.csv").write_text(state)
    monkeypatch.chdir(tmp_path)
    status, out, err = chaincor(*command.split()[1:], "--tolerance", "1e-10", "--json")
    assert status == 0, err
    expected = json.loads(out)
    found = browser.evaluate("[shown.run.restitution, shown.run.contacts.length]")
    # The page promises 1e-9, and the program has a tenth of this tolerance.
    assert found[0] == pytest.approx(expected["restitution"], abs=1.1 * PROMISE)
    assert found[1] == expected["contacts"]
    # A file contains the state of one body. With a free target, the page reports that the states
    # differ.
    browser.evaluate("find('target').value = 'free'; change()")
    browser.wait("find('command-label').textContent.includes('another collision')")
    assert "--temperature 0.0003 --seed 5" in text_of(browser, "command")
    assert browser.evaluate("find('first-state').hidden")


@needs_browser
@pytest.mark.slow
def test_a_number_without_a_proved_end_is_said_so_far(opened):
    browser = opened("#potential=lj&particles=50&speed=1")
    browser.wait(IDLE)
    assert text_of(browser, "ending").startswith("Not proved that it was the last contact")
    # The page shows four digits instead of the ten that the error bar allows.
    assert re.fullmatch(r"0\.\d{4} so far", text_of(browser, "eta"))


@needs_browser
@pytest.mark.slow
def test_each_field_is_understood(opened):
    browser = opened("#potential=harmonic&particles=1&velocity=0.1")
    browser.wait(IDLE)
    assert text_of(browser, "verdict").startswith("100.0 % of the translational energy comes back")
    assert "Bond" not in text_of(browser, "facts")
    browser.evaluate("find('particles').value = 6; find('masses').value = '1 2, 3'; change()")
    browser.wait("find('command').textContent.includes('--masses 1,2,3')")
    browser.wait(IDLE)
    browser.evaluate("find('target').value = 'free'; change()")
    browser.wait("find('verdict').textContent.includes('% of the energy of relative motion')")
    browser.evaluate("find('temperature').value = 2; change()")
    browser.wait("!find('refusal').hidden")
    assert text_of(browser, "refusal") == "Temperature is 2: expected a number from 0 to 1."
    # Nothing of the previous scene may remain.
    for name in ("command", "command-label", "eta", "verdict", "ending", "facts"):
        assert text_of(browser, name) == ""
    # The program may compute what the page cannot.
    browser.open(browser.path, "#potential=log&particles=20&speed=9")
    browser.wait("!find('refusal').hidden")
    assert "see the command below" in text_of(browser, "refusal")
    assert text_of(browser, "command").endswith("--potential log --particles 20 --speed 9")
    browser.evaluate("find('potential').value = 'power'; change()")
    browser.wait("find('power_order-hint').textContent === '3 to 20'")
    assert text_of(browser, "power_c-hint") == "0.001 to 1000"
