"""What only kernels call is compiled without what Python, C and the disk would want of it.

Numba gives every function that a kernel calls an entry from Python and one from C, machine code of its own and a file
in the cache, though all that a caller takes is its optimised intermediate code: a third of the time of a first start.
Here these are made once Python calls such a function itself. The code of a kernel is the same either way.
"""

from __future__ import annotations

import itertools
import os
import secrets
from typing import Any

import llvmlite.binding as llvm
import numba
from numba.core import bytecode, compiler, errors, event, sigutils, types, typing
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher, _FunctionCompiler  # type: ignore[attr-defined]

from render.base.sealed_cache import ROOM_PATHS, KernelCache

SOURCES = (*ROOM_PATHS, os.path.join(os.path.dirname(numba.__file__), ""))
"""Whose functions are compiled so: ours, and numba's own that they call."""
HANDED_DOWN = ("error_model", "fastmath", "forceinline", "nrt")
"""Options that what a function calls inherits, where it does not say otherwise."""
NARROW = frozenset((types.int8, types.int16, types.int32))

# names of functions in intermediate code end in these numbers: what other processes hand over has none of ours
bytecode.FunctionIdentity._unique_ids = itertools.count(secrets.randbits(40))


class KernelFlags(compiler.Flags):
    """Options of a function, equal where those are that numba's own functions inherit: their code is shared.

    Numba compares every option, and by its property, a million times.
    """

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, KernelFlags) and self._handed_down() == other._handed_down()

    def __hash__(self) -> int:
        return hash((self.error_model, self.forceinline, self.nrt))

    def _handed_down(self) -> list[Any]:
        return [getattr(self, name) for name in HANDED_DOWN]


class KernelLibrary(JITCodeLibrary):
    """The code of what Python calls."""

    def _optimize_functions(self, module: Any) -> None:
        """All at once, when they are linked: numba optimises each function by itself before."""
        module.data_layout = self._codegen._data_layout


class CalleeLibrary(KernelLibrary):
    """Intermediate code that others link: optimised, never made machine code."""

    @classmethod
    def of_bitcode(cls, codegen: Any, name: str, bitcode: bytes) -> CalleeLibrary:
        library = cls(codegen, name)
        library._final_module = llvm.parse_bitcode(bitcode)
        library._finalize_final_module()
        return library

    def _optimize_functions(self, module: Any) -> None:
        """As numba does; what is linked in before that is optimised with what links it."""
        module.data_layout = self._codegen._data_layout
        for function in module.functions:
            if not function.is_declaration:
                manager, builder = self._codegen._function_pass_manager()
                manager.run(function, builder)

    def _optimize_final_module(self) -> None:
        """By the cheap passes alone, which take in what is always inlined: a kernel optimises all that it calls."""
        codegen = self._codegen
        manager, builder = codegen._module_pass_manager(
            loop_vectorize=codegen._loopvect, slp_vectorize=False, opt=codegen._opt_level, cost="cheap"
        )
        manager.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class NoEntry:
    """Stands where a function has its entry from Python; callers find the intermediate code by it."""


class KernelCompiler(_FunctionCompiler):
    """Compiles what Python calls."""

    def _compile_core(self, args: Any, return_type: Any) -> Any:
        library = KernelLibrary(self.targetdescr.target_context.codegen(), self.py_func.__qualname__)
        library.enable_object_caching()
        made = self._compile_into(library, self._flags(), args, return_type)
        # of what is linked in as well, which has no machine code to set them in
        for environment in made._find_referenced_environments():
            library.codegen.set_env(environment.env_name, environment)
        return made

    def _flags(self) -> KernelFlags:
        flags = KernelFlags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        return flags

    def _compile_into(self, library: KernelLibrary, flags: KernelFlags, args: Any, return_type: Any) -> Any:
        return compiler.compile_extra(
            self.targetdescr.typing_context,
            self.targetdescr.target_context,
            self.py_func,
            args=args,
            return_type=return_type,
            flags=flags,
            locals=self.locals,
            library=library,
            pipeline_class=self.pipeline_class,
        )


