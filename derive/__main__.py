"""Command line: ``python -m derive [--check] [--root FOLDER]``."""

from __future__ import annotations

import argparse
import difflib
import sys
from pathlib import Path

from derive.build import ROOT, build


def differences(texts: dict[str, str], root: Path) -> str:
    """Unified diff from what is in ``root`` to what the derivation gives."""
    parts: list[str] = []
    for name, text in texts.items():
        path = root / name
        committed = path.read_text(encoding="utf-8") if path.exists() else ""
        old, new = committed.splitlines(keepends=True), text.splitlines(keepends=True)
        parts += difflib.unified_diff(old, new, f"committed/{name}", f"derived/{name}")
    return "".join(parts)


def write(texts: dict[str, str], root: Path) -> None:
    """Write every file, in one encoding and with one kind of line end everywhere."""
    for name, text in texts.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8", newline="\n")


def main(arguments: list[str] | None = None) -> int:
    """Derive, and write or compare; the exit code is 1 where a comparison fails."""
    parser = argparse.ArgumentParser(prog="python -m derive", description=__doc__)
    parser.add_argument("--check", action="store_true", help="compare instead of writing")
    parser.add_argument(
        "--root", type=Path, default=ROOT, help="folder to write to or compare with"
    )
    options = parser.parse_args(arguments)
    texts = build()
    if not options.check:
        write(texts, options.root)
        return 0
    changes = differences(texts, options.root)
    sys.stdout.write(changes)
    return 1 if changes else 0


if __name__ == "__main__":
    sys.exit(main())
