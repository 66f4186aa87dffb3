"""What a volume is halved to: the same box, the same mean, the same where it is flat, and texels of 16 bits."""

from __future__ import annotations

import numpy as np
import pytest
from support.scenes import FOG

from texvol.scene.volume import Volume
from texvol.textures import halving as coarser
from texvol.textures.value_texture import bake_values

OBLIQUE = np.array([[1, 0.4, 0], [0.2, 1, 0.3], [0, -0.3, -1]])  # and left-handed


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint32", "float16", "float32", "float64"])
def test_what_is_the_same_everywhere_stays_so_to_the_last_bit(dtype: str) -> None:
    volume = Volume(np.full((6, 4, 8), 0.7123 if dtype.startswith("f") else 77, dtype))
    halved = coarser.halved(volume, (0, 1, 2))
    assert halved.dimensions == (4, 2, 3)
    assert (halved.values == volume.values[0, 0, 0]).all()
    # Integers of 32 bits have digits that single precision has not.
    assert (coarser._halved_values(volume.values, (0, 1, 2)) == volume.values[0, 0, 0]).all()
    assert halved.values.dtype == (np.float64 if dtype in ("uint32", "float64") else np.float32)


@pytest.mark.parametrize("axes", [(0,), (1,), (2,), (0, 2), (0, 1, 2)])
def test_a_halved_volume_lies_in_the_same_box_and_a_plane_stays_one(axes: coarser.Axes) -> None:
    z, y, x = np.meshgrid(*[np.arange(count) for count in (18, 6, 20)], indexing="ij")
    volume = Volume(2.0 * x + 3 * y - z, (0.8, 1.0, 0.9), (3, -2, 1), OBLIQUE)
    halved = coarser.halved(volume, axes)
    assert coarser.halvings(volume, halved) == [int(axis in axes) for axis in range(3)]
    np.testing.assert_allclose(halved.box_corner, volume.box_corner, rtol=0, atol=1e-12)
    np.testing.assert_allclose(halved.box_edges, volume.box_edges, rtol=0, atol=1e-12)
    wanted = volume.values.astype(np.float64)
    for axis in axes:
        along = np.moveaxis(wanted, 2 - axis, 0)
        wanted = np.moveaxis((along[0::2] + along[1::2]) / 2, 0, 2 - axis)
    inner = (slice(1, -1),) * 3  # outside the box the last samples go on, and no plane does
    step = np.ptp(halved.values) / 65535
    np.testing.assert_allclose(halved.values[inner], wanted[inner], rtol=0, atol=0.5001 * step)


def test_a_parabola_keeps_its_mean_between_samples() -> None:
    """The second moments of the docstring: interpolated over a halved spacing it is on average what it was."""
    x = np.arange(40.0)
    parabola = np.broadcast_to(x**2, (2, 2, 40))
    halved = coarser._halved_values(parabola, (0,))[0, 0]
    positions = np.linspace(10.5, 30.5, 20_001)[:-1] + 5e-4
    before = np.interp(positions, x, x**2)
    after = np.interp(positions, np.arange(20) * 2 + 0.5, halved)
    assert abs((after - before).mean()) < 1e-6
    assert np.abs(after - before).max() > 0.1


def test_the_last_samples_go_on_beyond_the_box() -> None:
    values = np.array([0.0, 16, 0, 0, 0, 16]).reshape(6, 1, 1)
    halved = coarser._halved_values(values, (2,))[:, 0, 0]
    a, b = -3 / 16, 11 / 16
    np.testing.assert_allclose(halved, [16 * b, 16 * a, 16 * b + 16 * a])


@pytest.mark.parametrize("layers", [2, 14, 16, 18, 34])
def test_layers_halved_apart_fit_together(layers: int, monkeypatch: pytest.MonkeyPatch) -> None:
    values = _noise((layers, 4, 6))
    parts = coarser.halved(Volume(values), (0, 1, 2)).values
    monkeypatch.setattr(coarser, "_LAYERS", 1000)
    np.testing.assert_array_equal(parts, coarser.halved(Volume(values), (0, 1, 2)).values)


def test_halved_values_are_texels_of_16_bits_and_nothing_stays_nothing() -> None:
    values = 3 * _noise((64, 64, 64)) - 1
    values[:, :, :30] = values.min()
    exact = coarser._halved_values(values, (0, 1, 2))
    assert exact.min() < values.min() - 0.1  # beside edges it goes beyond
    halved = coarser.halved(Volume(values), (0, 1, 2))
    step = np.ptp(halved.values) / 65535
    assert (halved.values[:, :, :14] == values.min()).all()
    off = np.sort(np.abs(halved.values - exact), axis=None)
    assert off[-3] <= 0.51 * step and off[-1] <= 3 * step  # its ends are moved on
    baked = bake_values(halved, FOG, "post", "r16")
    texels = baked.texels()[..., 0]
    np.testing.assert_allclose(
        texels / 65535 * baked.storage.scale + baked.storage.offset, halved.values, rtol=0, atol=5e-7
    )


def _noise(shape: tuple[int, int, int]) -> np.ndarray:
    return np.random.default_rng(7).random(shape, np.float32)
