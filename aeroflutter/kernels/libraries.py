"""How kernels become machine code, so that no part of it is made twice.

numba optimises every function that it meets, makes machine code of it, and takes it into its
callers, where it is optimised again: a function six calls deep, seven times. Here a function for
other kernels is a `Draft`, left as it was lowered until it stands in the entry point that needs it,
which is optimised whole; and what is `apart` is called by its address, as what it is.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import llvmlite.binding as llvm
from numba.core import cgutils, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.environment import lookup_environment
from numba.core.imputils import impl_ret_new_ref, lower_builtin
from numba.core.targetconfig import ConfigStack
from numba.core.typing.templates import AbstractTemplate, infer_global

__all__ = ["Apart", "DraftCompiler", "EntryCompiler", "WholeCompiler", "needs", "ready"]

PREFIX = "aeroflutter.apart."
ENVIRONMENT = "_ZN08NumbaEnv"  # with which numba's names of environments begin

_apart: dict[str, Apart] = {}


class _Entry(JITCodeLibrary):
    """The code of an entry point with all that it calls."""

    def _finalize_specific(self) -> None:
        super()._finalize_specific()
        for variable in self._final_module.global_variables:  # drafts have left that to it
            if variable.name.startswith(ENVIRONMENT):
                environment = lookup_environment(variable.name)
                if environment is not None:
                    codegen: Any = self._codegen
                    codegen.set_env(variable.name, environment)


class _Whole(_Entry):
    """The same where nobody else can call what it calls.

    So what is called once becomes part of its caller, and what is not used is not handed over: a
    system and a motion are three hundred numbers in the registers and on the stack.
    """

    def finalize(self) -> None:
        self._own = {one.name for one in self._final_module.functions if not one.is_declaration}
        super().finalize()

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.name not in self._own:
                function.linkage = "internal"
        super()._optimize_final_module()


class _Draft(JITCodeLibrary):
    """The code of a function for other kernels: neither optimised nor made machine code."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return 0

    @property
    def codegen(self) -> Any:
        return _Without(self._codegen)


class _Without:
    """What makes machine code, of which a draft asks nothing."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def set_env(self, name: str, environment: Any) -> None:
        """A draft is nowhere in memory."""

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)


class _Into(Compiler):
    """numba's compiler, with a library of one kind."""

    library_class: type[JITCodeLibrary]

    def define_pipelines(self) -> list[Any]:
        state = self.state
        if state.library is None:
            name = state.func_id.func_qualname if state.func_id else self.library_class.__name__
            state.library = self.library_class(state.targetctx.codegen(), name)
            state.library.enable_object_caching()
        return list(super().define_pipelines())


class EntryCompiler(_Into):
    """For what Python calls."""

    library_class = _Entry

    def define_pipelines(self) -> list[Any]:
        """As for drafts: what an entry calls itself is then what those call, made once."""
        flags: Any = ConfigStack.top_or_none()  # a copy, for what is called
        flags.no_cpython_wrapper, flags.release_gil = True, False
        return super().define_pipelines()


class WholeCompiler(EntryCompiler):
    """For what Python calls and is one function with what it calls."""

    library_class = _Whole


class DraftCompiler(_Into):
    """For what only other kernels call."""

    library_class = _Draft


class Apart:
    """An entry point that other kernels call by its address.

    Parameters
    ----------
    dispatcher
        numba's, bound to one signature.
    signature
        Gives the types of its arguments.
    """

    def __init__(self, dispatcher: Any, signature: Callable[[], tuple[Any, ...]]) -> None:
        self.dispatcher = dispatcher
        self.py_func = dispatcher.py_func
        self._signature = signature
        self._name = f"{PREFIX}{self.py_func.__module__}.{self.py_func.__qualname__}"
        _apart[self._name] = self
        self._let_kernels_call()

    def __call__(self, *arguments: Any) -> Any:
        """Call it."""
        return self.dispatcher(*arguments)

    def compiled(self) -> Any:
        """numba's result, made or loaded if need be; its address is then known to the linker."""
        signature = self._signature()
        if not self.dispatcher.overloads:
            self.dispatcher.compile(signature)
        (made,) = self.dispatcher.overloads.values()
        address = made.library.get_pointer_to_function(made.fndesc.llvm_func_name)
        assert address, self._name
        llvm.add_symbol(self._name, address)
        return made

    def _let_kernels_call(self) -> None:
        handle, name = self, self._name

        class Template(AbstractTemplate):
            key = handle

            def generic(self, args: Any, kws: Any) -> Any:
                made = handle.compiled().signature
                fits = not kws and len(args) == len(made.args)
                return made if fits else None

        infer_global(handle, types.Function(Template))

        @lower_builtin(handle, types.VarArg(types.Any))
        def call(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            convention, returned = context.call_conv, signature.return_type
            kind = convention.get_function_type(returned, signature.args)
            function = cgutils.get_or_insert_function(builder.module, kind, name)
            status, result = convention.call_function(
                builder, function, returned, signature.args, arguments
            )
            with cgutils.if_unlikely(builder, status.is_error):
                convention.return_status_propagate(builder, status)
            return impl_ret_new_ref(context, builder, returned, result)


def needs(library: Any) -> tuple[str, ...]:
    """Names of what a finished library calls by its address."""
    functions = library._final_module.functions
    return tuple(sorted(f.name for f in functions if f.name.startswith(PREFIX)))


def ready(names: tuple[str, ...]) -> bool:
    """Whether all of these can be called, which is seen to."""
    for name in names:
        if name not in _apart:
            return False
        _apart[name].compiled()
    return True
