"""The decorator that every compiled function carries."""

from __future__ import annotations

import atexit
import threading
from collections.abc import Callable
from time import thread_time
from typing import Any, Literal, TypeVar, overload

from aeroflutter.kernels.notice import compiling_time

__all__ = ["ENTRIES", "Patient", "expect", "kernel"]

_work: list[str] = []


def expect(work: str) -> None:
    """Tell that much is to be computed in this process: patient kernels are compiled at once."""
    _work.append(work)


Function = TypeVar("Function", bound=Callable[..., Any])
Inline = Literal["never", "always"]

ENTRIES: dict[str, Any] = {}
"""Entry points of the modules imported so far, by their full names."""


@overload
def kernel(function: Function, /) -> Function: ...
@overload
def kernel(
    *,
    entry: bool = False,
    others: bool = False,
    inner: bool = False,
    inline: Inline = "never",
    bare: bool = False,
    apart: bool = False,
    patience: float = 0.0,
    whole: bool = False,
) -> Callable[[Function], Function]: ...
def kernel(
    function: Callable[..., Any] | None = None,
    /,
    *,
    entry: bool = False,
    others: bool = False,
    inner: bool = False,
    inline: Inline = "never",
    bare: bool = False,
    apart: bool = False,
    patience: float = 0.0,
    whole: bool = False,
) -> Any:
    """Compile a function with numba when it is first called, and keep the machine code on disk.

    It gives up the interpreter's lock while it runs, and divides by zero as NumPy does. With
    NUMBA_DISABLE_JIT=1 the function stays what it is.

    Parameters
    ----------
    function
        What to compile, of a module `_kernel*`.
    entry
        Python calls it: there is one version of it, for the types in its annotations (see
        `aeroflutter.kernels.arrays`), to which numba converts what it is called with, or raises
        TypeError; `aeroflutter warmup` compiles it. Otherwise there is a version for each
        combination of types with which it is called, literals included.
    others
        The types in the annotations of an entry point are the common ones, and other ones get
        versions of their own.
    inner
        It is for other kernels: it becomes part of their machine code and has none of its own,
        which spares a third of the compiling. To Python it stays the function it is.
    inline
        "always" has numba copy the function into its callers before it compiles them.
    bare
        It makes no arrays, nor does what it calls: numba then spares it the counting of references,
        which takes longer than a short function works.
    apart
        Of an entry point: other kernels call its machine code, instead of taking it into their own.
    patience
        Of an entry point that does not repay compiling at once: see `Patient`.
    whole
        Of an entry point that calls others for a microsecond at a time, with many arguments: they
        are made part of it. What has loops of its own to be made fast of is better off apart.

    Returns
    -------
    numba's dispatcher, an `Apart`, a `Patient`, or a decorator where `function` is not given

    Raises
    ------
    ValueError
        If the function's module is none whose source the cache's key covers.
    """

    def decorate(decorated: Callable[..., Any]) -> Any:
        dispatcher = _dispatcher(decorated, inner=inner, inline=inline, bare=bare, whole=whole)
        if entry and dispatcher is not decorated:
            ENTRIES[f"{decorated.__module__}.{decorated.__qualname__}"] = dispatcher
            if not others:
                _bind(dispatcher)
            if apart:
                return _called_apart(dispatcher)
            return Patient(dispatcher, patience) if patience else dispatcher
        return dispatcher

    return decorate if function is None else decorate(function)


class Patient:
    """A kernel that runs uncompiled until it has taken, over all processes, what compiling would.

    What calls compiled kernels for the heavy work and decides between the calls is quick enough as
    plain Python for a few motions. Where its machine code is on the disk, that is used at once;
    where it is not, the time that it has taken so far is there, noted as a process ends.
    Both give the same numbers: neither contracts or reorders what is written.

    Parameters
    ----------
    dispatcher
        numba's.
    patience
        Seconds of the processor that it may take uncompiled, without the compiling of others.
    """

    def __init__(self, dispatcher: Any, patience: float) -> None:
        self.dispatcher = dispatcher
        self.patience = patience
        self.py_func = dispatcher.py_func
        self._left: float | None = None

    def __call__(self, *arguments: Any) -> Any:
        """Call it."""
        if self._left is None:
            cache = self.dispatcher._cache
            ready = self.dispatcher.signatures or cache.kept()
            self._left = 0.0 if ready else self.patience - cache.spent()
            atexit.register(lambda: cache.spend(self.patience - max(self._left or 0.0, 0.0)))
        if self._left <= 0.0 or _work:
            return self.dispatcher(*arguments)
        import numpy as np

        begun, compiled = thread_time(), compiling_time()
        try:
            with np.errstate(all="ignore"):
                return self.py_func(*arguments)
        finally:
            self._left -= thread_time() - begun - (compiling_time() - compiled)


def _dispatcher(
    function: Callable[..., Any], *, inner: bool, inline: Inline, bare: bool, whole: bool
) -> Any:
    from numba import njit
    from numba.core import config
    from numba.extending import register_jitable

    from aeroflutter.kernels.libraries import DraftCompiler, EntryCompiler, WholeCompiler
    from aeroflutter.kernels.notice import listen
    from aeroflutter.kernels.store import KernelCache, is_kernel_module

    if not is_kernel_module(function.__module__):
        raise ValueError(
            f"{function.__module__}.{function.__qualname__}: a kernel belongs in a file named "
            "_kernel*.py, since the cache on disk is keyed by those"
        )
    if getattr(config, "DISABLE_JIT", False):
        return function
    listen()
    options: dict[str, Any] = {
        "error_model": "numpy",
        "inline": inline,
        "no_cfunc_wrapper": True,
    }
    if bare:
        options["_nrt"] = False
    if inner:
        return register_jitable(pipeline_class=DraftCompiler, **options)(function)
    compiler = WholeCompiler if whole else EntryCompiler
    dispatcher: Any = njit(nogil=True, pipeline_class=compiler, **options)(function)
    dispatcher._cache = KernelCache(function)
    return dispatcher


def _called_apart(dispatcher: Any) -> Any:
    from aeroflutter.kernels.arrays import argument_types
    from aeroflutter.kernels.libraries import Apart

    return Apart(dispatcher, lambda: argument_types(dispatcher.py_func))


def _bind(dispatcher: Any) -> None:
    """Compile for the annotated types alone, whatever the types of the first call.

    numba's own way compiles at once, and so while the module is imported. After the first call it
    sees to the conversion of arguments by itself.
    """
    compile_for = dispatcher.compile
    alone = threading.Lock()

    def compile_bound(signature: Any) -> Any:
        from aeroflutter.kernels.arrays import argument_types

        bound = argument_types(dispatcher.py_func)
        with alone:  # threads come here together, and only the first may compile
            if not dispatcher.overloads:
                compile_for(bound)
                dispatcher.disable_compile()
                dispatcher.compile = compile_for
        _check(dispatcher, signature, bound)
        (made,) = dispatcher.overloads.values()
        return made.entry_point

    dispatcher.compile = compile_bound


def _check(dispatcher: Any, signature: Any, bound: tuple[Any, ...]) -> None:
    from numba.core import sigutils

    given, _ = sigutils.normalize_signature(signature)
    convertible = dispatcher.typingctx.can_convert
    for name, found, wanted in zip(
        dispatcher.py_func.__code__.co_varnames, given, bound, strict=False
    ):
        if convertible(found, wanted) is None:
            raise TypeError(f"{dispatcher.py_func.__qualname__}({name}): {found} is no {wanted}")
