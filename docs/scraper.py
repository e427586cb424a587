"""Puts the figures of a gallery script on its page: ours are made without pyplot."""

from __future__ import annotations

from typing import Any

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst


def _get_sg_image_scraper() -> Any:
    """The scraper, asked for by sphinx-gallery by this name."""
    return _scrape


def _scrape(_: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    written = []
    for value in block_vars["example_globals"].values():
        if isinstance(value, Figure) and not hasattr(value, "_on_page"):
            path = next(block_vars["image_path_iterator"])
            value.savefig(path, dpi=150)
            value._on_page = True  # type: ignore[attr-defined]
            written.append(path)
    return figure_rst(written, gallery_conf["src_dir"])
