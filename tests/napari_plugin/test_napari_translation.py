"""Layers of napari as scenes: where napari shows a sample it is drawn, in its colour; what can't be drawn is said."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from support.napari_layers import Camera, Dims, Image, Labels, Points
from texvol_napari import translation
from texvol_napari.drawing import blended, drawn
from texvol_napari.placing import camera_of, flips_of, volume_of
from texvol_napari.translation import translated

import texvol
from texvol.formats.pictures import image

SIZE = (32, 24)


def dot(z: int, y: int, x: int, value: float = 1.0) -> np.ndarray:
    values = np.zeros((17, 17, 17), np.float32)
    values[z, y, x] = value
    return values


def seen_at(camera: Camera, layer: Image, index: tuple[int, int, int]) -> np.ndarray:
    """Column and row of the canvas, from its middle, at which texvol's camera sees a sample (z, y, x)."""
    flips = flips_of(camera)
    volume = volume_of(layer, layer.data, (0, 1, 2), flips)
    found = camera_of(camera, SIZE)
    position = volume.origin + volume.world_from_index @ index[::-1]
    right, up, depth = found.in_eye_space(position[np.newaxis], np.zeros(3))[0]
    scale = SIZE[1] / 2 / found.half_height
    if found.projection == "perspective":
        scale /= depth
    return np.array([right, -up]) * scale


@pytest.mark.parametrize("orientation", list(product(("towards", "away"), ("down", "up"), ("right", "left"))))
def test_all_orientations_of_the_axes(orientation: tuple[str, str, str]) -> None:
    """At the angles 0 napari looks along z, and x and y of the world are the canvas's, `zoom` pixels a unit."""
    depth, vertical, horizontal = orientation
    view, up = (-1.0 if depth == "towards" else 1.0, 0.0, 0.0), (0.0, -1.0 if vertical == "down" else 1.0, 0.0)
    camera = Camera(zoom=2.5, orientation=orientation, view_direction=view, up_direction=up)
    layer = Image(dot(0, 0, 0), scale=(2.0, 1.5, 0.5), translate=(-3.0, 1.0, 4.0))
    signs = np.array([1 if horizontal == "right" else -1, 1 if vertical == "down" else -1])
    for z, y, x in ((2, 3, 5), (16, 0, 9)):
        world = np.array([0.5 * x + 4, 1.5 * y + 1])
        np.testing.assert_allclose(seen_at(camera, layer, (z, y, x)), 2.5 * signs * (world - 8), atol=1e-9)


def test_the_middle_keeps_its_size_in_perspective() -> None:
    """In the plane of the centre a unit has `zoom` pixels; nearer to the eye it has more."""
    layer = Image(dot(0, 0, 0))
    for fov in (20.0, 70.0):
        camera = Camera(perspective=fov)
        np.testing.assert_allclose(seen_at(camera, layer, (8, 9, 11)), (6, 2))
        near = seen_at(camera, layer, (10, 9, 11))  # z points to the eye
        distance = SIZE[1] / 2 / 2 / np.tan(np.radians(fov) / 2)
        np.testing.assert_allclose(near, np.array([6, 2]) * distance / (distance - 2))


def test_a_drawn_voxel_is_where_and_as_napari_shows_it() -> None:
    values = dot(4, 6, 11, 600.0)
    layer = Image(values, contrast_limits=(100.0, 1100.0), gamma=2.0)
    drawing = drawn(translated([layer], Camera(zoom=3.0), Dims(), SIZE), SIZE)
    row, column = np.unravel_index(drawing.pixels[..., 0].argmax(), SIZE[::-1])
    assert (column, row) == (pytest.approx(16 + 9 - 0.5, abs=0.6), pytest.approx(12 - 6 - 0.5, abs=0.6))
    # Interpolated half a pixel off the sample, a sixth of a voxel along x and y.
    fraction = (600 * (5 / 6) ** 2 - 100) / 1000
    assert drawing.pixels.max() == round(fraction**2 * 255)
    assert "of the contrast limits" in drawing.lines[0]


def test_slices_of_further_axes_are_those_of_the_sliders() -> None:
    values = np.stack([dot(1, 1, 1), dot(2, 2, 2), dot(3, 3, 3)])
    layer = Image(values, scale=(0.5, 1.0, 1.0, 1.0), translate=(0.0,) * 4)
    dims = Dims(displayed=(1, 2, 3), point=(1.0, 0.0, 0.0, 0.0))
    (part,) = translated([layer], Camera(), dims, SIZE).parts
    np.testing.assert_array_equal(part.scene.volume.values, values[2])
    stays = Image(dot(5, 5, 5))  # three axes beside a layer of four
    assert translated([stays], Camera(), dims, SIZE).parts[0].scene.volume.values[5, 5, 5] == 1
    dims.point = (9.0, 0.0, 0.0, 0.0)
    with pytest.raises(texvol.InputError, match="no samples at the sliders' position"):
        translated([layer], Camera(), dims, SIZE)


