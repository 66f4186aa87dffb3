"""Which values may show anything, by table: all that do, and hardly any more."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Graded
from texvol.scene.volume import Volume
from texvol.textures import visible_values
from texvol.textures.visible_values import visible


def medium(points: list[tuple[float, float]], **further: object) -> TransferFunction:
    values, extinctions = np.array(points).T
    return TransferFunction(values, np.zeros((len(points), 3)), extinctions, **further)


MEDIA = {
    "ramp": medium([(0.3, 0), (0.8, 1)]),
    "step": medium([(0.5, 0), (0.5, 1)]),
    "hat": medium([(0.4, 0), (0.5, 1), (0.6, 0)]),
    "thin hat": medium([(0.5, 0), (0.50001, 1), (0.50002, 0)]),
    "below": medium([(0.2, 1), (0.2, 0)]),
    "opaque": medium([(0.3, 0), (0.3, np.inf), (0.6, 0), (0.9, 0)]),
    "beyond the values": medium([(2.0, 0), (3.0, 1)]),
    "everything": medium([(0.0, 1)]),
    "nothing": medium([(0.0, 0)]),
    "graded": medium([(0, 0)], graded=(Graded([0.25, 0.75], np.zeros((2, 3)), [1, 1], 0.0, 1.0),)),
}
TYPES = [
    ("f4", 1.0, 0.0),
    ("f8", 1.0, 1e9),
    ("f8", 1e300, 0.0),
    ("f2", 1.0, 0.0),
    ("u1", 200.0, 0.0),
    ("i4", 1e6, -3e5),
]


def scaled(function: TransferFunction, factor: float, offset: float) -> TransferFunction:
    graded = [Graded(factor * g.values + offset, g.emissions, g.extinctions, g.start, g.full) for g in function.graded]
    values = factor * function.values + offset
    return TransferFunction(values, function.colors, function.extinctions, graded=tuple(graded))


@pytest.mark.parametrize("name", MEDIA)
@pytest.mark.parametrize("dtype, factor, offset", TYPES)
@pytest.mark.parametrize("further", ["", "infinite", "missing"])
def test_nothing_that_shows_is_left_out(name: str, dtype: str, factor: float, offset: float, further: str) -> None:
    random = np.random.default_rng(7)
    fractions = np.concatenate([random.random(2000), np.repeat([0.0, 0.2, 0.3, 0.4, 0.5, 0.6, 0.75, 1.0], 250)])
    values = (factor * fractions + offset).astype(dtype).reshape(10, 20, 20)
    if further and values.dtype.kind == "f":
        values[0, 0, :4] = (np.inf, -np.inf, np.inf, 0) if further == "infinite" else np.nan
    function = scaled(MEDIA[name], factor, offset)
    with np.errstate(invalid="ignore", over="ignore"):
        expected = function.shows_between(values, values)
    found = visible(Volume(values), function, values)
    assert not (expected & ~found).any()
    # What is between two of the visible parts of a bin, or as near to a step as rounding takes a value.
    assert (found & ~expected).mean() < 0.02


@pytest.mark.parametrize("value", [0.0, 0.7, np.nan, np.inf])
def test_a_volume_of_one_value_shows_it(value: float) -> None:
    volume = Volume(np.full((2, 2, 2), value, np.float32))
    found = visible(volume, MEDIA["ramp"], volume.values)
    assert found.all() == (value > 0.5)
    assert found.any() == (value > 0.5)


def test_a_table_is_made_once_and_goes_with_its_volume_or_matter() -> None:
    volume, function = Volume(np.linspace(0, 1, 8).reshape(2, 2, 2)), medium([(0.3, 0), (0.8, 1)])
    visible(volume, function, volume.values)
    table = visible_values._TABLES[function][volume]
    visible(volume, function, volume.values)
    assert visible_values._TABLES[function][volume] is table
    gone = weakref.ref(function), weakref.ref(volume)
    del function, volume
    gc.collect()
    assert [each() for each in gone] == [None, None]
