"""Facts about volumes, and the page that shows them."""

from __future__ import annotations

import json

import numpy as np
import pytest

from texvol import Volume
from texvol.cli import information
from texvol.scene import gradient


def metadata_of(values: object, dtype: str = "f8", **grid: object) -> dict:
    """Facts that have been through JSON, which has neither NaN nor infinity."""
    metadata = information.metadata(Volume(np.array(values, dtype), **grid))
    return json.loads(json.dumps(metadata, allow_nan=False))


def test_the_box_reaches_half_a_spacing_beyond_the_samples() -> None:
    turned = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    metadata = metadata_of(np.zeros((2, 3, 4)), spacing=(1, 2, 3), origin=(10, 20, 30), direction=turned, unit="mm")
    assert metadata["dimensions"] == [4, 3, 2]
    assert metadata["extent"] == [4, 6, 6]
    np.testing.assert_allclose(metadata["box_min"], [10 - 5, 20 - 0.5, 30 - 1.5])
    np.testing.assert_allclose(metadata["box_max"], [10 + 1, 20 + 3.5, 30 + 4.5])
    assert metadata["extinction_unit"] == "per mm"


def test_values_count_where_they_are_finite() -> None:
    metadata = metadata_of([[[1, 2, 3, 6, np.nan, np.nan, np.inf, -np.inf]]])
    assert (metadata["samples"], metadata["finite_count"], metadata["nan_count"], metadata["inf_count"]) == (8, 4, 2, 2)
    assert metadata["value_range"] == [1, 6]
    assert metadata["mean"] == 3
    assert metadata["percentiles"]["50"] == 2.5
    assert sum(metadata["histogram"]["counts"]) == 4


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8"])
def test_the_histogram_is_numpys(dtype: str) -> None:
    kind = np.dtype(dtype)
    values = np.random.default_rng(3).integers(0, 120, (7, 8, 9)).astype(kind)
    histogram = metadata_of(values, dtype)["histogram"]
    counts, _ = np.histogram(values.astype(float), bins=histogram["edges"])
    np.testing.assert_array_equal(histogram["counts"], counts)
    assert len(counts) == information.BINS


def test_whole_numbers_of_few_values_have_a_bin_each() -> None:
    histogram = metadata_of([[[0, 1, 1, 4]]], "u1")["histogram"]
    assert histogram["counts"] == [1, 2, 0, 0, 1]
    assert histogram["edges"] == [-0.5, 0.5, 1.5, 2.5, 3.5, 4.5]


@pytest.mark.parametrize(
    ("values", "dtype", "value_range"),
    [
        ([[[np.nan, np.nan]]], "f4", None),
        ([[[np.inf, -np.inf]]], "f4", None),
        ([[[7]]], "u1", [7, 7]),
        ([[[1e300] * 3] * 3], "f8", [1e300, 1e300]),
        ([[[-1.7e308, 1.7e308]]], "f8", [-1.7e308, 1.7e308]),
        ([[[0, 5e-324]]], "f8", [0, 5e-324]),
        ([[[2**63, 2**64 - 1]]], "u8", [2**63, 2**64 - 1]),
        ([[[-(2**63), 2**63 - 1]]], "i8", [-(2**63), 2**63 - 1]),
        ([[[65504, -65504]]], "f2", [-65504, 65504]),
    ],
)
def test_extreme_volumes_have_facts_and_a_page(values: list, dtype: str, value_range: list | None) -> None:
    metadata = metadata_of(values, dtype)
    assert metadata["value_range"] == value_range
    assert sum(metadata["histogram"]["counts"]) == metadata["finite_count"]
    if value_range:
        assert value_range[0] <= metadata["mean"] <= value_range[1]
    assert information.text(metadata)


def test_the_mean_of_many_chunks_is_the_mean() -> None:
    values = np.random.default_rng(4).random((5, 700, 700))  # more than two chunks
    # A sum of n rounded terms is off by at most n · 2⁻⁵³ of their sum; pairwise sums do far better.
    assert metadata_of(values)["mean"] == pytest.approx(values.mean(), rel=1e-12)


def test_percentiles_of_a_large_volume_are_from_evenly_spread_samples(monkeypatch: pytest.MonkeyPatch) -> None:
    """A step that shares a factor with a dimension would see some columns always and others never."""
    monkeypatch.setattr(information, "MOST_SORTED", 4000)
    values = np.broadcast_to(np.arange(40) % 2 * 100, (20, 30, 40))
    metadata = metadata_of(values, "u1")
    assert metadata["percentile_samples"] <= 4000
    assert metadata["percentiles"]["25"] == 0
    assert metadata["percentiles"]["75"] == 100
    page = information.text(metadata)
    assert f"from {metadata['percentile_samples']} of 24000 samples" in page


def test_memory_is_that_of_the_textures() -> None:
    memory = metadata_of(np.zeros((2, 3, 4)), "i2")["memory"]
    textures = {"rgba8": 96, "rgba16f": 192, "rgba32f": 384}
    assert memory == {"data_bytes": 48, "texture_bytes": textures, "gradient_bytes": 192}


@pytest.mark.parametrize(
    "dtype, texel", [*((kind, 8) for kind in ("u1", "i1", "u2", "i2", ">i2")), *((k, 16) for k in ("u4", "f2", "f4"))]
)
def test_value_and_gradient_are_four_numbers_of_16_or_32_bits(dtype: str, texel: int) -> None:
    metadata = metadata_of(np.zeros((64, 64, 32)), dtype)
    assert metadata["memory"]["gradient_bytes"] == 64 * 64 * 32 * texel
    assert f"texture with gradients {texel // 8} MiB (light, contours" in information.text(metadata)


def test_no_gradient_is_computed_to_say_what_it_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    called = []
    for name in ("gradients", "largest_component"):
        monkeypatch.setattr(gradient, name, lambda *_, name=name: called.append(name))
        monkeypatch.setattr(information, name, lambda *_, name=name: called.append(name), raising=False)
    metadata_of(np.zeros((2, 3, 4)))
    assert not called


def test_the_page_names_what_a_person_asks_for() -> None:
    values = np.random.default_rng(5).normal(size=(10, 20, 30))
    page = information.text(
        metadata_of(values, "f4", spacing=(0.5, 0.5, 2), unit="µm", space="somewhere", name="cell.tif")
    )
    lines = page.splitlines()
    assert lines[0] == "cell.tif"
    assert "30 x 20 x 10  (6000 samples of float32)" in page
    assert "0.5 x 0.5 x 2 µm" in page
    assert "extinction  per µm" in page
    bars = [line for line in lines if "█" in line]
    assert 10 <= len(bars) <= 16
    assert sum(int(line.split()[-1]) for line in lines[-16:]) == 6000
    assert all(len(line) < 120 for line in lines)


def test_an_unnamed_unit_is_said_to_be_unnamed() -> None:
    page = information.text(metadata_of(np.zeros((1, 1, 1))))
    assert "world units (the file names none)" in page
    assert "per world unit" in page
