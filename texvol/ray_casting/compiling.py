"""Functions compiled by numba; the only module that imports it."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from texvol.util.errors import missing_extra

try:
    from numba import njit, types
    from numba.extending import intrinsic
except ImportError as error:
    raise missing_extra("numba", "oracle", "texvol raycast") from error


def compiled(function: Callable[..., Any]) -> Any:
    """`function` compiled when something compiled calls it; as numpy does, 1 / 0 is infinite."""
    return njit(nogil=True, error_model="numpy")(function)


def inlined(function: Callable[..., Any]) -> Any:
    """The same, put into whatever calls it: one that is handed a whole scene would spend its time copying that."""
    return njit(nogil=True, error_model="numpy", forceinline=True)(function)


def woven_in(function: Callable[..., Any]) -> Any:
    """The same, before anything is compiled: LLVM would go over a function once for each that is around it."""
    return njit(nogil=True, error_model="numpy", inline="always")(function)


def compiled_and_kept(function: Callable[..., Any]) -> Any:
    """The same, callable from Python, and kept on disk where some folder for that can be written."""
    try:
        return njit(nogil=True, error_model="numpy", cache=True)(function)
    except RuntimeError:  # neither this package's folder nor the user's own can be written
        return compiled(function)


@intrinsic
def uncounted(typing_context, data):
    """The same array, or tuple of arrays and whatever else, without counts of references: the caller holds on to them.

    Counting is atomic: where a hundred small functions pass arrays on, two threads would mostly wait for each other.
    """

    def code(context, builder, signature, arguments):
        return _without_counts(context, builder, signature.args[0], arguments[0])

    return data(data), code


def _without_counts(context, builder, kind, value):
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value=value)
        array.meminfo = array.meminfo.type(None)  # what numba takes for memory that is not its own
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        for position, part in enumerate(kind):
            inner = _without_counts(context, builder, part, builder.extract_value(value, position))
            value = builder.insert_value(value, inner, position)
    return value


def sources() -> str:
    """A name for the present text of this package: what is kept on disk under another name is out of date."""
    texts = (path.read_bytes() for path in sorted(Path(__file__).parent.glob("*.py")))
    return hashlib.sha256(b"".join(texts)).hexdigest()
