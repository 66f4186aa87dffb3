"""Values far from all others are found at both ends, in any number of samples, and ordinary data have none."""

from __future__ import annotations

import time

import numpy as np
import pytest
from support.small_fields import wave

from texvol.scene.lone_extremes import lone_extremes
from texvol.scene.volume import Volume

INT_ENDS = [("i2", -32768), ("i4", -(2**31)), ("i4", 2**31 - 1), ("u4", 2**32 - 1), ("i8", -(2**63))]
FLOAT_ENDS = [
    ("f8", 1e8), ("f8", -9999.0), ("f4", -3.4028235e38), ("f4", 9.96921e36), ("f4", 1e20), ("f2", 65504.0),
    ("f8", 1.7976931348623157e308), ("f8", -1.7976931348623157e308),
]  # fmt: skip


@pytest.mark.parametrize("dtype, value", INT_ENDS + FLOAT_ENDS)
@pytest.mark.parametrize("fraction", [0.0, 0.7])
def test_a_value_far_from_the_others_is_named(dtype: str, value: float, fraction: float) -> None:
    values = wave(16, dtype)
    where = np.random.default_rng(1).random(values.shape) < fraction
    where[3, 4, 5] = True
    values[where] = value
    (found,) = lone_extremes(Volume(values))
    assert np.dtype(dtype).type(found.value) == np.dtype(dtype).type(value)
    assert values.dtype.type(found.text) == values[3, 4, 5]
    assert found.samples == where.sum()
    assert found.others == (values[~where].min(), values[~where].max())
    assert found.times > 10


def test_values_at_both_ends_and_several_of_one_end_are_named() -> None:
    values = wave(16, "f4")
    values[0, 0, :3] = -9999, -9998, 1e20
    assert [each.value for each in lone_extremes(Volume(values))] == [-9999, -9998, np.float32(1e20)]
    values[1] = np.nan
    values[2, 0, 0] = np.inf
    assert [each.value for each in lone_extremes(Volume(values))] == [-9999, -9998, np.float32(1e20)]


def test_the_threshold_lies_at_ten_times_the_range_of_the_others() -> None:
    values = wave(16, "f8")
    values[0, 0, 0], values[0, 0, 1] = 0, 1
    for value, count in ((10.9, 0), (11.1, 1), (-9.9, 0), (-10.1, 1)):
        values[5, 5, 5] = value
        assert len(lone_extremes(Volume(values))) == count


@pytest.mark.parametrize(
    ("dtype", "mark", "times"),
    [("f4", -9999, 2.5), ("f8", -999, 1.5), ("i2", -32768, 3), ("u2", 65535, 5), ("f4", 1e20, 1e3), ("i4", -9999, 2)],
)
def test_values_that_programs_mark_missing_samples_by_are_known(dtype: str, mark: float, times: float) -> None:
    values = (wave(16, "f8") * abs(mark) / (times + 1)).astype(dtype)
    values[3, 4, 5] = mark
    assert [each.samples for each in lone_extremes(Volume(values))] == [1]
    values[3, 4, 5] = mark * 0.97  # no such value
    assert (len(lone_extremes(Volume(values))) == 1) == (times > 100)


def test_saturated_bytes_are_values() -> None:
    values = wave(16, "u1") // 2
    values[3, 4, 5] = 255
    assert lone_extremes(Volume(values)) == ()


def test_a_few_distinct_values_are_no_reason_to_find_more() -> None:
    values = np.array([24, 25, 62, 99, 100, 137, 174, 175] * 8).reshape(4, 4, 4)
    assert lone_extremes(Volume(values)) == ()
    values[1, 2, 3] = -(2**63)
    assert [each.value for each in lone_extremes(Volume(values))] == [-(2**63)]


@pytest.mark.parametrize(
    "values",
    [
        wave(16, "f4"),
        wave(16, "u1"),
        np.zeros((4, 4, 4)),
        np.full((4, 4, 4), np.nan),
        np.arange(64.0).reshape(4, 4, 4) == 7,  # a mask
        np.where(np.arange(64).reshape(4, 4, 4) > 30, 30000, 0),
        10.0 ** np.linspace(-20, 20, 4096).reshape(16, 16, 16),
        np.random.default_rng(0).standard_cauchy((32, 32, 32)).astype("f4"),
    ],
)
def test_ordinary_values_have_none(values: np.ndarray) -> None:
    assert lone_extremes(Volume(values)) == ()


def test_labels_and_colours_have_none() -> None:
    labels = np.random.default_rng(0).integers(0, 5, (8, 8, 8))
    labels[0, 0, 0] = 10000
    assert len(lone_extremes(Volume(labels))) == 1
    assert lone_extremes(Volume(labels, labels=True)) == ()
    amounts = labels / 10000
    assert lone_extremes(Volume(amounts, colors=np.zeros((8, 8, 8, 3)))) == ()


def test_ordinary_volumes_cost_little() -> None:
    volume = Volume(np.random.default_rng(0).random((128, 256, 256), np.float32))
    assert volume.value_range is not None  # is known of most volumes
    start = time.process_time()
    assert lone_extremes(volume) == ()
    assert time.process_time() - start < 0.2  # 0.02 s on one core at 3 GHz
