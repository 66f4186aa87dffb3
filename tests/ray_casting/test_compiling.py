"""Compiled code: references to named tuples, and how many kernels there are."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest

from texvol import Scene, TransferFunction, Volume, raycast
from texvol.ray_casting.common.bernstein import mix
from texvol.ray_casting.common.compiling import compiled, compiled_and_cached
from texvol.ray_casting.common.references import referenced, references
from texvol.ray_casting.plain.tracer import trace_rays
from texvol.ray_casting.projection.tracer import project_rays


class Inner(NamedTuple):
    factor: float
    rows: Any


class Outer(NamedTuple):
    shown: bool
    inner: Inner


@compiled
def _scaled(outer, row):
    return outer.inner.factor * outer.inner.rows[row].sum() if outer.shown else 0.0


@compiled
def _double(outer):
    return Outer(outer.shown, Inner(2 * outer.inner.factor, outer.inner.rows))


@compiled_and_cached
def _by_reference(outer, count):
    one = referenced(outer)
    several = references(_double(outer), count)
    for k in range(count):
        several[k] = outer if k % 2 == 0 else _double(outer)
    total = 0.0
    for k in range(count):
        total += _scaled(several[k], 1)
    return _scaled(one, 0), total


def test_a_reference_has_the_fields_of_its_tuple() -> None:
    outer = Outer(True, Inner(3.0, np.array([[1.0, 2], [4, 5]])))
    assert _by_reference(outer, 3) == (9.0, 27.0 + 54.0 + 27.0)
    assert _by_reference(outer._replace(shown=False), 1) == (0.0, 0.0)


def test_python_may_call_a_function_of_compiled_code() -> None:
    assert mix(1.0, 3.0, 0.5) == 2.0


@pytest.mark.parametrize(("mode", "kernel"), [("composite", trace_rays), ("mip", project_rays)])
def test_one_kernel_serves_all_types_of_values(mode, kernel) -> None:
    values = np.random.default_rng(1).integers(0, 100, (4, 4, 4))

    def picture(kind: str) -> np.ndarray:
        scene = Scene(Volume(values.astype(kind)), TransferFunction([0, 99], [(1, 0, 0), (0, 1, 0)], [0, 1]))
        return raycast(replace(scene, mode=mode), (5, 5))

    expected = picture("float64")
    kernels = len(getattr(kernel, "signatures", ()))
    for kind in ("uint8", "int8", "uint16", "int16", "int32", "float16", "float32"):
        np.testing.assert_array_equal(picture(kind), expected)
    assert len(getattr(kernel, "signatures", ())) == kernels
