"""Configure the documentation, which `make docs` builds offline with warnings as errors."""

import logging
import sys
from importlib import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))
sys.path.insert(0, str(Path(__file__).parent.parent))

# Readers need no warnings about optional file formats that MDAnalysis lacks.
logging.getLogger("MDAnalysis").setLevel(logging.ERROR)

project = "chaincor"
author = copyright = "chaincor maintainers"
try:
    release = metadata.version("chaincor")
except metadata.PackageNotFoundError:  # built from a source tree that is not installed
    release = ""

extensions = [
    "myst_parser",
    "sphinx.ext.apidoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "absolute_values",
    "mathml",
    "focus",
    "command_line",
    "observables",
    "scene_fields",
    "lesson_notebooks",
    "live_page",
    "public_names",
]
exclude_patterns = ["_build", "course/slides", "examples", "reference/api/modules.rst"]
# Docstrings name classes without their module. If two modules have classes of the same name, the
# name is shown without a link.
suppress_warnings = ["ref.python"]

myst_enable_extensions = ["dollarmath", "attrs_inline"]
myst_heading_anchors = 3
myst_links_external_new_tab = False

html_theme = "furo"
html_title = "chaincor"
html_math_renderer = "mathml"
html_static_path = ["_static"]
html_css_files = ["chaincor.css"]
html_search_scorer = str(Path(__file__).parent / "_static" / "search_scorer.js")
html_copy_source = False
html_show_sphinx = False

apidoc_modules = [
    {
        "path": "../chaincor",
        "destination": "reference/api",
        "exclude_patterns": ["**/__main__.py"],
        "follow_links": True,
        "separate_modules": True,
        "include_private": False,
        "implicit_namespaces": False,
        "max_depth": 3,
        "automodule_options": {"members", "show-inheritance"},
    }
]
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"ignore-module-all": True}
autodoc_mock_imports = ["distributed", "dask"]
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
