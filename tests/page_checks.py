"""Check that a written page is a single file whose links work."""

import hashlib
import html
import re


def read_page(path):
    """Return a page's text; check that it loads no other files and has no dead links."""
    page = path.read_text(encoding="utf-8")
    assert all(s.startswith("data:image/") for s in re.findall(r'src="([^"]{0,30})', page))
    for word in ("<script", "<link", "@import", "url("):
        assert word not in page
    places = re.findall(r'id="([^"]+)"', page)
    assert len(places) == len(set(places))
    for target in re.findall(r'href="([^"]+)"', page):
        if target.startswith("#"):
            assert target[1:] in places, target
        else:
            assert (path.parent / target).is_file(), target
    assert "prefers-color-scheme: dark" in page
    return page


def check_file_list(page, folder, beside=()):
    """Check that a page lists each file of its folder with its hash, except those in `beside`."""
    for path in folder.iterdir():
        listed = f'<a href="{path.name}">{path.name}</a>' in page
        assert listed == (path.name not in beside), path.name
        if listed:
            assert hashlib.sha256(path.read_bytes()).hexdigest() in page


def words_of(page):
    """Return the text of a page without tags."""
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", page)).split())
