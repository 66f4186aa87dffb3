"""What texels hold."""

from __future__ import annotations

import numpy as np
import pytest
from support.scenes import BONE, FOG, constant, random_volume, smooth_volume

from texvol.scene import optics
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures.slab_texture import SlabTexture, bake
from texvol.textures.texel_format import cheapest_texel_format
from texvol.textures.value_texture import bake_values


def unscaled(texture: SlabTexture) -> np.ndarray:
    """Texels as numbers."""
    texels = texture.texels()
    return texels.astype(np.float64) / (255 if texels.dtype == np.uint8 else 1) * texture.scale


@pytest.mark.parametrize("texel_format, tolerance", [("rgba8", 0.51 / 255), ("rgba16f", 2**-11), ("rgba32f", 2**-24)])
@pytest.mark.parametrize("emissive", [False, True])
def test_a_slab_texel_is_the_slab_integral(texel_format: str, tolerance: float, emissive: bool) -> None:
    volume = random_volume(1)
    transfer_function = TransferFunction(BONE.values, BONE.colors, BONE.extinctions, emissive)
    texture = bake(volume, transfer_function, "slab", 1.7, texel_format)
    emission, extinction = transfer_function.classify(volume.values)
    color, opacity = optics.slab_integral(emission, extinction, 1.7)
    expected = np.concatenate([color, opacity[..., np.newaxis]], axis=3)
    # Half a unit in the last place of the format, relative to the number for floats, to the scale for bytes; halves
    # lose more below 2^-14 of the scale, where they are subnormal.
    bound = tolerance * (texture.scale if texel_format == "rgba8" else expected + 2**-14 * texture.scale)
    assert (np.abs(unscaled(texture) - expected) <= bound * 1.001).all()


def test_an_extinction_texel_is_emission_and_extinction_per_smallest_spacing() -> None:
    volume = random_volume(2)
    texture = bake(volume, FOG, "extinction", 5.0)
    emission, extinction = FOG.classify(volume.values)
    np.testing.assert_allclose(unscaled(texture)[..., 3], extinction * 0.7, rtol=1e-7)
    np.testing.assert_allclose(unscaled(texture)[..., :3], emission * 0.7, rtol=1e-7, atol=1e-12)


def test_tables_and_arithmetic_give_the_same_texels() -> None:
    values = np.random.default_rng(0).integers(-300, 900, (17, 18, 19))
    points = TransferFunction(np.array([-100.0, 0, 0, 500]), BONE.colors[:4], np.array([0, 0.1, 0.4, 0.9]))
    by_table = bake(Volume(values.astype(np.int16)), points, "slab", 0.5, "rgba16f")
    by_arithmetic = bake(Volume(values.astype(np.float64)), points, "slab", 0.5, "rgba16f")
    np.testing.assert_array_equal(by_table.texels(), by_arithmetic.texels())


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32, np.float64])
def test_texels_of_a_box_are_those_of_the_whole_there(dtype: type) -> None:
    values = np.random.default_rng(4).uniform(0, 100, (19, 18, 17)).astype(dtype)
    medium = TransferFunction(100 * BONE.values, BONE.colors, BONE.extinctions)
    box = (slice(3, 9), slice(0, 18), slice(5, 6))
    for texture in (
        bake(Volume(values), medium, "slab", 0.5, "rgba16f"),
        bake(Volume(values), medium, "extinction", 0.5),
        bake_values(Volume(values), medium, "post"),
    ):
        np.testing.assert_array_equal(texture.texels(box), texture.texels()[box])
        assert texture.texels(box).shape == (6, 18, 1, texture.formats["texels"][1])


