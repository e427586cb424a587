"""Sphinx configuration; build with `make docs`."""

import sys
from importlib import metadata
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "aeroflutter"
author = "The aeroflutter developers"
copyright = "The aeroflutter developers, BSD-3-Clause"  # noqa: A001 (Sphinx's name)
release = metadata.version("aeroflutter")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_gallery.gen_gallery",
    "figures",
    "mathml",
]
html_math_renderer = "mathml"
myst_update_mathjax = False
suppress_warnings = ["ref.python"]  # fields of results that several results have
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"/\d",
    "within_subsection_order": "FileNameSortKey",
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "image_scrapers": ("scraper",),
    "abort_on_example_error": True,
}
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_google_docstring = False
napoleon_use_ivar = True
html_theme = "furo"
html_title = "aeroflutter"
html_static_path = ["static"]
html_css_files = ["pages.css"]
exclude_patterns = ["_build", "gallery/*.ipynb", "gallery/*.py", "gallery/*.md5"]
