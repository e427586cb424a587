"""One page of options for all commands, true, and one vocabulary on it."""

import runpy
from pathlib import Path

DOCS = Path(__file__).parents[1] / "docs"


def test_the_page_of_options_is_what_the_commands_take() -> None:
    """`python docs/options.py` writes it anew."""
    made = runpy.run_path(str(DOCS / "options.py"))
    assert (DOCS / "options.md").read_text(encoding="utf-8") == made["page"]()


def test_what_is_shared_means_the_same_in_every_command() -> None:
    found = runpy.run_path(str(DOCS / "options.py"))["options"]()
    for name in ("--json", "--units", "--velocity-range", "--speed-ratio-range"):
        assert len(found[name]) == 1, name
    takes = {
        name: {c for commands in one.values() for c in commands} for name, one in found.items()
    }
    assert takes["--velocity"] >= takes["--speed-ratio"] | takes["--speed"]
    assert takes["--velocity-range"] == takes["--speed-ratio-range"] | takes["--speed-range"]
    assert {"rootlocus", "df", "hb", "lco", "onset", "tolerance", "sweep"} <= takes["--vary"]
    assert "--largest" not in found
    assert all("." in meaning[-1:] for one in found.values() for meaning in one), "sentences"
