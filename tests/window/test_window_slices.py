"""Slices beside the 3D view: where the views are, what a slice shows of each volume, and how the crosshair moves."""

from __future__ import annotations

import itertools
import tracemalloc
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from texvol.scene.added_volume import AddedVolume
from texvol.scene.channel import Channel
from texvol.scene.label_table import LabelEntry, LabelTable
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.labels import label_function
from texvol.scene.volume import Volume
from texvol.window import layout as layouts
from texvol.window import probe
from texvol.window.commands import is_command
from texvol.window.layout import NAMES, PICTURE, VIEWS, Layout, rectangles
from texvol.window.panels import readout
from texvol.window.screen import enlarged
from texvol.window.slice_layers import FINE, Colors, further_layer, hue_of
from texvol.window.slice_layers import first_layer as first_picture
from texvol.window.slice_views import Plane, SliceView, cut_of, layer_corners
from texvol.window.slices import slices_of
from texvol.window.steering import Viewport

AREA = Viewport(0, 0, 920, 801)
SOLID = TransferFunction([0.0, 100.0], [[0, 0, 0], [1, 1, 1]], [0.0, 1.0])


def turned(degrees: tuple[float, float, float]) -> np.ndarray:
    """A rotation about x, then y, then z."""
    found = np.eye(3)
    for axis, angle in enumerate(np.radians(degrees)):
        one, other = [each for each in range(3) if each != axis]
        turn = np.eye(3)
        turn[one, one] = turn[other, other] = np.cos(angle)
        turn[one, other], turn[other, one] = -np.sin(angle), np.sin(angle)
        found = turn @ found
    return found


def ramp(shape: tuple[int, int, int] = (20, 24, 28), **how: Any) -> Volume:
    """A volume that is linear in its indices, from 0 to about 100."""
    z, y, x = np.mgrid[tuple(slice(each) for each in shape)].astype(np.float32)
    return Volume(1.5 * x + y + 1.2 * z, **how)


@pytest.mark.parametrize("large", ["", *VIEWS])
@pytest.mark.parametrize("size", [(920, 801), (301, 200), (64, 640)])
def test_views_fill_the_area_and_do_not_overlap(large: str, size: tuple[int, int]) -> None:
    area = Viewport(0, 0, *size)
    found = rectangles(area, large, 2.0)
    assert set(found) == set(VIEWS)
    covered = np.zeros((size[1], size[0]), int)
    for each in found.values():
        covered[round(each.y) : round(each.y + each.height), round(each.x) : round(each.x + each.width)] += 1
    assert covered.max() == 1
    gaps = 2 * (size[0] + size[1]) * 2
    assert (covered == 0).sum() <= gaps
    areas = {name: each.width * each.height for name, each in found.items()}
    if large and size[0] > 2 * size[1] / 3:
        assert areas[large] > 2 * max(area for name, area in areas.items() if name != large)
    elif not large:
        assert max(areas.values()) - min(areas.values()) <= sum(size)


def test_the_layout_is_switched_and_a_view_is_made_large_and_small_again() -> None:
    layout = Layout()
    assert layout.arrange(AREA, 1.0, True) == AREA
    layout.become("")
    picture = layout.arrange(AREA, 1.0, True)
    assert picture != AREA and picture == layout.rectangles[PICTURE]
    assert layout.arrange(AREA, 1.0, False) == AREA, "without a scene there are no slices"
    layout.swap("coronal")
    assert layout.arrange(AREA, 1.0, True).width < picture.width
    layout.swap("coronal")
    assert layout.arrange(AREA, 1.0, True) == picture
    layout.arrange(AREA, 1.0, True, 40.0)
    assert max(each.y + each.height for each in layout.rectangles.values()) == AREA.y + AREA.height - 40
    alone = layout.arrange(AREA, 1.0, False, 40.0)
    assert alone == replace(AREA, height=AREA.height - 40), "the time bar hides nothing of a picture that is alone"
    layout.become("sagittal")
    assert layout.shown and layout.large == "sagittal"
    layout.become("2x2")
    assert layout.shown and not layout.large
    for mode in (PICTURE, PICTURE):
        layout.become(mode)
        assert not layout.shown
    assert all(is_command(f"layout {mode}".strip()) for mode in ("", *layouts.MODES)) and not is_command("layout 3x3")


