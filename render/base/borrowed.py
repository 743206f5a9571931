"""Arrays whose references kernels do not count.

A kernel counts a reference wherever it passes an array on, by an atomic addition, and of a tuple of arrays one each:
a fifth of the time of the ambient light. What the caller holds anyway for as long as a kernel runs needs no count.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic
from numba.np.arrayobj import make_array

__all__ = ["borrowed"]


@intrinsic
def borrowed(typing_context: Any, arrays: Any) -> Any:
    """The same array, or tuple of these and of numbers, without an owner: valid as long as the given one is held."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return _without_owner(context, builder, signature.args[0], arguments[0])

    return arrays(arrays), generate


def _without_owner(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    if isinstance(kind, types.Array):
        array = make_array(kind)(context, builder, value)
        # counting skips what has no record of its memory
        array.meminfo = ir.Constant(array.meminfo.type, None)
        array.parent = ir.Constant(array.parent.type, None)
        return array._getvalue()
    if isinstance(kind, types.containers.BaseTuple):
        parts = cgutils.unpack_tuple(builder, value)
        kept = [_without_owner(context, builder, one, part) for one, part in zip(kind, parts, strict=True)]
        return context.make_tuple(builder, kind, kept)
    return value
