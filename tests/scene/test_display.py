"""How numbers become colours, and depths a file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import OpenImageIO as oiio
import pytest

from texvol.formats.pictures import depth as depth_picture
from texvol.formats.pictures.image import eight_bits
from texvol.scene.display import checked_window, found_window, shown
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction, proposed_for
from texvol.scene.volume import Volume
from texvol.util.color import linear_from_srgb
from texvol.util.errors import InputError

RAMP = Volume(np.arange(-4.0, 4.0).reshape(2, 2, 2) * 10)  # -40 … 30
COLORS = TransferFunction([0, 10], [[1, 0, 0], [0, 0, 1]], [0, 3])
MID_GREY = linear_from_srgb(np.float64(0.5))


def numbers(*each, absent=False):
    """A picture of one row, and a pixel without a number at its end if `absent`."""
    picture = np.zeros((1, len(each) + absent, 4))
    picture[0, : len(each)] = np.array(each)[:, None]
    picture[0, : len(each), 3] = 1
    return picture


def levels(picture, scene=None, **options):
    """Grey levels of 8 bits that a picture is shown in."""
    result = shown(picture, scene or Scene(RAMP, mode="mip", classification="slab"), **options)
    assert result.dtype == np.float32 and (result[..., :3] == result[..., :1]).all()
    return eight_bits(result)[0, :, 0].tolist()


def test_a_window_is_linear_in_the_levels():
    picture = numbers(*np.arange(-20.0, 280.0))
    expected = np.clip(np.arange(-20, 280), 0, 255)
    assert levels(picture, window=(127.5, 255)) == expected.tolist()
    assert levels(numbers(39, 40, 90, 140, 141), window=(90, 100)) == [0, 0, 128, 255, 255]


@pytest.mark.parametrize("mode", ["xray", "mip", "minip", "average"])
def test_infinities_are_white_and_black_and_nan_is_black(mode):
    picture = numbers(np.inf, -np.inf, np.nan, 1.0, 3.0)
    assert levels(picture, Scene(RAMP, mode=mode, classification="slab"), window=(2, 2)) == [255, 0, 0, 0, 255]
    assert levels(picture, Scene(RAMP, mode=mode, classification="slab"))[:3] == [255, 0, 0]


def test_without_a_window_the_range_of_the_values_is_shown():
    values = RAMP.values.copy()
    values[0, 0, :] = np.nan, np.inf
    volume = Volume(values)  # -20 … 30
    for mode in ("mip", "minip"):
        assert found_window(numbers(1, 2), Scene(volume, mode=mode, classification="slab")) == (5, 50)
        assert levels(numbers(-20, 10, 30), Scene(volume, mode=mode, classification="slab")) == [0, 153, 255]


@pytest.mark.parametrize("mode", ["xray", "average"])
def test_without_a_window_sums_show_the_range_of_their_numbers(mode):
    scene = Scene(RAMP, mode=mode, classification="slab")
    picture = numbers(100, 500, np.inf, 200, np.nan, absent=True)
    assert found_window(picture, scene) == (300, 400)
    assert levels(picture, scene) == [0, 255, 255, 64, 0, 0]


def test_what_is_the_same_throughout_is_mid_grey():
    xray = Scene(RAMP, mode="xray", classification="slab")
    for picture in (numbers(7.0, 7.0), numbers(7.0, 7.0 + 1e-6), numbers(0.0), numbers(-3e30, -3e30)):
        assert found_window(picture, xray)[1] == 0
        np.testing.assert_allclose(shown(picture, xray)[..., :3], MID_GREY, rtol=1e-6)
    assert levels(numbers(7.0, 7.001), xray) == [0, 255]  # 1e-4 is a difference
    constant = Volume(np.full((2, 2, 2), 9, np.uint8))
    np.testing.assert_allclose(
        shown(numbers(9), Scene(constant, mode="mip", classification="slab"))[..., :3], MID_GREY, rtol=1e-6
    )
    assert levels(numbers(np.inf, -np.inf, np.nan), Scene(constant, mode="mip", classification="slab")) == [255, 0, 0]
    nothing = Scene(Volume(np.full((2, 2, 2), np.nan)), mode="mip", classification="slab")
    assert not shown(np.zeros((3, 4, 4)), nothing).any()


def test_the_widest_range_there_is_can_be_shown():
    largest = np.finfo(np.float64).max
    volume = Volume(np.array([-largest, largest]).reshape(1, 1, 2))
    with np.errstate(all="raise"):
        assert levels(numbers(-largest, 0, largest), Scene(volume, mode="mip", classification="slab")) == [0, 128, 255]


@pytest.mark.parametrize("mode", ["xray", "mip"])
def test_the_colours_of_the_transfer_function_are_shown_opaque_if_asked_for(mode):
    scene = Scene(RAMP, COLORS, mode=mode, classification="slab")
    picture = numbers(-100, 0, 2.5, 10, np.inf)
    expected = [[1, 0, 0, 1], [1, 0, 0, 1], [0.75, 0, 0.25, 1], [0, 0, 1, 1], [0, 0, 1, 1]]
    colored = replace(scene, coloring="tf")
    np.testing.assert_allclose(shown(picture, colored)[0], expected, atol=1e-7)
    assert np.ptp(shown(picture, scene)[0, :, :3], axis=-1).max() == 0  # nobody asked
    assert levels(picture, colored, window=(0, 10)) == [0, 128, 191, 255, 255]
    proposed = Scene(RAMP, proposed_for(RAMP), mode="mip", coloring="tf", classification="slab")
    np.testing.assert_array_equal(shown(picture, replace(proposed, transfer_function=None)), shown(picture, proposed))


def test_colours_are_straight_however_a_transfer_function_holds_them():
    premultiplied = TransferFunction([0, 10], [[0, 0, 0], [0.8, 0.4, 0]], [0, 4], premultiplied=True)
    gas = TransferFunction([0, 10], [[0, 0, 0], [8, 4, 0]], [0, 0], emissive=True)
    for transfer, expected in [(premultiplied, [[0, 0, 0], [0.2, 0.1, 0]]), (gas, [[0, 0, 0], [0.5, 0.25, 0]])]:
        picture = shown(numbers(0, 5), Scene(RAMP, transfer, mode="mip", coloring="tf", classification="slab"))
        np.testing.assert_allclose(picture[0, :, :3], expected, rtol=1e-6)


def test_the_background_is_where_no_number_is():
    picture = numbers(-40, 30, absent=True)
    result = shown(picture, Scene(RAMP, mode="mip", background=(0.25, 0.5, 2), classification="slab"))
    np.testing.assert_array_equal(result[0], [[0, 0, 0, 1], [1, 1, 1, 1], [0.25, 0.5, 2, 0]])


def test_pictures_of_light_come_back_as_they_are():
    picture = np.random.default_rng(0).random((2, 3, 4))
    for options in ({}, {"mode": "isosurface", "isovalue": 1.0}):
        np.testing.assert_array_equal(
            shown(picture, Scene(RAMP, **({"classification": "slab"} | options))), picture.astype(np.float32)
        )


def test_a_window_is_read():
    assert checked_window("40,400") == (40, 400)
    assert checked_window(" -1e3 , 0.5") == (-1000, 0.5)
    assert checked_window((1, 2)) == (1, 2)


@pytest.mark.parametrize(
    "window, message",
    [
        ("40", "two finite numbers"),
        ("40,400,1", "two finite numbers"),
        ("a,b", "two finite numbers"),
        ("", "two finite numbers"),
        ("nan,1", "two finite numbers"),
        ("0,inf", "two finite numbers"),
        (5, "two finite numbers"),
        ("40,0", "window: width must be positive, got 0"),
        ((40, -3), "window: width must be positive, got -3"),
    ],
    ids=str,
)
def test_a_window_that_is_none_is_refused(window, message):
    with pytest.raises(InputError, match=message) as caught:
        checked_window(window)
    assert "\n" not in str(caught.value)


def test_depths_are_one_channel_named_z(tmp_path):
    depth = np.random.default_rng(1).random((7, 5)) * 1e3
    depth[2, 3] = np.inf
    path = tmp_path / "depth.exr"
    depth_picture.write(path, depth)
    source = oiio.ImageInput.open(str(path))
    assert list(source.spec().channelnames) == ["Z"] and source.spec().format == oiio.FLOAT
    pixels = np.asarray(source.read_image(oiio.FLOAT))
    source.close()
    np.testing.assert_array_equal(pixels[..., 0], depth.astype(np.float32))
    assert list(tmp_path.iterdir()) == [path]


def test_depths_are_refused_another_name_or_place(tmp_path):
    for name, message in [("depth.png", "end with .exr"), ("depth", "end with .exr"), ("no/depth.exr", "not exist")]:
        with pytest.raises(InputError, match=message):
            depth_picture.write(tmp_path / name, np.zeros((2, 2)))
    assert not list(tmp_path.iterdir())
