"""Pictures in files, and how far one is from another."""

from __future__ import annotations

import os
import resource
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from texvol.comparison import compare
from texvol.formats.pictures import image
from texvol.util import color
from texvol.util.errors import InputError


@pytest.fixture
def picture() -> np.ndarray:
    random = np.random.default_rng(0)
    opacity = random.random((37, 53, 1))
    return np.concatenate([random.random((37, 53, 3)) * opacity, opacity], axis=2).astype(np.float32)


def test_exr_holds_the_picture_and_its_attributes(tmp_path: Path, picture: np.ndarray) -> None:
    path = tmp_path / "a.exr"
    picture[0, 0] = (3.5, 1e-30, 0, 1)  # brighter than white, fainter than half precision
    image.write(path, picture, {"texvol:scene": '{"a": 1}'})
    source = oiio.ImageInput.open(str(path))
    assert source.spec().format == oiio.FLOAT
    assert list(source.spec().channelnames) == ["R", "G", "B", "A"]
    assert source.spec().get_string_attribute("texvol:scene") == '{"a": 1}'
    source.close()
    np.testing.assert_array_equal(image.read(path), picture)


def test_png_is_srgb_over_the_background(tmp_path: Path, picture: np.ndarray) -> None:
    image.write(tmp_path / "a.png", picture)
    pixels = image.read(tmp_path / "a.png")
    assert pixels.shape == (37, 53, 3)
    # Half a level, and sRGB's slope is at least 1/12.92 per level and at most 2.3.
    np.testing.assert_allclose(color.srgb_from_linear(picture[..., :3]), pixels, atol=0.5 / 255 + 1e-6)


def test_eight_bits_are_the_nearest_level_to_the_last_bit() -> None:
    """Where a level begins, halfway between two in sRGB, and at the numbers next to it."""
    begins = color.linear_from_srgb((np.arange(1, 256) - 0.5) / 255)
    near = begins.astype(np.float32)
    near = np.concatenate([np.nextafter(near, np.float32(0)), near, np.nextafter(near, np.float32(1))])
    others = np.array([0, -0.0, -1, 1e-30, -1e30, 1, 1e30, np.inf, -np.inf, np.nan], np.float32)
    numbers = np.concatenate([near, others])
    expected = np.searchsorted(begins, numbers.astype(float), side="right")
    expected[-others.size :] = [0, 0, 0, 0, 0, 255, 255, 255, 0, 0]
    for width in (1, 5, numbers.size):  # rows are worked out some at once
        gray = np.resize(numbers, (-(-numbers.size // width), width))
        levels = image.eight_bits(np.dstack([gray, gray[::-1], gray, np.ones_like(gray)]))
        np.testing.assert_array_equal(levels[..., 0].ravel(), np.resize(expected, gray.size))
        np.testing.assert_array_equal(levels[..., 1], levels[::-1, :, 0])


def test_a_transparent_png_holds_straight_color_and_opacity(tmp_path: Path, picture: np.ndarray) -> None:
    picture[3, 4] = 0
    image.write(tmp_path / "a.png", picture, transparent=True)
    config = oiio.ImageSpec()
    config.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(tmp_path / "a.png"), config)
    pixels = np.asarray(source.read_image(oiio.UINT8))
    source.close()
    straight = picture[..., :3] / np.maximum(picture[..., 3:], 1e-9)
    expected = np.concatenate([color.srgb_from_linear(straight), picture[..., 3:]], axis=2) * 255
    np.testing.assert_allclose(pixels, expected, atol=0.51)
    assert not pixels[3, 4].any()


def test_jpeg_is_close(tmp_path: Path) -> None:
    ramp = np.linspace(0, 1, 64, dtype=np.float32)
    picture = np.dstack([np.tile(ramp, (64, 1))] * 3 + [np.ones((64, 64), np.float32)])
    image.write(tmp_path / "a.jpg", picture)
    np.testing.assert_allclose(image.read(tmp_path / "a.jpg"), color.srgb_from_linear(picture[..., :3]), atol=0.02)


def test_srgb_goes_both_ways() -> None:
    values = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(color.linear_from_srgb(color.srgb_from_linear(values)), values, atol=1e-7)
    assert color.srgb_from_linear(np.array(0.5)) == pytest.approx(0.7353569830524495)


@pytest.mark.parametrize("name", ["a.gif", "a", "no/such/folder/a.png", "folder.png"])
def test_names_that_cannot_be_written_are_refused(tmp_path: Path, picture: np.ndarray, name: str) -> None:
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(InputError, match=Path(name).name):
        image.write(tmp_path / name, picture)
    assert sorted(os.listdir(tmp_path)) == ["folder.png"]


@pytest.mark.parametrize("name", ["a.exr", "a.png", "a.jpg"])
def test_a_full_disk_leaves_the_old_picture(tmp_path: Path, picture: np.ndarray, name: str) -> None:
    """A limit on the size of files stands for the full disk: writes fail in the same place."""
    path = tmp_path / name
    image.write(path, picture[:4, :4])
    before = path.read_bytes()
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    noise = np.random.default_rng(1).random((300, 300, 4)).astype(np.float32)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
    try:
        with pytest.raises(InputError, match="cannot be written"):
            image.write(path, noise)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == [name]


def test_a_broken_picture_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"nothing")
    for path in (tmp_path / "a.png", tmp_path / "missing.png"):
        with pytest.raises(InputError, match="cannot be read") as caught:
            image.read(path)
        assert "\n" not in str(caught.value)


def test_differences_are_measured(picture: np.ndarray) -> None:
    other = picture.copy()
    other[5, 7, 2] += 0.25
    difference = compare(picture, other)
    assert difference.max_error == pytest.approx(0.25)
    assert difference.rms_error == pytest.approx(0.25 / np.sqrt(picture.size))
    assert difference.mean_error == pytest.approx(0.25 / picture.size)
    assert difference.worst_pixel == (7, 5)
    assert difference.non_finite == 0


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_a_picture_that_is_not_finite_never_passes(picture: np.ndarray, wrong: float) -> None:
    other = picture.copy()
    other[5, 7, 2] = wrong
    for pair in ((picture, other), (other, picture), (other, other)):
        difference = compare(*pair)
        assert not difference.max_error <= 1e300
        assert not difference.rms_error <= 1e300
        assert difference.non_finite == 1


def test_pictures_of_different_shapes_are_refused(picture: np.ndarray) -> None:
    with pytest.raises(InputError, match="one shape"):
        compare(picture, picture[1:])
