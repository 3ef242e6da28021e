"""Check that the targets of all links, pictures and anchors in the built site exist."""

import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit


class _Page(HTMLParser):
    """Collect the anchors of a page and the targets of its links."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.anchors: set[str] = set()
        self.targets: set[str] = set()
        self.pictures_without_text: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self.anchors |= {values[name] for name in ("id", "name") if name in values}
        self.targets |= {values[name] for name in ("href", "src") if name in values}
        if tag == "img" and not values.get("alt"):
            self.pictures_without_text.append(values.get("src", ""))


def broken_links(site: Path) -> list[str]:
    """
    Follow all links within the site.

    Parameters
    ----------
    site : pathlib.Path
        Folder of HTML files.

    Returns
    -------
    list of str
        One line for each link without a target and for each picture without a text.
    """
    pages = {path: _Page(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}
    found = []
    for path, page in pages.items():
        found += [f"{path}: picture {src} has no text" for src in page.pictures_without_text]
        for target in sorted(page.targets):
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            there = path if not parts.path else (path.parent / unquote(parts.path)).resolve()
            there = there / "index.html" if there.is_dir() else there
            if not there.exists():
                found.append(f"{path}: {target} does not exist")
            elif (
                parts.fragment
                and "=" not in parts.fragment  # settings of the live page, which are no anchor
                and there in pages
                and unquote(parts.fragment) not in pages[there].anchors
            ):
                found.append(f"{path}: {target} has no such anchor")
    return found


if __name__ == "__main__":
    problems = broken_links(Path(sys.argv[1]).resolve())
    print("\n".join(problems) or "all links lead somewhere")
    sys.exit(1 if problems else 0)
