"""The page with sliders: self-contained, labelled, and showing what a collision gives."""

import base64
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.collision import collide
from chaincor.workflows.pictures.sliders import explore_page


@pytest.fixture(scope="module")
def page():
    return explore_page(6, ("harmonic", "lj"), (0.3, 1.0))


@pytest.fixture(scope="module")
def data(page):
    return json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.S)[1])


class Elements(HTMLParser):
    def __init__(self):
        super().__init__()
        self.found = []

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


def test_nothing_is_loaded_from_elsewhere(page):
    assert not re.search(r"(src|href)\s*=|url\(|https?://|import\s", page)


def test_every_control_has_a_label_and_every_picture_a_name(page):
    elements = Elements()
    elements.feed(page)
    labels = {attrs["for"] for tag, attrs in elements.found if tag == "label"}
    controls = [attrs["id"] for tag, attrs in elements.found if tag in ("input", "select")]
    assert controls
    assert set(controls) <= labels
    pictures = [attrs for tag, attrs in elements.found if tag in ("canvas", "svg")]
    assert len(pictures) == 2
    for attrs in pictures:
        assert attrs["role"] == "img"
        assert "aria-labelledby" in attrs
    assert ("html", {"lang": "en"}) in elements.found


def test_numbers_are_those_of_collide(data):
    assert [len(data["collisions"][name]) for name in ("harmonic", "lj")] == [1, 2]
    for shown in data["collisions"]["lj"]:
        result = collide(Scene(potential="lj", particles=6, speed=shown["speed"]), tolerance=1e-7)
        # The motion is followed to 1e-6 and LAMMPS to 1e-7.
        assert shown["restitution"] == pytest.approx(result.restitution, abs=3e-6)
        assert len(shown["contacts"]) == result.contacts
        assert (shown["ending"] == "open") == (result.ending == "open")


@pytest.mark.parametrize("particles", [3, 6])
def test_the_axis_holds_every_point(particles):
    # Chains of three keep half of their energy; the axis once began at 60 % for all.
    page = explore_page(particles, ("harmonic", "lj"), (0.3, 1.0))
    data = json.loads(re.search(r'type="application/json">(.*?)</script>', page, re.S)[1])
    etas = [c["restitution"] for each in data["collisions"].values() for c in each]
    assert data["levels"][0] <= min(etas) < data["levels"][-1] == 1.0
    assert "y = eta => 190 - 170 * (eta - low) / (1 - low)" in page


def test_frames_unpack_to_the_motion(data):
    shown = data["collisions"]["harmonic"][0]
    whole = np.frombuffer(base64.b64decode(shown["velocities"]["base64"]), "<i2")
    velocities = (whole * shown["velocities"]["scale"]).reshape(shown["frames"], 6)
    # At first contact all move in, but for particle 1, just reversed; in the end they fly off.
    assert velocities[0] == pytest.approx([1.0, -1.0, -1.0, -1.0, -1.0, -1.0], abs=1e-3)
    assert velocities[-1].mean() ** 2 == pytest.approx(shown["restitution"], abs=1e-3)


def luminance(colour):
    """Relative luminance of #rgb or #rrggbb, after WCAG 2."""
    digits = colour[1:] if len(colour) == 7 else "".join(2 * digit for digit in colour[1:])
    parts = [int(digits[k : k + 2], 16) / 255.0 for k in (0, 2, 4)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def test_text_and_lines_stand_out_in_light_and_dark(page):
    themes = re.findall(r":root \{([^}]*--ink[^}]*)\}", page)
    assert len(themes) == 2
    for theme in themes:
        colours = dict(re.findall(r"--(\w+): (#\w+)", theme))
        paper = luminance(colours.pop("paper"))
        for name, colour in colours.items():
            low, high = sorted((paper, luminance(colour)))
            # WCAG 2 asks 4.5 of text.
            assert (high + 0.05) / (low + 0.05) >= 4.5, name
