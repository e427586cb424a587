"""Sphinx configuration; build with `make docs`."""

from importlib import metadata

project = "aeroflutter"
author = "The aeroflutter developers"
copyright = "The aeroflutter developers, BSD-3-Clause"  # noqa: A001 (Sphinx's name)
release = metadata.version("aeroflutter")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
]
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
autodoc_member_order = "bysource"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
napoleon_google_docstring = False
napoleon_use_ivar = True
html_theme = "furo"
html_title = "aeroflutter"
exclude_patterns = ["_build"]
