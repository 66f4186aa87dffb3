"""Compilation by numba, which is imported here, in `references` and in `lanes` only."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from texvol.util.errors import missing_extra

try:
    from numba import config, njit, types
    from numba.core.registry import CPUDispatcher
    from numba.extending import intrinsic
except ImportError as error:
    raise missing_extra("numba", "oracle", "texvol raycast") from error


ZERO = np.int64(0)  # for the literal 0, a function would be compiled a second time
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
# numba makes two more functions of each: one that Python calls, and one that C calls. With them, a small function takes
# twice as long to compile.
_NOT_FOR_PYTHON: dict[str, Any] = {"no_cpython_wrapper": True}
_NOT_FOR_C: dict[str, Any] = {"no_cfunc_wrapper": True}


class _Part(CPUDispatcher):
    """A function that compiled code calls. Python, as in a test, calls a function that is compiled for that."""

    @cached_property
    def _for_python(self):
        return njit(**_OPTIONS)(self.py_func)

    def __call__(self, *arguments):
        return self._for_python(*arguments)


def compiled(function: Callable[..., Any]) -> Any:
    """Compile `function` on its first call from compiled code; 1 / 0 is infinite, as in numpy."""
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return function
    return _Part(function, targetoptions={"nopython": True} | _OPTIONS | _NOT_FOR_PYTHON | _NOT_FOR_C)


def inlined(function: Callable[..., Any]) -> Any:
    """Compile `function` into its callers in LLVM: for functions of a few nanoseconds, in each cell or node."""
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        return function
    options = {"nopython": True, "forceinline": True} | _OPTIONS | _NOT_FOR_PYTHON | _NOT_FOR_C
    return _Part(function, targetoptions=options)


def woven_in(function: Callable[..., Any]) -> Any:
    """Compile `function` into its callers before LLVM, which would otherwise optimise it once for each caller."""
    return njit(inline="always", **_OPTIONS)(function)


def compiled_and_cached(function: Callable[..., Any]) -> Any:
    """Compile `function` for calls from Python; the result is cached on disk where a cache folder is writable.

    numba keeps one cache entry for each set of values that `function` closes over, and by itself watches only the file
    of `function`. So `function` must close over `sources()`, which names the text of all files.
    """
    try:
        return njit(cache=True, **_OPTIONS, **_NOT_FOR_C)(function)
    except RuntimeError:  # neither this package's folder nor the user's cache folder is writable
        return compiled(function)


def sources() -> str:
    """Return a hash of all files of `ray_casting`; compiled code cached under another hash is out of date."""
    folder = Path(__file__).parents[1]
    texts = (path.read_bytes() for path in sorted(folder.rglob("*.py")))
    return hashlib.sha256(b"".join(texts)).hexdigest()


@intrinsic
def uncounted(typing_context, data):
    """Return an argument of the compiled function, an array or a tuple, without reference counts.

    The caller of the function holds on to the arrays; an array that the function allocates itself could be freed too
    early. Counting is atomic: with a hundred small functions that pass arrays on, two threads would mostly wait for
    each other.
    """

    def code(context, builder, signature, arguments):
        return without_counts(context, builder, signature.args[0], arguments[0])

    return data(data), code


def without_counts(context, builder, kind, value):
    """Return an array, or a tuple, without reference counts, as code of LLVM."""
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value=value)
        array.meminfo = array.meminfo.type(None)  # numba takes this for memory that it does not own
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        for position, part in enumerate(kind):
            inner = without_counts(context, builder, part, builder.extract_value(value, position))
            value = builder.insert_value(value, inner, position)
    return value


def same(data):
    """Return the argument itself."""
    return data


if config.DISABLE_JIT:  # type: ignore[attr-defined]  # plain Python, as for debugging, has its own counts
    uncounted = same  # type: ignore[assignment]
