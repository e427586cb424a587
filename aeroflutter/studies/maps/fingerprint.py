"""A hash of the code on which the numbers of a study depend: all that its modules import."""

from __future__ import annotations

import ast
import functools
import hashlib
import sys
from collections.abc import Iterable, Iterator
from importlib import metadata, resources
from importlib.resources.abc import Traversable

from aeroflutter import _EXPORTS

__all__ = ["Closure", "closure", "code_hash"]

Closure = tuple[dict[str, Traversable], frozenset[str]]

KEEPING = frozenset({"distributed", "netCDF4", "pydantic", "pydantic_core", "zarr"})
"""Libraries that check, carry and keep numbers and make none."""


@functools.cache
def code_hash(*roots: str) -> str:
    """SHA-256 over the import closure of some modules, and the versions of the libraries in it.

    Parameters
    ----------
    roots
        Full names of the modules that compute; those of other packages count for nothing.
    """
    modules, libraries = closure(*roots)
    digest = hashlib.sha256()
    for name in sorted(modules):
        digest.update(name.encode() + b"\0" + modules[name].read_bytes() + b"\0")
    versions = [(name, metadata.version(name)) for name in sorted(libraries - KEEPING)]
    digest.update(repr((sys.version_info[:2], versions)).encode())
    return digest.hexdigest()


def closure(*roots: str) -> Closure:
    """Modules of this package that some modules import, wherever and however late they do.

    Found by reading: nothing is imported for it. What is imported for the sake of types alone is
    left out.

    Parameters
    ----------
    roots
        Full names of the modules to start from.

    Returns
    -------
    modules
        Files by the full names of the modules, `roots` among them.
    libraries
        Packages of others that they import, those of Python left out.
    """
    modules: dict[str, Traversable] = {}
    foreign: set[str] = set()
    pending = list(roots)
    while pending:
        name = pending.pop()
        package, _, rest = name.partition(".")
        if package != "aeroflutter":
            foreign.add(package)
        elif name not in modules and (file := _file(rest)) is not None:
            modules[name] = file
            pending.append(name.rpartition(".")[0] or name)
            pending += _imports(ast.parse(file.read_bytes()).body)
        elif rest in _EXPORTS:
            pending.append(f"{package}.{_EXPORTS[rest]}")
    return modules, frozenset(foreign - sys.stdlib_module_names)


def _file(name: str) -> Traversable | None:
    """The file of aeroflutter.NAME, or None if that is no module."""
    first, *inner = name.split(".") if name else ("",)
    if first == "generated":
        base = resources.files("aeroflutter.generated")
    else:
        base = resources.files("aeroflutter")
        inner = [first, *inner] if first else inner
    for file in (base.joinpath(*inner, "__init__.py"), _beside(base, inner)):
        if file.is_file():
            return file
    return None


def _beside(base: Traversable, names: list[str]) -> Traversable:
    *folders, last = names or ["__init__"]
    return base.joinpath(*folders, f"{last}.py")


def _imports(statements: Iterable[ast.AST]) -> Iterator[str]:
    """Names that may be modules, of the import statements at any depth."""
    for statement in statements:
        if isinstance(statement, ast.Import):
            yield from (alias.name for alias in statement.names)
        elif isinstance(statement, ast.ImportFrom):
            yield statement.module or ""
            yield from (f"{statement.module}.{alias.name}" for alias in statement.names)
        elif isinstance(statement, ast.If) and _for_types(statement.test):
            yield from _imports(statement.orelse)
        else:
            for part in ("body", "orelse", "finalbody", "handlers", "cases"):
                yield from _imports(getattr(statement, part, ()))


def _for_types(test: ast.expr) -> bool:
    return isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"