def test_the_finest_level_that_fits_is_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    fine, coarse = np.zeros((2, 17, 17, 17), np.float32), np.zeros((2, 9, 9, 9), np.float32)
    fine[1, 4, 6, 8], coarse[1, 2, 3, 4] = 1, 1
    layer = Image([fine, coarse], multiscale=True, scale=(1.0, 3.0, 2.0, 1.0), translate=(0.0,) * 4)
    layer.downsample_factors = np.array([[1.0, 1, 1, 1], [1, 2, 2, 2]])
    dims = Dims(displayed=(1, 2, 3), point=(1.0, 0.0, 0.0, 0.0))
    found = []
    for room in (10 * fine[0].nbytes, 10 * fine[0].nbytes - 10, 0):
        monkeypatch.setattr(translation, "free_memory", lambda room=room: room)
        made = translated([layer], Camera(), dims, SIZE)
        volume = made.parts[0].scene.volume
        at = np.array(np.unravel_index(volume.values.argmax(), volume.values.shape))[::-1]
        found.append((volume.dimensions[0], made.remarks))
        np.testing.assert_allclose(volume.origin + volume.world_from_index @ at, flips_of(Camera()) * [8, 12, 12])
    assert found == [(17, ("layer 'cells': its level 0 of 2 is drawn",))] + 2 * [
        (9, ("layer 'cells': its level 1 of 2 is drawn",))
    ]


def test_media_without_interpolation_have_none() -> None:
    layers = [Image(dot(8, 8, 8), rendering=each, interpolation3d="nearest") for each in ("translucent", "mip")]
    found = translated(layers, Camera(), Dims(), SIZE)
    assert [each.scene.volume.blocks for each in found.parts] == [True, False]
    assert [line for line in found.remarks if "nearest" in line] == ["layer 'cells': drawn linear, not nearest"]


def test_media_have_napari_s_opacities() -> None:
    """A voxel at the upper limit attenuates by exp(-attenuation), and a step of 0.8 voxels has the map's opacity."""
    values = dot(8, 8, 8)
    attenuated = Image(values, rendering="attenuated_mip", attenuation=0.3, scale=(0.5, 0.5, 0.5))
    translucent = Image(values, rendering="translucent", scale=(0.5, 0.5, 0.5))
    translucent.colormap.map = lambda fractions: np.stack([np.asarray(fractions)] * 3 + [0.4 * fractions], axis=-1)
    first, second = translated([attenuated, translucent], Camera(), Dims(), SIZE).parts
    assert first.scene.transfer_function.at(1.0)[3] * 0.5 == pytest.approx(0.3)
    assert 1 - np.exp(-second.scene.transfer_function.at(1.0)[3] * 0.8 * 0.5) == pytest.approx(0.4)


def test_labels_have_the_layer_s_colours() -> None:
    labels = np.zeros((17, 17, 17), int)
    labels[:8, :, 9:] = 7
    labels[12:, 9:] = 3  # nearer to the eye
    layer = Labels(labels, colors={7: (1.0, 0.5, 0.0, 1.0)})  # 3 is hidden, as by "show selected"
    pixels = drawn(translated([layer], Camera(zoom=1.0), Dims(), SIZE), SIZE).pixels
    np.testing.assert_array_equal(pixels[8:18, 20], np.full((10, 3), (255, 128, 0)))
    assert not pixels[:, :15].any()


def test_layers_are_blended_as_by_napari() -> None:
    below, above, half = np.full((1, 1, 3), 0.5), np.full((1, 1, 3), 0.75), np.full((1, 1), 0.5)
    expected = {"translucent": 0.625, "additive": 0.875, "minimum": 0.5, "multiplicative": 0.375, "opaque": 0.75}
    assert {name: blended(below, above, half, name)[0, 0, 0] for name in expected} == expected
    assert {blended(below, above, 0 * half, name)[0, 0, 0] for name in expected} == {0.5}  # nothing is there
    assert blended(0 * below, above, half, "minimum", is_lowest=True)[0, 0, 0] == 0.75


def test_a_layer_covers_where_its_values_are_within_the_limits() -> None:
    """Over a grey layer: black where a value is below the limits does not cover, but by blendings that add."""
    half, above = np.full((17, 17, 17), 0.5, np.float32), np.zeros((17, 17, 17), np.float32)
    above[:, :, 9:] = 0.25
    layers = [Image(half, "half"), Image(above, "above", contrast_limits=(0.1, 1.1), opacity=0.5)]
    pixels = drawn(translated(layers, Camera(zoom=1.0), Dims(), SIZE), SIZE).pixels[12, :, 0]
    assert pixels[12] == 128
    assert pixels[20] == pytest.approx(255 * (0.5 * 0.5 + 0.5 * 0.15), abs=1)  # of two pictures of 8 bits
    layers[1].rendering, layers[1].contrast_limits = "minip", (-1.0, 0.2)
    assert drawn(translated(layers, Camera(zoom=1.0), Dims(), SIZE), SIZE).pixels[12, 20, 0] == 128


