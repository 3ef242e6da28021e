"""Test the formulas, the schematic and the search of the pages."""

import html
import json
import re
import runpy
import shutil
import subprocess
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
# The page of slips has plain text, because the report of `reproduce` shows it, too. Lessons are
# also read in terminals and notebooks.
PAGES = [
    path
    for path in sorted(DOCS.rglob("*.md"))
    if path.name != "paper_slips.md" and path.parent.name not in ("tutorials", "course")
]


def prose(text):
    """Return the text without code and formulas."""
    text = re.sub(r"^(```+).*?^\1", "", text, flags=re.MULTILINE | re.DOTALL)
    return re.sub(r"`[^`]*`|\$\$.*?\$\$|\$[^$]+\$|!\[[^\]]*\]", "", text, flags=re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_formulas_are_set_as_such(page):
    # The text may contain a letter, or a number with its unit. Powers, indices, roots and sums need
    # $...$, which becomes MathML.
    typed = re.findall(
        r".{0,20}(?:[⁰¹²³⁴-⁹⁻ⁿᵏ₀-₉ⱼᵢ√Σ∫∞½]|\w\^[({\w]).{0,10}", prose(page.read_text())
    )
    assert typed == []


def test_the_schematic_is_what_its_code_draws():
    drawing = runpy.run_path(str(DOCS / "draw_schematic.py"))
    assert drawing["PICTURE"].read_text(encoding="utf-8") == drawing["draw"]()
    for page in ("explanation/physics.md", "tutorials/1_first_collision.md"):
        assert "images/schematic.svg" in (DOCS / page).read_text()


@pytest.mark.skipif(shutil.which("node") is None, reason="the search is a script of the page")
def test_the_search_puts_the_guide_before_internals():
    # Sphinx calls the scorer with page, title, anchor, description and score. An internal module
    # with the word in its name must rank below a page with the word in its text.
    script = f"""
        {(DOCS / "_static" / "search_scorer.js").read_text()}
        const found = (page, score) => Scorer.score([page, "", "", null, score, ""]);
        const full = Scorer.title + Scorer.objNameMatch + Scorer.objPrio[0] + Scorer.term;
        console.log(JSON.stringify([
          found("howto", Scorer.partialTerm),
          found("reference/api/chaincor.workflows.campaign.sweep", full),
          found("reference/api/chaincor", Scorer.term),
          found("explanation/architecture", Scorer.title),
        ]))
    """
    done = subprocess.run(["node", "-e", script], capture_output=True, text=True, check=True)
    guide, internal, public, house = json.loads(done.stdout)
    assert internal < house < guide < public


def test_primes_and_bars_are_set_as_they_stand():
    pytest.importorskip("latex2mathml")
    to_mathml = runpy.run_path(str(DOCS / "extensions" / "mathml.py"))["to_mathml"]
    assert "<msup>" not in to_mathml("U''(1)")
    assert "″" in html.unescape(to_mathml("U''(1)"))
    assert to_mathml(r"\lvert c \rvert").count('fence="true"') == 2
    assert "<msup>" in to_mathml("w^3")