class CalleeCompiler(KernelCompiler):
    """Compiles what kernels call, and nothing else yet."""

    def _compile_core(self, args: Any, return_type: Any) -> Any:
        flags, context = self._flags(), self.targetdescr.target_context
        flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        library = CalleeLibrary(context.codegen(), self.py_func.__qualname__)
        return self.without_entry(self._compile_into(library, flags, args, return_type))

    def without_entry(self, made: Any) -> Any:
        entry = NoEntry()
        self.targetdescr.target_context.insert_user_function(entry, made.fndesc, [made.library])
        return made._replace(entry_point=entry)

    def parts(self, made: Any) -> tuple[Any, ...]:
        """What `of_parts` makes the same of in another process."""
        made.fndesc.typemap = made.fndesc.calltypes = None  # as numba does: they need not be picklable
        made.library._ensure_finalized()
        bitcode = made.library._final_module.as_bitcode()
        environments = tuple(made._find_referenced_environments())
        return made.library.name, bitcode, made.fndesc, made.environment, made.signature, environments

    def of_parts(self, name: str, bitcode: bytes, fndesc: Any, environment: Any, signature: Any, others: Any) -> Any:
        context = self.targetdescr.target_context
        library = CalleeLibrary.of_bitcode(context.codegen(), name, bitcode)
        made = compiler.compile_result(
            typing_context=self.targetdescr.typing_context,
            target_context=context,
            entry_point=None,
            library=library,
            fndesc=fndesc,
            environment=environment,
            signature=signature,
            objectmode=False,
            lifted=(),
            reload_init=[],
            referenced_envs=others,
        )
        return self.without_entry(made)


class KernelDispatcher(Dispatcher):
    """A function with all that it was compiled for.

    Functions of other sources are left to numba, and those that call themselves, by an address that they must have.
    """

    _cache: Any
    _callee_compiler: Any
    _can_compile: bool
    _compiler: Any
    targetdescr: Any

    def __init__(
        self, py_func: Any, locals: Any = None, targetoptions: Any = None, pipeline_class: Any = compiler.Compiler
    ) -> None:
        super().__init__(py_func, locals, targetoptions, pipeline_class)
        self._callee_compiler, code = None, py_func.__code__
        if os.path.abspath(code.co_filename).startswith(SOURCES) and code.co_name not in code.co_names:
            made_of = py_func, self.targetdescr, self.targetoptions, self.locals, pipeline_class
            self._compiler, self._callee_compiler = KernelCompiler(*made_of), CalleeCompiler(*made_of)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """A kernel that is compiled calls this function: as numba's own, with less to compile."""
        if self._callee_compiler is None:
            return super().get_call_template(args, kws)
        signature, args = self._compiler.fold_argument_types(args, kws)
        wide = tuple(map(_widened, args))
        with global_compiler_lock:
            if self._can_compile and wide not in self.overloads:
                try:
                    self._compile_callee(wide)
                except errors.ForceLiteralArg:  # it indexes a tuple by an argument, or the like
                    wide = args
                    if wide not in self.overloads:
                        self._compile_callee(wide)
        args, name = wide, self.py_func.__name__
        signatures = [self.overloads[args].signature] if args in self.overloads else self.nopython_signatures
        template = typing.make_concrete_template(f"CallTemplate({name})", key=name, signatures=signatures)
        return template, signature, args, {}

    def compile(self, sig: Any) -> Any:
        """Python calls this function: all of it is needed now."""
        args = tuple(sigutils.normalize_signature(sig)[0])
        with global_compiler_lock:
            if args in self.overloads and isinstance(self.overloads[args].entry_point, NoEntry):
                del self.overloads[args]
            return super().compile(sig)

    def get_compile_result(self, sig: Any) -> Any:
        """A kernel hands this function on, as a pointer: all of it is needed now."""
        args = tuple(sig.args)
        if args in self.overloads and isinstance(self.overloads[args].entry_point, NoEntry):
            self.compile(args)
        return super().get_compile_result(sig)

    def _compile_callee(self, args: Any) -> None:
        made = self._cache.load_overload(args, self.targetctx)
        if made is not None:  # Python has called it
            self.targetctx.insert_user_function(made.entry_point, made.fndesc, [made.library])
            self.add_overload(made)
            return
        codegen, maker = self.targetctx.codegen(), self._callee_compiler
        parts = self._cache.handed_over(args, codegen) if isinstance(self._cache, KernelCache) else None
        if parts is not None:
            self.overloads[args] = maker.of_parts(*parts)
            return
        details = {"dispatcher": self, "args": args, "return_type": None}
        with self._compiling_counter, event.trigger_event("numba:compile", data=details):
            try:
                made = self.overloads[args] = maker.compile(args, None)
            except errors.ForceLiteralArg as wanted:
                raise wanted.bind_fold_arguments(lambda a, k: self.fold_argument_types(a, k)[1]) from wanted
        if isinstance(self._cache, KernelCache) and not made.reload_init:
            self._cache.hand_over(args, codegen, maker.parts(made))


def _widened(kind: Any) -> Any:
    """The type as which an argument is handed to a function: one for all numbers known beforehand, and for all signed
    ones, with which numba computes alike."""
    kind = kind.literal_type if isinstance(kind, (types.IntegerLiteral, types.BooleanLiteral)) else kind
    return types.int64 if kind in NARROW else kind