@given(
    st.sampled_from(NAMES), st.tuples(st.floats(0.01, 0.99), st.floats(0.01, 0.99)), st.floats(0.3, 30),
    st.tuples(*[st.floats(-180, 180)] * 3),
)  # fmt: skip
def test_a_position_in_the_window_is_a_point_of_the_slice(
    name: str, at: tuple[float, float], zoom: float, degrees: tuple[float, float, float]
) -> None:
    volume = ramp(spacing=(1.0, 2.0, 0.5), origin=(5, -3, 70), direction=turned(degrees))
    slice_ = slices_of(volume)[name]
    plane = Plane.of(volume, slice_, 7)
    view = SliceView.of(Viewport(10, 20, 300, 200), plane, volume, zoom, volume.origin)
    x, y = 10 + 300 * at[0], 20 + 200 * at[1]
    point = view.point(x, y)
    assert view.place(*plane.position(point)) == pytest.approx((x, y), abs=1e-6)
    index = volume.index_from_world @ (point - volume.origin)
    assert index[slice_.axis] == pytest.approx(7, abs=1e-9)


def test_the_zoom_keeps_the_point_under_the_mouse_and_ends() -> None:
    volume = ramp()
    plane = Plane.of(volume, slices_of(volume)["axial"], 10)
    layout = Layout()
    layout.follow(Scene(volume, SOLID))
    for factor in (1.3, 1.3, 0.5, 4.0):
        view = SliceView.of(Viewport(0, 0, 300, 200), plane, volume, layout.zoom, layout.middle)
        under = view.point(220, 50)
        layout.magnify(factor, under, view.centre)
        after = SliceView.of(Viewport(0, 0, 300, 200), plane, volume, layout.zoom, layout.middle)
        assert after.place(*plane.position(under)) == pytest.approx((220, 50))
        assert after.scale == pytest.approx(view.scale * factor)
    layout.magnify(1e9, under, view.centre)
    assert layout.zoom == 64
    layout.reset()
    assert layout.zoom == 1 and layout.middle is None


def test_the_crosshair_stays_in_the_volume_and_in_its_slice() -> None:
    volume = ramp(spacing=(2, 1, 3), direction=turned((20, 0, 30)))
    layout = Layout()
    layout.follow(Scene(volume, SOLID))
    assert layout.index.tolist() == [13.5, 11.5, 9.5]
    layout.move_to(volume.origin + volume.world_from_index @ np.array([3.25, 4, 60]), keep=1)
    assert layout.index == pytest.approx([3.25, 11.5, 19])
    assert layout.crosshair == pytest.approx(volume.origin + volume.world_from_index @ layout.index)
    axis = layout.slices["axial"].axis
    for by, wanted in ((-4, 15), (1, 16), (99, 19), (-99, 0)):
        layout.step("axial", by)
        assert layout.index[axis] == wanted and layout.number("axial") == wanted


