"""Test that pages can be read by keyboard; without a browser, report what is not checked."""

import importlib.util

import pytest

from tests.docs.documents import ROOT


def load(path):
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("html", "marked"),
    [
        ("<pre><span>x</span></pre>", '<pre tabindex="0"><span>x</span></pre>'),
        ('<table class="docutils">', '<table tabindex="0" class="docutils">'),
        ('<div class="math">', '<div tabindex="0" class="math">'),
        ('<div class="math notranslate">', '<div tabindex="0" class="math notranslate">'),
        ('<pre tabindex="0">', '<pre tabindex="0">'),
        ('<div class="math-wrapper">', '<div class="math-wrapper">'),
        ("<present>", "<present>"),
        ('<p class="caption" role="heading">', '<p class="caption" role="heading" aria-level="2">'),
        ('<p role="heading" aria-level="3">', '<p role="heading" aria-level="3">'),
    ],
)
def test_what_scrolls_takes_the_focus(html, marked):
    assert load(ROOT / "docs" / "extensions" / "focus.py").focusable(html) == marked


def test_without_a_browser_the_check_says_what_is_missing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert load(ROOT / "docs" / "check_access.py").main(tmp_path) == 0
    assert capsys.readouterr().out == (
        "accessibility is not checked: no Chromium and no node_modules/axe-core/axe.min.js\n"
    )
