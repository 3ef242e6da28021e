"""
Check the built site by axe for barriers to access, on screens of a desktop and a phone.

Without Chromium or axe-core, the check is skipped, and the program names the missing one. Install
axe-core by ``npm install axe-core`` in the folder from which this program runs.
"""

import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

AXE = Path("node_modules/axe-core/axe.min.js")
SIZES = ((1280, 900), (375, 800))
# One page made from docstrings is checked, because all are similar. Pages of frameworks are not
# checked.
_SKIPPED = ("_static", "reference/api")
# Time limit in seconds; on a busy machine, axe takes a minute for the longest pages.
_PATIENCE = 900.0
_READY = "document.body.dataset.state === 'idle' && shown.curve.length > 0"
# Show the next slide and wait until its animation ends.
_NEXT = "Reveal.next(), new Promise((done) => setTimeout(done, 1200))"
_RUN = (
    "axe.run(document, {preload: false, resultTypes: ['violations']}).then((found) =>"
    " found.violations.map((v) => [v.impact, v.id, v.nodes[0].target.join(' ')]))"
)


def barriers(browser: Any, page: Path, axe: str) -> list[str]:
    """Return the serious and critical violations of a page, or of all slides on the page."""
    browser.open(page)
    if page.name == "live.html":
        browser.wait(_READY)
    slides = browser.evaluate("typeof Reveal === 'undefined' ? 1 : Reveal.getTotalSlides()")
    browser.evaluate(f"{axe};0")
    lines = []
    for slide in range(slides):
        if slide:
            browser.evaluate(_NEXT)
        place = f"{page}, slide {slide + 1}" if slides > 1 else str(page)
        found = browser.evaluate(_RUN)
        lines += [f"{place}: {rule} at {where}" for impact, rule, where in found
                  if impact in ("serious", "critical")]  # fmt: skip
    return lines


def pages_of(site: Path) -> list[Path]:
    """Return the pages that are checked."""
    pages = sorted(site.rglob("*.html"))
    api = [page for page in pages if "reference/api" in page.as_posix()][:1]
    return [
        p for p in pages if not any(s in p.relative_to(site).as_posix() for s in _SKIPPED)
    ] + api


def main(site: Path) -> int:
    """Check all pages; return the exit status."""
    from tests.workflows.pictures.browser import Browser, find_chromium

    missing = [
        name
        for name, there in (("Chromium", find_chromium()), (str(AXE), AXE.exists()))
        if not there
    ]
    if missing:
        print(f"accessibility is not checked: no {' and no '.join(missing)}")
        return 0
    found = []
    with Browser(patience=_PATIENCE) as browser:
        for width, height in SIZES:
            browser.show(width, height)
            for page in pages_of(site):
                found += [
                    f"{line} ({width} px)" for line in barriers(browser, page, AXE.read_text())
                ]
    print("\n".join(found) or "no barrier that axe finds")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
