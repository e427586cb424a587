"""The decorator that every compiled function carries."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal, TypeVar, overload

__all__ = ["kernel"]

Function = TypeVar("Function", bound=Callable[..., Any])
Inline = Literal["never", "always"]
Signature = str | tuple[Any, ...] | Callable[[], tuple[Any, ...]]


@overload
def kernel(function: Function, /) -> Function: ...
@overload
def kernel(
    *, signature: Signature | None = None, inline: Inline = "never"
) -> Callable[[Function], Function]: ...
def kernel(
    function: Callable[..., Any] | None = None,
    /,
    *,
    signature: Signature | None = None,
    inline: Inline = "never",
) -> Any:
    """Compile a function with numba when it is first called, and keep the machine code on disk.

    It gives up the interpreter's lock while it runs, and divides by zero as NumPy does. With
    NUMBA_DISABLE_JIT=1 the function stays what it is.

    Parameters
    ----------
    function
        What to compile, of a module `_kernel*`.
    signature
        Types of the arguments, as in ``"f8(f8[::1], i8)"`` or ``"(f8[::1], i8)"``, a tuple of
        numba's types, or a function that makes one. With it there is one version of the function,
        whose arguments are converted, where numba can; without, there is one for each combination
        of types with which it is called, literals included.
    inline
        "always" has numba copy the function into its callers before it compiles them.

    Returns
    -------
    numba's dispatcher, or a decorator where `function` is not given

    Raises
    ------
    ValueError
        If the function's module is none whose source the cache's key covers.
    """
    if function is None:
        return lambda decorated: _compiled(decorated, signature, inline)
    return _compiled(function, signature, inline)


def _compiled(function: Callable[..., Any], signature: Signature | None, inline: Inline) -> Any:
    from numba import njit
    from numba.core import config

    from aeroflutter.kernels.store import KernelCache, is_kernel_module

    if not is_kernel_module(function.__module__):
        raise ValueError(
            f"{function.__module__}.{function.__qualname__}: a kernel belongs in a file named "
            "_kernel*.py, since the cache on disk is keyed by those"
        )
    if getattr(config, "DISABLE_JIT", False):
        return function
    dispatcher: Any = njit(nogil=True, error_model="numpy", inline=inline)(function)
    dispatcher._cache = KernelCache(function)
    if signature is not None:
        _bind(dispatcher, signature)
    return dispatcher


def _bind(dispatcher: Any, signature: Signature) -> None:
    """Let the dispatcher compile for one signature, whatever the types that it is called with.

    numba's own way compiles at once, and so while the module is imported.
    """
    compile_for = dispatcher.compile

    def compile_bound(_: Any) -> Any:
        return compile_for(signature() if callable(signature) else signature)

    dispatcher.compile = compile_bound
