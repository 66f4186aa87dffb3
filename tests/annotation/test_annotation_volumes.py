"""Annotation of several volumes, labels and colours: a box for each, axes around all, a legend for each that fits."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.annotated import coverage, crooked, outside, projected
from support.scenes import BONE, FOG

from texvol.annotation import Annotation, with_room
from texvol.annotation.drawing import place_all
from texvol.annotation.legend_content import contents_of
from texvol.annotation.lettering import Lettering
from texvol.annotation.sheet import Sheet
from texvol.annotation.view import View
from texvol.scene import transfer
from texvol.scene.added_volume import AddedVolume, common_box
from texvol.scene.camera import Camera
from texvol.scene.channel import Channel
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

SIZE = (600, 500)
FIRST = crooked("straight")  # from (-32.5, 10, 98) on, 40 x 36 x 28 mm
MOVED = Volume(FIRST.values, (3, 3, 3), (30, 20, 110), [[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]], name="PET.nii")
TWO = Scene(FIRST, BONE, added=(AddedVolume(MOVED, FOG),), classification="slab")
COUNTS = np.arange(64) % 20
LABELS = Volume(COUNTS.reshape(4, 4, 4), labels=True, name="organs.nrrd")
RGB = Volume(np.ones((4, 4, 4)), colors=np.full((4, 4, 4, 3), 0.5), name="photo.tif")


def placed(scene: Scene, size: tuple[int, int] = SIZE, em: float | None = None, **parts: Any) -> Sheet:
    """A sheet with the parts in their places."""
    sheet = Sheet(size, Lettering(), scene.background, em=em)
    place_all(sheet, View(scene.completed(size).camera, scene.box, size), scene, Annotation(**parts), None)
    return sheet


def contents(scene: Scene, name: str = "") -> list[Any]:
    return contents_of(scene, name, None, Lettering())


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_each_volume_has_its_own_box(projection: Any) -> None:
    camera = outside(common_box(TWO.volumes), projection, SIZE[0] / SIZE[1])
    scene = Scene(FIRST, BONE, camera, added=TWO.added, classification="slab")
    covered = coverage(scene, SIZE, box=True)
    for volume in scene.volumes:
        found = []
        for corner in range(8):
            for axis in range(3):
                ends = volume.corners_from_centre[[corner & ~(1 << axis), corner | 1 << axis]] + volume.centre
                positions = projected(
                    ends[0] + np.linspace(0.02, 0.98, 60)[:, np.newaxis] * (ends[1] - ends[0]), camera, SIZE
                )
                column, row = np.floor(positions).astype(int).T
                found.append(covered[row, column].min())
        # The three edges behind the matter of an opaque picture are hidden: each was looked at from both ends.
        assert (np.array(found) > 0.2).sum() >= 18
    alone = coverage(Scene(FIRST, BONE, camera, classification="slab"), SIZE, box=True)
    assert (covered > 0).sum() > 1.5 * (alone > 0).sum()


def test_axes_stand_around_all_volumes_in_the_words_of_the_first() -> None:
    low, high = (np.array(each) for each in zip(*[_ends(volume) for volume in TWO.volumes], strict=True))
    assert high[1, 0] > high[0, 0] + 20  # the second reaches farther along x
    scene = Scene(FIRST, BONE, added=TWO.added, classification="slab")
    texts = placed(scene, axes=True).texts
    assert "x (mm)" in texts
    numbers = [float(text.replace("−", "-")) for text in texts if "(" not in text]
    assert max(number for number in numbers if number < low.max() + 60) > high[0, 0]


def _ends(volume: Volume) -> tuple[np.ndarray, np.ndarray]:
    corners = volume.corners_from_centre + volume.centre
    return corners.min(axis=0), corners.max(axis=0)


def test_there_is_a_legend_for_each_volume_called_after_its_file() -> None:
    first, second = contents(TWO)
    assert (first.caption, second.caption) == ("straight", "PET.nii")
    medium = TWO.added[0].transfer_function
    assert medium is not None
    np.testing.assert_allclose(second.bar.colors(np.array([0.6])), medium.at(np.array([0.6]))[:, :3])
    assert [content.caption for content in contents(TWO, "HU")] == ["HU", "PET.nii"]
    texts = placed(TWO, legend=True).texts
    assert {"straight", "PET.nii"} <= set(texts) and texts.count("opacity of") == 2


def test_channels_of_one_file_are_told_apart() -> None:
    two = [Volume(FIRST.values, name="a/cell.tif", source={"path": "a/cell.tif", "channel": c}) for c in (0, 1)]
    found = contents(Scene(two[0], FOG, added=(AddedVolume(two[1], FOG),), classification="slab"))
    assert [content.caption for content in found] == ["channel 0, cell.tif", "channel 1, cell.tif"]


def test_channels_are_called_as_their_file_calls_them_and_the_first_as_the_others() -> None:
    """A reader notes the number of the first channel only if it was asked for."""
    made = [Volume(FIRST.values, name="a/cell.tif", source={"path": "a/cell.tif"}) for _ in range(3)]
    for number, (volume, name) in enumerate(zip(made, ("DAPI", "", "actin"), strict=True)):
        volume.channel = Channel(number, name)
    further = tuple(AddedVolume(each, FOG) for each in made[1:])
    found = contents(Scene(made[0], FOG, added=further, classification="slab"))
    assert [content.caption for content in found] == ["DAPI, cell.tif", "channel 1, cell.tif", "actin, cell.tif"]


def test_a_file_whose_name_the_font_lacks_is_counted() -> None:
    strange = Volume(FIRST.values, name="\U00012000.nii")
    found = contents(Scene(FIRST, FOG, added=(AddedVolume(strange, FOG),), classification="slab"))
    assert [content.caption for content in found] == ["straight", "volume 2"]


def test_colours_have_no_legend_and_leave_its_room_to_the_picture() -> None:
    assert not contents(Scene(RGB, classification="slab"))
    assert [each.caption for each in contents(Scene(RGB, added=(AddedVolume(FIRST, FOG),), classification="slab"))] == [
        "straight"
    ]
    assert not placed(Scene(RGB, classification="slab"), legend=True).texts
    camera = Camera.framing(RGB, aspect=SIZE[0] / SIZE[1])
    same = [
        with_room(camera, Scene(RGB, classification="slab"), SIZE, Annotation(**parts))
        for parts in ({"title": "t"}, {"title": "t", "legend": True})
    ]
    assert same[0] == same[1]


def test_labels_are_named_by_number_in_their_colours() -> None:
    look = transfer.labels.label_function(LABELS, {3: 0.0, 7: 1.0}, {5: (0.25, 0.5, 1.0)})
    [content] = contents(Scene(LABELS, look, classification="slab"))
    names = [name for name, _ in content.entries]
    assert names == [str(label) for label in range(1, 20) if label != 3]  # 0 and 3 are transparent
    colors = dict(content.entries)
    np.testing.assert_allclose(colors["5"], (0.25, 0.5, 1.0))
    np.testing.assert_allclose(colors["9"], look.at(np.array([9.0]))[0, :3])
    assert content.bar is None and content.caption == "label"
    assert contents(Scene(LABELS, look, classification="slab"), "organ")[0].caption == "organ"


def test_very_many_labels_are_named_too() -> None:
    many = Volume(np.arange(1000).reshape(10, 10, 10), labels=True)
    [content] = contents(Scene(many, classification="slab"))
    assert [name for name, _ in content.entries] == [str(label) for label in range(1, 1000)]
    texts = placed(Scene(many, classification="slab"), legend=True).texts
    named = [text for text in texts if text.isdecimal()]
    assert named == [str(label) for label in range(1, len(named) + 1)]
    assert texts[-1] == f"and {999 - len(named)} more"


@pytest.mark.parametrize(("height", "labels"), [(1000, 19), (400, None), (200, None), (60, 0)])
def test_as_many_labels_are_named_as_fit(height: int, labels: int | None) -> None:
    sheet = placed(Scene(LABELS, classification="slab"), (height, height), legend=True)
    named = sum(text.isdecimal() for text in sheet.texts)
    assert labels is None or named == labels
    assert all(rect.top >= 0 and rect.bottom <= height and rect.right <= height for rect in sheet.written)
    if 0 < named < 19:
        assert f"and {19 - named} more" in sheet.texts
        [taken] = sheet.taken
        assert taken.bottom - taken.top > height - 4 * sheet.em  # no room for one more


def test_legends_lie_below_each_other_and_the_last_are_left_out_first() -> None:
    third = AddedVolume(Volume(FIRST.values, name="third"), BONE)
    scene = Scene(FIRST, BONE, added=(*TWO.added, third, AddedVolume(LABELS)), classification="slab")
    everything = placed(scene, (900, 900), 12.0, legend=True)
    captions = ["straight", "PET.nii", "third", "organs.nrrd"]
    tops = [everything.written[everything.texts.index(caption)].top for caption in captions]
    assert tops == sorted(tops)
    [taken] = everything.taken
    assert taken.bottom - max(rect.bottom for rect in everything.written) < everything.em  # all that was taken is used
    for one, rect in enumerate(everything.written):
        assert not any(rect.meets(other) for other in everything.written[one + 1 :])
    shown = []
    for height in (900, 500, 400, 300, 200, 100, 60):
        texts = placed(scene, (height, height), 12.0, legend=True).texts
        there = [caption in texts for caption in captions]
        assert there == sorted(there, reverse=True)
        shown.append(sum(there))
    assert shown[0] == 4 and shown[-1] == 0 and shown == sorted(shown, reverse=True)
    assert len(set(shown)) > 2


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_with_room_all_boxes_are_beside_the_annotation(projection: Any) -> None:
    annotation = Annotation(legend=True, axes=True, scale_bar=True)
    camera = with_room(Camera.framing(TWO.box, projection, aspect=SIZE[0] / SIZE[1]), TWO, SIZE, annotation)
    scene = Scene(FIRST, BONE, camera, added=TWO.added, classification="slab")
    [legend] = placed(scene, legend=True).taken
    for volume in scene.volumes:
        positions = projected(volume.corners_from_centre + volume.centre, camera, SIZE)
        assert (positions > 0).all() and (positions[:, 0] < legend.left).all() and (positions[:, 1] < SIZE[1]).all()