@pytest.mark.parametrize("classification", ["slab", "extinction"])
@pytest.mark.parametrize("texel_format", ["rgba8", "rgba16f", "rgba32f"])
def test_nan_is_transparent_and_infinite_values_clamp(classification: str, texel_format: str) -> None:
    values = np.array([np.nan, np.inf, -np.inf, 0.5]).reshape(1, 1, 4)
    texels = unscaled(bake(Volume(values), BONE, classification, 1.0, texel_format))[0, 0]  # type: ignore[arg-type]
    assert np.isfinite(texels).all()
    assert (texels[0] == 0).all()
    assert (texels[2] == 0).all()
    assert texels[1, 3] > texels[3, 3] > 0


@pytest.mark.parametrize("depth", [1e-30, 1e-12, 1e-3, 1.0, 30.0, 1e4])
def test_optical_depth_survives_the_texel(depth: float) -> None:
    volume = Volume(np.zeros((2, 2, 2), np.uint8))
    for texel_format, tolerance in (("rgba16f", 2**-11), ("rgba32f", 2**-24)):
        extinction = bake(volume, constant(depth), "extinction", 1.0, texel_format)
        np.testing.assert_allclose(unscaled(extinction)[..., 3], depth, rtol=tolerance)
        slab = bake(volume, constant(depth), "slab", 1.0, texel_format)
        np.testing.assert_allclose(unscaled(slab)[..., 3], -np.expm1(-min(depth, 2)), rtol=tolerance)


@pytest.mark.parametrize("extinction", [0.5, 20.0, 1e4, 1e12])
def test_dense_matter_stands_for_a_thinner_slab(extinction: float) -> None:
    texture = bake(Volume(np.zeros((1, 1, 1), np.uint8)), constant(extinction), "slab", 1.0)
    assert texture.length_unit == min(1.0, 2 / extinction)
    depth = -np.log1p(-unscaled(texture)[0, 0, 0, 3]) / texture.length_unit
    assert depth == pytest.approx(extinction, rel=1e-6)


@pytest.mark.parametrize("classification", ["slab", "extinction"])
def test_opaque_matter_is_finite_and_opaque(classification: str) -> None:
    for texel_format in ("rgba8", "rgba16f", "rgba32f"):
        texture = bake(
            Volume(np.zeros((1, 1, 1), np.uint8)),
            constant(np.inf),
            classification,
            1.0,
            texel_format,  # type: ignore[arg-type]
        )
        red, green, blue, weight = unscaled(texture)[0, 0, 0]
        assert np.isfinite(texture.texels().astype(np.float64)).all()
        np.testing.assert_allclose((red / weight, green / weight, blue / weight), (0.9, 0.6, 0.3), rtol=0.004)
        assert weight == 1.0 if classification == "slab" else weight >= 32


def test_a_world_of_any_size_gives_the_same_texels() -> None:
    values = np.random.default_rng(3).random((5, 5, 5))
    normal = bake(Volume(values), BONE, "extinction", 1.0)
    for scale in (1e-9, 1e9):
        scaled_function = TransferFunction(BONE.values, BONE.colors, BONE.extinctions / scale)
        scaled = bake(Volume(values, (scale,) * 3), scaled_function, "extinction", scale)
        np.testing.assert_allclose(unscaled(scaled), unscaled(normal), rtol=1e-6, atol=1e-12)


def test_auto_takes_more_bits_as_slabs_get_thinner() -> None:
    volume = smooth_volume()
    bits = {"rgba8": 8, "rgba16f": 16, "rgba32f": 32}
    chosen = [bits[cheapest_texel_format(volume, BONE, "extinction", d)] for d in (8.0, 1.0, 0.125, 0.01)]
    assert chosen == sorted(chosen)
    assert chosen[-1] == 32
    assert chosen[0] < 32


def test_auto_takes_all_digits_where_there_is_no_other_error() -> None:
    assert cheapest_texel_format(Volume(np.zeros((8, 8, 8))), constant(0.1), "slab", 1.0) == "rgba32f"


def test_masked_samples_are_transparent() -> None:
    masked = np.ma.masked_greater(np.array([[[1.0, 9.0]]]), 5)
    assert np.isnan(Volume(masked).values[0, 0, 1])
    assert Volume(masked).values[0, 0, 0] == 1.0
