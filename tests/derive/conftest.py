"""The derivation is not installed: it is imported from the root of the repository."""

import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
if str(ROOT) not in sys.path:
    sys.path.insert(0, str(ROOT))


@pytest.fixture(scope="session")
def derived() -> dict[str, str]:
    """Everything the derivation writes, as text by path."""
    from derive.build import build

    return build()
