"""The compile recipes of the house: parts that are linked into an entry, and entries, which release the GIL.

Numba optimises every function and turns it into machine code as soon as it is typed, and again as part of each of
its callers. A part is only ever linked into an entry, so all of that is left to the entry; and both are compiled
without numba's passes for what the kernels do not use (closures, ``with``, object mode, inlining of its IR).
"""

from __future__ import annotations

import gc
from typing import Any

from llvmlite import ir
from numba import njit
from numba._dynfunc import make_function
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.lowering import Lower
from numba.core.typed_passes import (
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.types import unliteral
from numba.core.types.functions import BaseFunction
from numba.core.untyped_passes import (
    FixupArgs,
    GenericRewrites,
    IRProcessing,
    ReconstructSSA,
    TranslateByteCode,
)

# Contracting and reordering of sums is allowed; NaN and infinity keep their meaning (they end a run in a sentence).
_MATH = {"contract", "reassoc", "nsz", "arcp"}


class _Typing:
    """A typing context in which literal arguments count as plain integers: a part is not compiled anew for each."""

    def __init__(self, context: Any) -> None:
        self._context = context

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def resolve_function_type(self, function: Any, args: Any, kws: Any) -> Any:
        return self._context.resolve_function_type(function, tuple(unliteral(argument) for argument in args), kws)


_resolve = BaseFunction.get_call_type
_resolved: dict[Any, Any] = {}


def _remember(function: Any, context: Any, args: Any, kws: Any) -> Any:
    """Signature of an operator or function, found once for the same types of arguments.

    Numba looks for it in typing and in code generation, each time among all overloads.
    """
    if kws:
        return _resolve(function, context, args, kws)
    key = (function, tuple(args))
    if key not in _resolved:
        _resolved[key] = _resolve(function, context, args, kws)
    return _resolved[key]


class _PartLibrary(JITCodeLibrary):
    """Code that is only linked into others: simplified, but neither optimised nor made machine code."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _PartLower(Lower):
    def setup_function(self, fndesc: Any) -> None:
        super().setup_function(fndesc)
        arguments = self.call_conv.get_arguments(self.function)
        for argument in arguments:
            if isinstance(argument.type, ir.PointerType) and isinstance(argument.type.pointee, ir.LiteralStructType):
                set.add(argument.attributes, "readonly")  # a reference; llvmlite does not list that attribute


class _RareLower(_PartLower):
    def setup_function(self, fndesc: Any) -> None:
        super().setup_function(fndesc)
        self.function.attributes.add("noinline")


@register_pass(mutates_CFG=True, analysis_only=False)
class _PartLowering(NativeLowering):
    """Numba's code generation into a part library."""

    _name = "tarsus_part_lowering"

    _lower: type = _PartLower

    @property
    def lowering_class(self) -> type:
        return self._lower

    def run_pass(self, state: Any) -> bool:
        name = state.func_id.func_qualname
        state.library = _PartLibrary(state.targetctx.codegen(), name)
        state.flags.no_compile = True
        super().run_pass(state)
        lowered = state["cr"]
        # stands for the part among the overloads of a function; a part has no address to be called at
        handle = make_function(lowered.fndesc.lookup_module(), name, "a part", 0, lowered.env, (state.library,))
        state.targetctx.insert_user_function(handle, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=handle)
        return True


@register_pass(mutates_CFG=True, analysis_only=False)
class _RareLowering(_PartLowering):
    _name = "tarsus_rare_lowering"
    _lower = _RareLower


class _EntryCompiler(CompilerBase):
    _lowering: type = NativeLowering

    def __init__(self, typingctx: Any, *args: Any) -> None:
        super().__init__(typingctx, *args)
        self.state.typingctx = _Typing(typingctx)
        self.state.flags.noalias = True

    def compile_extra(self, func: Any) -> Any:
        collecting = gc.isenabled()
        gc.disable()  # the millions of small objects made here all live until the end
        usual, BaseFunction.get_call_type = BaseFunction.get_call_type, _remember
        try:
            return super().compile_extra(func)
        finally:
            BaseFunction.get_call_type = usual
            if collecting:
                gc.enable()

    def define_pipelines(self) -> list[PassManager]:
        manager = PassManager("tarsus")
        for step in (
            TranslateByteCode, FixupArgs, IRProcessing, GenericRewrites, ReconstructSSA, NopythonTypeInference,
            PreLowerStripPhis, IRLegalization, self._lowering, NoPythonBackend,
        ):  # fmt: skip
            manager.add_pass(step, step.__name__)
        manager.finalize()
        return [manager]


class _PartCompiler(_EntryCompiler):
    _lowering = _PartLowering


class _RareCompiler(_EntryCompiler):
    _lowering = _RareLowering


# No two array arguments of a kernel function may share memory that it writes (see ``noalias`` above).
PART: dict[str, Any] = {
    "fastmath": _MATH, "error_model": "numpy", "_nrt": False, "no_cpython_wrapper": True, "no_cfunc_wrapper": True,
    "pipeline_class": _PartCompiler,
}  # fmt: skip

# Called now and then (at events): LLVM decides whether to inline it.
inner = njit(**PART, forceinline=False)
# At few events, or where a step is out of the ordinary: made once and called.
rare = njit(**{**PART, "forceinline": False, "pipeline_class": _RareCompiler})
# On the path of every step: melted into its caller, so that no argument is copied.
fused = njit(forceinline=True, **PART)


def entry(function):
    """Compile an entry point: cached on disk, without the GIL. The cache notices a changed closure."""
    return njit(
        fastmath=_MATH, cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True,
        pipeline_class=_EntryCompiler,
    )(function)  # fmt: skip
