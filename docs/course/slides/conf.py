"""Configure the slides, which `make docs` builds offline from index.md with warnings as errors."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "extensions"))

project = "How bouncy is a chain?"
author = copyright = "chaincor maintainers"

extensions = ["myst_parser", "sphinx_revealjs", "mathml", "focus"]
myst_enable_extensions = ["dollarmath", "attrs_inline", "colon_fence"]

html_math_renderer = "mathml"
revealjs_style_theme = "white"
revealjs_static_path = ["_static"]
revealjs_css_files = ["slides.css"]
revealjs_script_conf = {"hash": True, "slideNumber": "h", "transition": "none", "controls": True}
revealjs_script_plugins = [
    {"name": "RevealNotes", "src": "revealjs/plugin/notes/notes.js"},
]
