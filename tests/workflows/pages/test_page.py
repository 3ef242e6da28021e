"""Test the figures and the list of files on a page."""

import base64

import pytest

from chaincor.workflows.pages.page import data_uri, drawn_figures, files_written
from chaincor.workflows.pages.typesetting import mark_up, symbols


def test_a_figure_is_shown_as_svg_unless_that_is_missing_or_large():
    small, large, picture = b"<svg/>", bytes(500_000), b"png"
    shown = "data:image/{};base64,{}".format
    assert data_uri({"svg": small, "png": picture}) == shown(
        "svg+xml", base64.b64encode(small).decode()
    )
    as_picture = shown("png", base64.b64encode(picture).decode())
    assert data_uri({"png": picture}) == as_picture
    assert data_uri({"svg": large, "png": picture}) == as_picture


def test_figures_that_were_not_drawn_are_left_out(tmp_path):
    (tmp_path / "b.png").write_bytes(b"png")
    (tmp_path / "c.svg").write_bytes(b"<svg/>")
    (tmp_path / "c.png").write_bytes(b"png")
    about = {name: (name.upper(), "caption") for name in "cab"}
    figures = drawn_figures(tmp_path, about, "five particles")
    assert [figure["key"] for figure in figures] == ["c", "b"]
    assert figures[0]["files"] == ["c.svg", "c.png"]
    assert figures[1]["alt"] == "B: five particles"


def test_files_are_recognised_by_name_or_ending(tmp_path):
    (tmp_path / "a.csv").write_text("a")
    (tmp_path / "b.png").write_text("")
    listed = files_written(tmp_path, {"a.csv": "numbers", "*.png": "figure"})
    assert [(file["name"], file["holds"], file["size"]) for file in listed] == [
        ("a.csv", "numbers", 1),
        ("b.png", "figure", 0),
    ]
    # This is the SHA-256 of the letter a.
    assert listed[0]["sha256"].startswith("ca978112ca1bbdca")


@pytest.mark.parametrize(
    ("spelt", "shown"),
    [
        ("eta = 0.9 +- 1e-07", "η = 0.9 ± 1e−7"),
        ("e = sqrt(eta), beta", "e = √(η), beta"),
        ("K_r/K_i of v0", "K<sub>r</sub>/K<sub>i</sub> of v<sub>0</sub>"),
        ("10^-6", "10<sup>−6</sup>"),
    ],
)
def test_what_a_terminal_spells_out_has_its_symbol(spelt, shown):
    assert mark_up(symbols(spelt)) == shown