def test_the_error_is_of_the_contrast_limits() -> None:
    """In another unit of the values the slabs, and the error as a fraction of the limits, are the same."""
    oblique = Camera(view_direction=(-1.0, -0.5, -0.3))
    thicknesses, errors = [], []
    for unit in (1.0, 1024.0):  # a power of two, which rounds nothing
        layer = Image(unit * dot(8, 8, 8), contrast_limits=(0.0, unit), rendering="average")
        drawing = drawn(translated([layer], oblique, Dims(), SIZE), SIZE, levels=0.25)
        assert drawing.picture is not None
        thicknesses.append(drawing.picture.settings["slab_thickness"])
        errors.append(float(drawing.lines[0].partition(" error ")[2].split()[0]))
    assert thicknesses[0] == thicknesses[1]
    assert errors[0] == pytest.approx(errors[1], rel=0.1)  # of two digits
    assert 1e-5 < errors[0] <= 0.25 / 255  # far from the rounding of float32


def test_what_is_not_drawn_is_said() -> None:
    fine = Image(dot(8, 8, 8), "fine")
    others = [
        Points(dot(1, 1, 1), "spots"),
        Image(dot(1, 1, 1), "sum", rendering="additive"),
        Image(dot(1, 1, 1), "hidden", visible=False),
        Image(dot(1, 1, 1), "cut", depiction="plane"),
        Image(np.zeros((17, 17)), "flat", scale=(1.0, 1.0), translate=(0.0, 0.0)),
        Image(dot(1, 1, 1), "photo", rgb=True),
    ]
    found = translated([fine, *others], Camera(), Dims(), SIZE)
    assert [each.name for each in found.parts] == ["fine"]
    words = {"spots": "Points", "sum": "additive", "cut": "plane", "flat": "2 axes", "photo": "rgb"}
    for name, reason in words.items():
        assert any(f"'{name}'" in line and reason in line for line in found.remarks), found.remarks
    assert "hidden" not in "".join(found.remarks)
    pictures = Dims(displayed=(0, 1), point=(0.0, 0.0))  # napari shows so if no layer has more axes
    with pytest.raises(texvol.InputError, match="'flat' is left out: it must have the three axes that are shown"):
        translated([others[4]], Camera(), pictures, SIZE)
    with pytest.raises(texvol.InputError, match="'sum' is left out"):
        translated(others, Camera(), Dims(), SIZE)
    with pytest.raises(texvol.InputError, match="there must be a visible layer"):
        translated([], Camera(), Dims(), SIZE)
    with pytest.raises(texvol.InputError, match="2D/3D"):
        translated([fine], Camera(), Dims(ndisplay=2, displayed=(1, 2)), SIZE)


def test_saved_pictures_are_what_was_shown(tmp_path) -> None:
    alone = Image(dot(8, 8, 8, 0.5))
    one = drawn(translated([alone], Camera(), Dims(), SIZE), SIZE)
    alone.blending = "additive"
    two = drawn(translated([Image(dot(3, 4, 5), "below"), alone], Camera(), Dims(), SIZE), SIZE)
    for number, drawing in enumerate((one, two)):
        drawing.save(tmp_path / f"{number}.png")
        np.testing.assert_array_equal(np.rint(image.read(tmp_path / f"{number}.png")[..., :3] * 255), drawing.pixels)
    assert two.pixels.astype(int).sum() > one.pixels.astype(int).sum()
    with pytest.raises(texvol.InputError, match="picture.bmp"):
        one.save(tmp_path / "picture.bmp")


def test_napari_s_own_layers() -> None:
    """Where napari is installed: its layers have what the stand-ins have."""
    pytest.importorskip("napari")
    from napari.components import ViewerModel

    viewer = ViewerModel(ndisplay=3)
    viewer.add_image(dot(4, 6, 11), scale=(2, 1, 1), rotate=(10, 20, 30), colormap="viridis")
    viewer.add_labels(dot(4, 6, 11).astype(int))
    viewer.camera.angles, viewer.camera.zoom = (20, 30, 40), 4.0
    viewer.camera.center = viewer.layers[0].data_to_world((4, 6, 11))
    found = translated(viewer.layers, viewer.camera, viewer.dims, SIZE)
    assert [each.blending for each in found.parts] == [layer.blending for layer in viewer.layers]
    assert drawn(found, SIZE).pixels[11:13, 15:17].max(axis=-1).min() > 128  # the voxel is in the middle