def test_another_volume_has_its_own_crosshair_and_the_same_samples_keep_theirs() -> None:
    volume, layout = ramp(), Layout()
    layout.follow(Scene(volume, SOLID))
    layout.step("coronal", 5)
    layout.window, layout.zoom = (3.0, 4.0), 2.0
    index = layout.index
    moved = volume.moved([[1, 0, 0, 5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    layout.follow(Scene(moved, SOLID))
    assert layout.volume is moved and (layout.index == index).all() and layout.zoom == 2
    layout.turn_to(document=moved, before=volume)  # any two objects
    layout.follow(Scene(ramp((5, 6, 7)), SOLID))
    assert layout.index.tolist() == [3, 2.5, 2] and layout.zoom == 1


def test_the_first_volume_may_go_and_come_back_and_the_crosshair_stays_in_the_world() -> None:
    """Unless the volume that is the first one then is elsewhere: a crosshair at its border would be of no use."""
    first, layout = ramp(), Layout()
    wide, away = ramp(spacing=(4, 4, 4)), ramp((5, 6, 7), origin=(900.0, 0.0, 0.0))
    layout.follow(Scene(first, SOLID, added=(AddedVolume(wide, SOLID), AddedVolume(away, SOLID))))
    layout.step("coronal", 5)
    layout.window, layout.zoom, layout.middle = (3.0, 4.0), 2.0, layout.crosshair
    point = layout.crosshair
    layout.follow(Scene(wide, SOLID))
    assert layout.crosshair == pytest.approx(point) and layout.zoom == 2 and layout.window != (3.0, 4.0)
    layout.follow(Scene(first, SOLID))  # it was hidden, no volume of the scene meanwhile
    assert layout.crosshair == pytest.approx(point) and layout.zoom == 2 and layout.window == (3.0, 4.0)
    layout.follow(Scene(away, SOLID))
    assert layout.index.tolist() == [3, 2.5, 2] and layout.zoom == 1 and layout.middle is None


def colors_at(volume: Volume, colors: Colors, points: np.ndarray) -> np.ndarray:
    """Colours of a volume at world points, by the probe, transparent outside."""
    return colors.of(probe.sampled(volume, points))


def pixels_of(picture: np.ndarray, corners: Any, plane: Plane) -> np.ndarray:
    """World positions of the middles of a picture's pixels, shape (rows, columns, 3)."""
    rows, columns = picture.shape[:2]
    start, right, _, below = (np.array(each) for each in corners)
    across, along = (np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows
    places = start + across[np.newaxis, :, np.newaxis] * (right - start)
    places = places + along[:, np.newaxis, np.newaxis] * (below - start)
    return plane.origin + places[..., :1] * plane.right + places[..., 1:] * plane.down


PLACES = {
    "same grid": {},
    "coarser and shifted": {"spacing": (3.0, 1.7, 2.0), "origin": (-7, 3, 1.3)},
    "axes swapped": {"direction": [[0, 0, -1], [1, 0, 0], [0, 1, 0]], "origin": (20, 0, 0)},
    "mirrored": {"direction": np.diag([-1.0, 1.0, -1.0]), "origin": (27, 0, 19)},
    "oblique": {"direction": turned((25, -40, 10)), "origin": (3, 4, 5), "spacing": (1.0, 0.8, 1.1)},
    "sheared": {"direction": [[1, 0.4, 0], [0, 1, 0.3], [0, 0, 1]], "origin": (-3, 0, 2)},
}


@pytest.mark.parametrize("labels", [False, True])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("where", PLACES)
def test_a_further_volume_is_where_it_is_in_the_world(where: str, name: str, labels: bool) -> None:
    first = ramp(direction=turned((0, 0, 12)))
    if where != "oblique" and where != "sheared":  # beside the first one's axes
        how = {**PLACES[where], "direction": turned((0, 0, 12)) @ np.array(PLACES[where].get("direction", np.eye(3)))}
    else:
        how = PLACES[where]
    further = ramp(**how)
    if labels:
        further = Volume(np.rint(further.values / 9).astype(np.int16), labels=True, **how)
    medium = label_function(further) if labels else SOLID
    colors = Colors(further, medium)
    slice_ = slices_of(first)[name]
    plane = Plane.of(first, slice_, 7)
    layer = further_layer(further, colors, plane, fine=True)
    assert layer is not None and layer.nearest == labels
    picture = layer.make()
    points = pixels_of(picture, layer.corners, plane).reshape(-1, 3)
    wanted = colors_at(further, colors, points).reshape(picture.shape)
    shown = picture[..., 3] > 0
    assert shown.mean() > 0.2
    picture = picture * shown[..., np.newaxis]  # what is transparent has any colour
    wanted = wanted * (wanted[..., 3:] > 0)
    # Within rounding of an index a sample may be the neighbour, or lie outside.
    differs = np.abs(picture.astype(int) - wanted).max(axis=2) > (0 if labels else 2)
    assert differs.mean() < (0.01 if where in ("oblique", "sheared") or labels else 1e-9)


def test_a_volume_beside_the_plane_has_no_picture() -> None:
    first, far = ramp(), ramp(origin=(0, 0, 500))
    plane = Plane.of(first, slices_of(first)["axial"], 7)
    assert further_layer(far, Colors(far, SOLID), plane, fine=True) is None
    assert cut_of(far, plane) is None
    assert cut_of(first, plane) == pytest.approx((-14, -12, 14, 12))


def test_an_oblique_volume_is_coarser_while_it_moves_and_never_larger_than_a_picture() -> None:
    samples = np.zeros((500, 600, 600), np.uint8)
    first, wide = ramp(), Volume(samples, origin=(-250, -250, -250), direction=turned((7, 8, 9)))
    plane = Plane.of(first, slices_of(first)["axial"], 3)
    fine, coarse = (further_layer(wide, Colors(wide, SOLID), plane, fine=each) for each in (True, False))
    assert fine is not None and coarse is not None
    assert max(fine.make().shape) == FINE > max(coarse.make().shape)
    assert fine.key != coarse.key


@pytest.mark.parametrize("degrees", [(0, 0, 0), (10, 20, 30)])
def test_only_the_plane_is_read_of_a_large_volume(degrees: tuple[float, float, float]) -> None:
    first = Volume(np.zeros((256, 256, 256), np.int16))
    further = Volume(np.zeros((256, 256, 256), np.int16), direction=turned(degrees), origin=first.centre)
    colors = Colors(further, SOLID)
    tracemalloc.start()
    try:
        for name in NAMES:
            slice_ = slices_of(first)[name]
            first_picture(first, None, slice_, 90, (50, 100)).make()
            layer = further_layer(further, colors, Plane.of(first, slice_, 200), fine=True)
            assert layer is not None
            layer.make()
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < first.values.nbytes, (
        "34 MB; a plane of 512 x 512 points takes some twelve numbers of 8 bytes for each"
    )


@pytest.mark.parametrize("direction", [np.eye(3), PLACES["sheared"]["direction"]])
def test_the_first_volume_is_grey_in_its_window_and_lies_where_its_samples_are(direction: Any) -> None:
    volume = ramp(spacing=(1, 2, 3), direction=direction)
    for name, slice_ in slices_of(volume).items():
        layer = first_picture(volume, None, slice_, 4, (50.0, 100.0))
        picture = layer.make()
        assert picture.dtype == np.uint8 and picture.ndim == 2 and not layer.nearest
        plane = Plane.of(volume, slice_, 4)
        values = probe.sampled(volume, pixels_of(picture, layer.corners, plane).reshape(-1, 3)).reshape(picture.shape)
        assert np.abs(picture - np.clip(values / 100, 0, 1) * 255).max() <= 0.51, name
        assert plane.right @ plane.down == pytest.approx(0, abs=1e-12)
        if (volume.direction != np.eye(3)).any():
            continue
        width, height = slice_.extent(volume)
        assert np.abs(np.array(layer.corners)).max(axis=0) == pytest.approx((width / 2, height / 2))
        assert layer_corners(volume, slice_, plane) == layer.corners


def test_labels_have_their_colours_and_hidden_ones_are_transparent() -> None:
    values = np.array([[[0, 3], [7, 9]]], np.uint8)
    volume = Volume(values, labels=True)
    # Linear 0.214 is seen as half: 1.055 · 0.214^(1/2.4) - 0.055 = 0.500.
    medium = label_function(volume, {7: 0.0}, {3: (1.0, 0.0, 0.0), 9: (0.0, 0.214, 1.0)})
    shown = Colors(volume, medium).of(values[0])
    assert shown[0, 1].tolist() == [255, 0, 0, 255] and shown[1, 1].tolist() == [0, 127, 255, 255]
    assert shown[0, 0, 3] == shown[1, 0, 3] == 0
    far = Volume(np.array([[[0, 5, 12_000_000]]], np.int32), labels=True)
    medium = label_function(far, None, {5: (1.0, 0.0, 0.0), 12_000_000: (0.0, 0.0, 1.0)})
    assert Colors(far, medium).of(far.values[0, 0])[1:].tolist() == [[255, 0, 0, 255], [0, 0, 255, 255]]


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.int32, np.uint64, np.float32, np.float64])
def test_values_of_any_type_have_the_colours_of_the_transfer_function(kind: Any) -> None:
    values = np.array([[[0, 25, 50, 75, 100, 120]]], kind)
    volume = Volume(values)
    red = TransferFunction([0.0, 100.0], [[1, 0, 0], [1, 0, 0]], [0.0, 2.0])
    shown = Colors(volume, red).of(values[0, 0])
    # Nine tenths at the greatest extinction: 1 - 10^(-fraction).
    wanted = 255 * -np.expm1(-np.log(10) * np.clip(values[0, 0].astype(float) / 100, 0, 1))
    assert np.abs(shown[:, 3] - wanted).max() <= 1 and (shown[:, 0] == 255).all()


def test_missing_samples_are_transparent_and_black() -> None:
    values = np.array([[[np.nan, 50.0, np.inf]]])
    volume = Volume(values)
    shown = Colors(volume, SOLID).of(values[0, 0])
    assert shown[0, 3] == 0 < shown[1, 3]
    assert first_picture(volume, None, slices_of(volume)["axial"], 0, (50, 100)).make().tolist() == [[0, 128, 255]]


def test_samples_with_colours_of_their_own_have_them() -> None:
    colors = np.zeros((1, 1, 2, 3), np.float32)
    colors[0, 0, :, 1] = 1.0
    volume = Volume(np.array([[[0.0, 100.0]]]), colors=colors)
    slice_ = slices_of(volume)["axial"]
    assert first_picture(volume, None, slice_, 0, (50, 100)).make().tolist() == [[[0, 255, 0, 0], [0, 255, 0, 255]]]
    layer = further_layer(volume, Colors(volume, SOLID), Plane.of(volume, slice_, 0), fine=True)
    assert layer is not None
    assert layer.make()[0, :, :3].tolist() == [[0, 255, 0]] * 2


def test_the_first_of_several_channels_has_its_colour() -> None:
    first, second = Volume(np.array([[[0.0, 50.0, 100.0]]])), Volume(np.array([[[0.0, 50.0, 100.0]]]))
    # Linear 0.214 is seen as half.
    orange = TransferFunction([0.0, 100.0], [[1, 0.214, 0], [1, 0.214, 0]], [0.0, 2.0])
    alone, both = Scene(first, orange), Scene(first, orange, added=(AddedVolume(second, SOLID),))
    assert hue_of(both) is None, "files of their own, such as a CT below a PET"
    first.channel, second.channel = Channel(0), Channel(1)
    assert hue_of(alone) is None
    slice_ = slices_of(first)["axial"]
    layer = first_picture(first, None, slice_, 0, (50, 100), hue_of(both))
    assert layer.make()[0].tolist() == [[0, 0, 0, 255], [128, 64, 0, 255], [255, 127, 0, 255]]
    assert layer.key != first_picture(first, None, slice_, 0, (50, 100)).key


def test_the_probe_tells_all_volumes_by_name_unit_and_position() -> None:
    table = LabelTable({7: LabelEntry("liver")})
    labels = Volume(np.full((4, 4, 4), 7, np.uint8), (10, 10, 10), labels=True, label_table=table, name="seg.nrrd")
    first = Volume(np.full((9, 9, 9), 40, np.int16), (2, 2, 2), unit="mm", value_unit="HU", name="ct.nrrd")
    scene = Scene(first, SOLID, added=(AddedVolume(labels, label_function(labels)),))
    found = probe.at_point(scene, np.array([4.0, 6.5, 1.004]))
    assert [(each.number, each.value, each.label, each.index) for each in found.all] == [
        (0, 40.0, "", (2, 3, 1)),
        (1, 7.0, "liver", (0, 1, 0)),
    ]
    assert readout.lines(scene, found, index=True) == [
        "ct.nrrd: 40 HU", "seg.nrrd: 7 liver", "at 4, 6.5, 1 mm", "sample 2, 3, 1"
    ]  # fmt: skip
    outside = probe.at_point(scene, np.array([30.0, 6.5, 1.0]))
    assert readout.lines(scene, outside)[:2] == ["ct.nrrd: outside", "seg.nrrd: 7 liver"]
    alone = replace(scene, added=())
    assert readout.lines(alone, probe.at_point(alone, np.zeros(3)))[0] == "value 40 HU"


def test_planes_of_a_volume_meet_at_right_angles_in_the_crosshair() -> None:
    volume = ramp(direction=turned((11, 22, 33)), spacing=(1, 2, 3))
    planes = [Plane.of(volume, each, 5) for each in slices_of(volume).values()]
    for one, other in itertools.combinations(planes, 2):
        assert one.normal @ other.normal == pytest.approx(0, abs=1e-12)
    assert all(np.linalg.norm(each.normal) == pytest.approx(1) for each in planes)


@pytest.mark.parametrize(("shape", "times"), [((40, 60, 4), 16), ((256, 256), 4), ((500, 400, 4), 2), ((1500, 900), 1)])
def test_labels_are_enlarged_before_they_are_interpolated(shape: tuple[int, ...], times: int) -> None:
    pixels = np.random.default_rng(3).integers(0, 255, shape).astype(np.uint8)
    found = enlarged(pixels)
    assert found.shape == (times * shape[0], times * shape[1], *shape[2:])
    for row, column in ((0, 0), (times - 1, times // 2)):
        assert np.array_equal(found[row::times, column::times], pixels)
