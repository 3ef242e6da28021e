"""Test that links and pictures of the pages exist, and that the check finds broken ones."""

import importlib.util
import re

import pytest

from tests.docs.documents import DOCUMENTS, ROOT

_LINK = re.compile(r"(!?)\[([^\]]*)\]\(([^)\s]+)\)")


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda p: str(p.relative_to(ROOT)))
def test_links_of_a_page_exist_and_pictures_have_texts(path):
    text = re.sub(r"^```.*?^```", "", path.read_text(), flags=re.MULTILINE | re.DOTALL)
    for picture, words, target in _LINK.findall(text):
        if picture:
            # A screen reader reads only these words.
            assert len(words) > 20, f"{target} needs a text that says what it shows"
        if not target.startswith(("http", "#")):
            assert (path.parent / target.split("#")[0]).exists(), target


def test_the_check_of_the_site_finds_each_kind_of_fault(tmp_path):
    spec = importlib.util.spec_from_file_location("check_links", ROOT / "docs" / "check_links.py")
    check_links = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(check_links)
    (tmp_path / "a.html").write_text('<p id="here"><a href="b.html#there">b</a><a href="#here">')
    (tmp_path / "b.html").write_text('<h1 id="there">b</h1><img src="a.html" alt="a">')
    assert check_links.broken_links(tmp_path) == []
    (tmp_path / "c.html").write_text('<a href="a.html#particles=10&eta=hidden">settings</a>')
    assert check_links.broken_links(tmp_path) == []
    (tmp_path / "b.html").write_text('<img src="gone.png"><a href="a.html#gone">a</a>')
    faults = "\n".join(check_links.broken_links(tmp_path))
    for fault in ("has no text", "gone.png does not exist", "a.html#gone has no such anchor"):
        assert fault in faults
    assert "b.html#there has no such anchor" in faults
