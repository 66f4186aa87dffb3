"""Pictures that are compared: what files hold becomes linear and premultiplied, with the rounding of their format."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile
from numpy.typing import NDArray
from support.picture_files import write

from texvol.comparison.pictures import Picture, read_picture
from texvol.formats.pictures import image
from texvol.util import color
from texvol.util.errors import InputError


@pytest.fixture
def picture() -> NDArray[np.float32]:
    random = np.random.default_rng(4)
    opacity = random.random((19, 23, 1))
    return np.concatenate([random.random((19, 23, 3)) * opacity, opacity], axis=2).astype(np.float32)


def test_an_exr_is_what_was_written(tmp_path: Path, picture: NDArray) -> None:
    image.write(tmp_path / "a.exr", picture, {"texvol:renderer": "a driver"})
    found = read_picture(tmp_path / "a.exr")
    np.testing.assert_array_equal(found.pixels, picture)
    assert found.channels == 4 and found.has_opacity and not found.rounding.any() and not found.lossy
    assert found.attributes["texvol:renderer"] == "a driver"
    assert found.words == "EXR, float, linear, RGBA"


@pytest.mark.parametrize(
    ("name", "transparent"), [("a.png", False), ("a.png", True), ("a.tif", False), ("a.tif", True), ("a.exr", True)]
)
def test_rounding_bounds_what_a_format_changes_and_is_not_far_above_it(
    tmp_path: Path, picture: NDArray, name: str, transparent: bool
) -> None:
    path = tmp_path / name
    if name == "a.exr":
        write(path, picture, oiio.HALF)
    else:
        levels = image.eight_bits(picture, transparent)
        write(path, levels, oiio.UINT8, oiio__UnassociatedAlpha=1, oiio__ColorSpace="srgb_rec709_scene")
    found = read_picture(path)
    assert found.channels == (4 if transparent else 3)
    off = np.abs(found.pixels - picture)[..., : 4 if transparent else 3]
    bound = found.rounding[..., : 4 if transparent else 3]
    # Of opacity and straight colour both are rounded, and float32 decodes them: 1e-6.
    assert (off <= bound + 1e-6).all()
    assert off.max() > 0.8 * bound.max(), "numbers spread evenly come near the bound"


def test_a_png_of_texvol_decodes_to_its_light(tmp_path: Path) -> None:
    light = np.zeros((1, 256, 4), np.float32)
    light[0, :, :3] = color.linear_from_srgb(np.arange(256) / 255)[:, np.newaxis]
    light[..., 3] = 1
    image.write(tmp_path / "a.png", light)
    # The power 2.4 in float32.
    np.testing.assert_allclose(read_picture(tmp_path / "a.png").pixels, light, rtol=0, atol=5e-7)


@pytest.mark.parametrize("alpha", ["assocalpha", "unassalpha"])
def test_opacity_of_a_tiff_is_what_its_header_says(tmp_path: Path, picture: NDArray, alpha: str) -> None:
    straight = image.eight_bits(picture, transparent=True)
    stored = straight
    if alpha == "assocalpha":
        opacity = straight[..., 3:] / 255
        stored = np.concatenate([np.rint(straight[..., :3] * opacity), straight[..., 3:]], axis=2).astype(np.uint8)
    tifffile.imwrite(tmp_path / "a.tif", stored, photometric="rgb", extrasamples=[alpha])
    found = read_picture(tmp_path / "a.tif")
    # Encoded and premultiplied, the half step of a colour is divided by its opacity: only dense pixels tell.
    dense = picture[..., 3] > 0.5
    assert np.abs(found.pixels - picture)[dense].max() < 0.02
    wrong = straight[..., :3] / 255
    assert np.abs(color.linear_from_srgb(wrong) - picture[..., :3])[dense].max() > 0.1


def test_whole_numbers_are_srgb_unless_the_header_says_linear(tmp_path: Path) -> None:
    grey = np.full((4, 4, 3), 128, np.uint8)
    said = write(tmp_path / "a.png", grey, oiio.UINT8, oiio__ColorSpace="lin_rec709_scene", oiio__Gamma=1.0)
    unsaid = write(tmp_path / "b.tif", grey, oiio.UINT8)
    assert read_picture(said).pixels[0, 0, 0] == pytest.approx(128 / 255, abs=1e-6)
    assert read_picture(unsaid).pixels[0, 0, 0] == pytest.approx(color.linear_from_srgb(np.array(128 / 255)), abs=1e-6)


@pytest.mark.parametrize("power", [1.4, 1.8, 2.2, 3.0])
def test_a_gamma_in_the_header_is_decoded(tmp_path: Path, power: float) -> None:
    levels = np.arange(240, dtype=np.uint8).reshape(4, 20, 3)
    space = f"g{power * 10:.0f}_rec709_scene"
    path = write(tmp_path / "a.png", levels, oiio.UINT8, oiio__Gamma=power, oiio__ColorSpace=space)
    found = read_picture(path)
    # What says 2.2 means sRGB, as browsers take it.
    light = color.linear_from_srgb(levels / 255) if power == 2.2 else (levels / 255) ** power
    np.testing.assert_allclose(found.pixels[..., :3], light, atol=2e-5)
    assert ("sRGB" if power == 2.2 else f"gamma {power:g}") in found.words


def test_sixteen_bits_of_a_tiff_are_finer(tmp_path: Path, picture: NDArray) -> None:
    levels = np.rint(color.srgb_from_linear(picture[..., :3]) * 65535).astype(np.uint16)
    tifffile.imwrite(tmp_path / "a.tif", levels, photometric="rgb")
    found = read_picture(tmp_path / "a.tif")
    np.testing.assert_allclose(found.pixels[..., :3], picture[..., :3], atol=2e-5)
    assert found.words == "TIFF, 16 bits, sRGB, RGB"


@pytest.mark.parametrize("channels", [1, 2, 3, 4])
def test_grey_is_in_all_colours_and_opacity_is_one_without_a_channel(tmp_path: Path, channels: int) -> None:
    pixels = np.random.default_rng(0).random((3, 5, channels)).astype(np.float32)
    names = {1: ("Y",), 2: ("Y", "A"), 3: tuple("RGB"), 4: tuple("RGBA")}[channels]
    spec = oiio.ImageSpec(5, 3, channels, oiio.FLOAT)
    spec.channelnames = names
    spec.alpha_channel = channels - 1 if channels in (2, 4) else -1
    output = oiio.ImageOutput.create("exr")
    path = tmp_path / "a.exr"
    assert output.open(str(path), spec) and output.write_image(pixels)
    output.close()
    found = read_picture(path)
    assert found.channels == channels and found.pixels.shape == (3, 5, 4)
    np.testing.assert_array_equal(found.pixels[..., 0], pixels[..., 0])
    np.testing.assert_array_equal(found.pixels[..., 2], pixels[..., 2 if channels > 2 else 0])
    np.testing.assert_array_equal(found.pixels[..., 3], pixels[..., -1] if channels in (2, 4) else 1)


def test_what_lies_outside_of_the_data_window_is_black(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    spec = oiio.ImageSpec(4, 3, 3, oiio.FLOAT)
    spec.x, spec.y, spec.full_width, spec.full_height = 2, -1, 5, 6
    output = oiio.ImageOutput.create("exr")
    assert output.open(str(path), spec) and output.write_image(np.ones((3, 4, 3), np.float32))
    output.close()
    pixels = read_picture(path).pixels
    expected = np.zeros((6, 5))
    expected[:2, 2:] = 1
    np.testing.assert_array_equal(pixels[..., 0], expected)


@pytest.mark.parametrize("dtype", ["uint8", "uint16", "float16", "float32", "float64"])
def test_arrays_are_pictures_too(dtype: str) -> None:
    steps = {"uint8": 255, "uint16": 65535}.get(dtype, 1)
    array = (np.linspace(0, 1, 24).reshape(2, 4, 3) * steps).astype(dtype)
    found = Picture.of_array(array)
    fraction = array.astype(np.float64) / steps
    np.testing.assert_allclose(
        found.pixels[..., :3], color.linear_from_srgb(fraction) if steps > 1 else fraction, atol=1e-6
    )
    assert bool(found.rounding.any()) == (dtype not in ("float32", "float64"))


@pytest.mark.parametrize("shape", [(4,), (2, 3, 5), (0, 3, 3), (2, 2, 3, 4)])
def test_arrays_of_other_shapes_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match="shape must be"):
        Picture.of_array(np.zeros(shape, np.float32))
    with pytest.raises(InputError, match="int64"):
        Picture.of_array(np.zeros((2, 2), np.int64))


def deep(path: Path) -> None:
    spec = oiio.ImageSpec(4, 3, 2, oiio.FLOAT)
    spec.deep, spec.channelnames = True, ("A", "Z")
    data = oiio.DeepData()
    data.init(12, 2, (oiio.FLOAT, oiio.FLOAT), ("A", "Z"))
    output = oiio.ImageOutput.create("exr")
    assert output.open(str(path), spec) and output.write_deep_image(data)
    output.close()


def multi_part(path: Path) -> None:
    parts = []
    for name in ("a", "b"):
        spec = oiio.ImageSpec(4, 3, 3, oiio.FLOAT)
        spec.attribute("oiio:subimagename", name)
        parts.append(spec)
    output = oiio.ImageOutput.create("exr")
    assert output.open(str(path), tuple(parts)) and output.write_image(np.zeros((3, 4, 3), np.float32))
    assert output.open(str(path), parts[1], "AppendSubimage") and output.write_image(np.zeros((3, 4, 3), np.float32))
    output.close()


def cmyk_jpeg(path: Path) -> None:
    from PIL import Image  # comes with matplotlib

    Image.new("CMYK", (16, 16)).save(path)


def sixteen_bit_png(path: Path) -> None:
    write(path, np.zeros((3, 4, 3), np.uint16), oiio.UINT16)


def many_channels(path: Path) -> None:
    write(path, np.zeros((3, 4, 6), np.float32))


def pages(path: Path) -> None:
    tifffile.imwrite(path, np.zeros((2, 16, 16, 3), np.uint8), photometric="rgb")


def folder(path: Path) -> None:
    path.mkdir()


def bitmap(path: Path) -> None:
    write(path, np.zeros((3, 4, 3), np.uint8), oiio.UINT8)


@pytest.mark.parametrize(
    ("name", "make", "words"),
    [
        ("deep.exr", deep, "deep"),
        ("parts.exr", multi_part, "one picture, got several"),
        ("c.jpg", cmyk_jpeg, "CMYK"),
        ("s.png", sixteen_bit_png, "16 bits"),
        ("m.exr", many_channels, "channel4"),
        ("p.tif", pages, "one picture, got several"),
        ("d.png", folder, "got a folder"),
        ("b.bmp", bitmap, "bmp"),
        ("gone.exr", lambda path: None, "No such file"),
        ("empty.png", lambda path: path.touch(), "cannot be read"),
        ("text.jpg", lambda path: path.write_text("no picture"), "cannot be read"),
    ],
)
def test_what_is_no_flat_picture_is_refused_in_one_line(tmp_path: Path, name: str, make: object, words: str) -> None:
    path = tmp_path / name
    make(path)  # type: ignore[operator]
    with pytest.raises(InputError) as caught:
        read_picture(path)
    said = str(caught.value)
    assert words in said and name in said and "\n" not in said


@pytest.mark.parametrize("name", ["a.exr", "a.png", "a.jpg", "a.tif"])
def test_a_file_that_is_cut_short_or_damaged_is_never_taken_for_whole(
    tmp_path: Path, name: str, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    noise = np.random.default_rng(2).random((40, 50, 3)).astype(np.float32)
    write(path, noise, oiio.FLOAT if name in ("a.exr", "a.tif") else oiio.UINT8)
    whole = path.read_bytes()
    random = np.random.default_rng(3)
    for length in [*random.integers(1, len(whole) - 1, 30), len(whole) // 2]:
        path.write_bytes(whole[:length])
        with pytest.raises(InputError) as caught:
            read_picture(path)
        assert name in str(caught.value) and "\n" not in str(caught.value)
    for _ in range(30):
        damaged = bytearray(whole)
        damaged[random.integers(len(whole))] ^= 1 << random.integers(8)
        path.write_bytes(damaged)
        try:
            read_picture(path)  # a changed pixel is no damage that shows
        except InputError as error:
            assert "\n" not in str(error)
    said = capfd.readouterr()
    assert not said.err and not said.out, "libraries are kept from printing"


def test_it_reads_without_a_standard_error(tmp_path: Path) -> None:
    image.write(tmp_path / "a.png", np.zeros((3, 3, 4), np.float32))
    code = "from texvol.comparison.pictures import read_picture; print(read_picture('a.png').words)"
    done = subprocess.run(
        ["sh", "-c", f'exec "$0" -c "{code}" 2>&-', sys.executable],
        cwd=tmp_path, env={**os.environ}, stdout=subprocess.PIPE, text=True, timeout=60, check=True,
    )  # fmt: skip
    assert done.stdout.strip() == "PNG, 8 bits, sRGB, RGB"


def test_a_header_cannot_ask_for_more_than_the_file_holds(tmp_path: Path) -> None:
    spec = oiio.ImageSpec(2, 2, 4, "float")
    spec.full_width = spec.full_height = 8000
    output = oiio.ImageOutput.create(str(tmp_path / "wide.exr"))
    assert output.open(str(tmp_path / "wide.exr"), spec)
    assert output.write_image(np.zeros((2, 2, 4), np.float32))
    output.close()
    with pytest.raises(InputError, match="cannot hold 8000 × 8000 pixels of 4 channels"):
        read_picture(tmp_path / "wide.exr")


def test_tiles_that_are_far_larger_than_their_picture_are_refused(tmp_path: Path) -> None:
    """A tile is unpacked as a whole: half a gigabyte for these few pixels."""
    path = tmp_path / "a.exr"
    spec = oiio.ImageSpec(20, 10, 4, oiio.HALF)
    spec.tile_width = spec.tile_height = 16
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(np.zeros((10, 20, 4), np.float32))
    output.close()
    assert read_picture(path).pixels.shape == (10, 20, 4)
    content = path.read_bytes()
    tiles = content.index(b"tiles\0tiledesc\0") + len(b"tiles\0tiledesc\0") + 4
    path.write_bytes(content[:tiles] + (8192).to_bytes(4, "little") * 2 + content[tiles + 8 :])
    with pytest.raises(InputError, match="tiles of 8192 × 8192 pixels are too large for a picture of 20 × 10"):
        read_picture(path)


def test_names_of_channels_do_not_break_the_line(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    spec = oiio.ImageSpec(3, 2, 5, oiio.FLOAT)
    spec.channelnames = ("R", "G", "B", "A", "Z\n\x1b[31m")
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec)
    assert output.write_image(np.zeros((2, 3, 5), np.float32))
    output.close()
    with pytest.raises(InputError, match="channels must be") as caught:
        read_picture(path)
    assert "\n" not in str(caught.value)
    assert "\x1b" not in str(caught.value)


def test_an_array_may_have_another_byte_order_and_no_mask() -> None:
    values = np.arange(24, dtype=np.uint16).reshape(2, 4, 3) * 2000
    np.testing.assert_array_equal(Picture.of_array(values.astype(">u2")).pixels, Picture.of_array(values).pixels)
    with pytest.raises(InputError, match=r"must have no masked pixels; use array.filled"):
        Picture.of_array(np.ma.masked_greater(values, 9000))
