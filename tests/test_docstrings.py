"""Whatever is public is described, and the examples in the descriptions are true."""

import ast
import doctest
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = [path for top in ("aeroflutter", "derive") for path in sorted((ROOT / top).rglob("*.py"))]


def _public(node: ast.Module | ast.ClassDef, prefix: str = "") -> Iterator[tuple[str, ast.AST]]:
    """Public classes, functions and methods, except the bodies of protocols and overrides."""
    for child in node.body:
        if not isinstance(child, (ast.ClassDef, ast.FunctionDef)) or child.name.startswith("_"):
            continue
        yield prefix + child.name, child
        if isinstance(child, ast.ClassDef) and not _is_protocol(child):
            yield from _public(child, f"{prefix}{child.name}.")


def _is_protocol(node: ast.ClassDef) -> bool:
    return any(ast.unparse(base).partition("[")[0].endswith("Protocol") for base in node.bases)


def _stub(node: ast.AST) -> bool:
    """An overload's body: nothing but `...`."""
    return isinstance(node, ast.FunctionDef) and [ast.unparse(line) for line in node.body] == [
        "..."
    ]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_public_things_have_docstrings(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert ast.get_docstring(tree), "the module itself"
    bare = [
        name
        for name, node in _public(tree)
        if not _stub(node) and not ast.get_docstring(node)  # type: ignore[arg-type]
    ]
    assert not bare


WITH_EXAMPLES = [
    path.relative_to(ROOT)
    for path in MODULES
    if ">>> " in path.read_text(encoding="utf-8") and path.is_relative_to(ROOT / "aeroflutter")
]


@pytest.mark.parametrize("path", WITH_EXAMPLES, ids=lambda path: path.as_posix())
def test_examples_in_docstrings_do_what_they_show(path: Path) -> None:
    found = doctest.testmod(import_module(".".join(path.with_suffix("").parts)))
    assert found.attempted
    assert not found.failed
