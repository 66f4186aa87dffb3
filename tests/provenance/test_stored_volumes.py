"""Masks, further volumes, labels and colours in a header: found again as they were, or one line says why not."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.scenes import BONE, FOG, random_volume

from texvol.__main__ import main
from texvol.comparison.pictures import read_picture
from texvol.formats.pictures.scene_metadata import ATTRIBUTE, checksum_of, scene_metadata
from texvol.provenance.stored_scene import StoredScene, stored_scene_of
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.mask import Mask
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

SIZE = (24, 20)
FIRST, SECOND = random_volume(3), random_volume(4, (5, 6, 4))
LABELS = np.rint(3 * random_volume(5, (6, 5, 4)).values).astype(np.uint8)
TURN = "0.8,-0.6,0,3,0.6,0.8,0,-1,0,0,1.5,0.25"
LINE = [
    *("render", "first.npy", "-o", "picture.exr", "--size", "24x20", "--transform", TURN, "--mask", "mask.npy:0.2,0.9"),
    *("--add", "second.npy", "--add-tf", "fog", "--add-spacing", "1,2,1.5", "--add-mask", "second_mask.npy"),
    *("--add", "labels.npy", "--add-labels", "--add-transform", "1,0,0,5,0,1,0,0,0,0,1,0"),
]


@pytest.fixture(scope="module")
def drawn_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with volumes and masks, and with a picture of all of them; no test changes it."""
    there = tmp_path_factory.mktemp("drawn once")
    np.save(there / "first.npy", FIRST.values)
    np.save(there / "mask.npy", random_volume(6).values)
    np.save(there / "second.npy", SECOND.values)
    np.save(there / "second_mask.npy", (SECOND.values > 0.3).astype(np.uint8))
    np.save(there / "labels.npy", LABELS)
    with contextlib.chdir(there):
        assert main(LINE) == 0
    return there.rename(there.with_name("drawn elsewhere"))  # the header has the absolute paths, which lead nowhere now


@pytest.fixture
def drawn(drawn_once: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with the same files."""
    shutil.copytree(drawn_once, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def stored(path: str = "picture.exr", **options: Any) -> StoredScene:
    return stored_scene_of(read_picture(path).attributes, name=path, **options)


def test_all_volumes_and_masks_are_found_again_where_they_were(drawn: Path) -> None:
    found = stored()
    scene = found.scene
    rows = np.array([*map(float, TURN.split(",")), 0, 0, 0, 1]).reshape(4, 4)
    np.testing.assert_allclose(scene.volume.world_from_index, rows[:3, :3], atol=1e-15)
    np.testing.assert_array_equal(scene.volume.origin, rows[:3, 3])
    assert scene.mask is not None
    fractions = np.clip((random_volume(6).values.astype(np.float64) - 0.2) / (0.9 - 0.2), 0, 1)
    np.testing.assert_array_equal(scene.mask.array, fractions.astype(np.float32))
    second, labels = scene.added
    np.testing.assert_array_equal(second.volume.spacing, (1, 2, 1.5))
    assert second.mask is not None and second.transfer_function is not None
    np.testing.assert_array_equal(second.mask.array, SECOND.values > 0.3)
    assert labels.volume.labels and not second.volume.labels
    np.testing.assert_array_equal(labels.volume.origin, (5, 0, 0))
    with Renderer() as renderer:
        again = renderer.render(scene, SIZE, **found.settings)
    picture = read_picture("picture.exr").pixels
    assert picture[..., 3].any()
    np.testing.assert_array_equal(again, picture)


def test_they_are_found_beside_the_picture(drawn: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    there = drawn / "there"
    there.mkdir()
    for name in ("first", "mask", "second", "second_mask", "labels"):
        os.rename(drawn / f"{name}.npy", there / f"{name}.npy")
    scene = stored(folder=there).scene
    assert scene.mask is not None and scene.added[0].mask is not None
    names = [scene.volume.name, scene.mask.name, scene.added[0].mask.name, *(each.volume.name for each in scene.added)]
    assert {str(Path(name).parent) for name in names} == {str(there)}


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("mask", random_volume(7).values, ("the mask of the scene in its header", "other weights")),
        ("mask", random_volume(6, (9, 8, 6)).values, ("the mask of the scene", "9 x 8 x 6", "9 x 8 x 7")),
        ("mask", None, ("the mask of the scene", "'mask.npy', which is neither here")),
        ("second", SECOND.values + 1, ("added volume 1 of the scene in its header", "other values")),
        ("second", SECOND.values[1:], ("added volume 1 of the scene", "5 x 6 x 4 samples", "5 x 6 x 3")),
        ("second", None, ("added volume 1 of the scene", "'second.npy', which is neither here")),
        ("second_mask", np.ones_like(SECOND.values), ("the mask of added volume 1 of the scene", "other weights")),
        ("labels", LABELS + 0.5, ("added volume 2 of the scene", "whole")),
        ("labels", LABELS[:, ::-1], ("added volume 2 of the scene", "other values")),
    ],
)
def test_what_has_changed_is_refused_by_name(drawn: Path, name: str, values: Any, words: tuple[str, ...]) -> None:
    Path(f"{name}.npy").unlink()
    if values is not None:
        np.save(f"{name}.npy", values)
    with pytest.raises(InputError) as caught:
        stored()
    message = str(caught.value)
    assert message.startswith("picture.exr: ") and "\n" not in message
    assert all(word in message for word in words), message


def test_another_place_of_an_added_volume_is_refused(drawn: Path) -> None:
    text = read_picture("picture.exr").attributes[ATTRIBUTE]
    metadata = json.loads(text)
    metadata["added"][1]["source"].pop("transform")
    with pytest.raises(InputError, match="added volume 2 of the scene in its header needs a volume of origin 5, 0, 0"):
        stored_scene_of({ATTRIBUTE: json.dumps(metadata)}, name="p")


IN_MEMORY = Scene(
    FIRST,
    BONE,
    mask=Mask(FIRST.values > 0.5, "a mask"),
    added=(AddedVolume(SECOND, FOG, Mask(SECOND.values, "other")),),
    classification="slab",
)


def test_what_has_no_file_has_to_be_given() -> None:
    text = scene_metadata("noise", IN_MEMORY, checksum=True)[ATTRIBUTE]
    given: dict[str, Any] = {"volume": FIRST}
    with pytest.raises(InputError, match="p: the mask of the scene in its header has no file, 'a mask': give"):
        stored_scene_of({ATTRIBUTE: text}, name="p", **given)
    given["mask"] = IN_MEMORY.mask
    with pytest.raises(InputError, match="p: added volume 1 of .* without a file, 'noise 4': give the volume"):
        stored_scene_of({ATTRIBUTE: text}, name="p", **given)
    with pytest.raises(InputError, match="p: the mask of added volume 1 of .* has no file, 'other': give"):
        stored_scene_of({ATTRIBUTE: text}, name="p", **given, added=[SECOND])
    found = stored_scene_of({ATTRIBUTE: text}, name="p", **given, added=IN_MEMORY.added).scene
    assert found.mask is IN_MEMORY.mask and found.added[0].mask is IN_MEMORY.added[0].mask
    assert found.added[0].volume is SECOND
    wrong = {"mask": Mask(FIRST.values > 0.4)}
    with pytest.raises(InputError, match="other weights than those of mask"):
        stored_scene_of({ATTRIBUTE: text}, name="p", **given | wrong, added=IN_MEMORY.added)


@pytest.mark.parametrize(
    ("drawn_as", "given_as", "words"),
    [
        ({"labels": True}, {}, "of labels, got values in volume"),
        ({}, {"labels": True}, "of values, got labels in volume"),
        ({"colors": np.ones((4, 5, 6, 3))}, {}, "of colors, got values in volume"),
        ({"colors": np.ones((4, 5, 6, 3))}, {"colors": np.zeros((4, 5, 6, 3))}, "other values"),
    ],
)
def test_what_samples_are_is_part_of_a_volume(drawn_as: dict[str, Any], given_as: dict[str, Any], words: str) -> None:
    text = scene_metadata("v", Scene(Volume(LABELS, **drawn_as), classification="slab"), checksum=True)[ATTRIBUTE]
    with pytest.raises(InputError, match=words):
        stored_scene_of({ATTRIBUTE: text}, name="p", volume=Volume(LABELS, **given_as))
    assert stored_scene_of({ATTRIBUTE: text}, name="p", volume=Volume(LABELS, **drawn_as))


def test_a_volume_that_is_moved_twice_is_found_where_it_went(drawn: Path) -> None:
    from texvol import load

    shift, turn = np.eye(4), np.eye(4)
    shift[:3, 3] = 1, 2, 3
    turn[:2, :2] = [[0, -1], [1, 0]]
    scene = Scene(load("first.npy").moved(shift).moved(turn), classification="slab")
    np.testing.assert_array_equal(scene.volume.origin, (-2, 1, 3))
    found = stored_scene_of({ATTRIBUTE: scene_metadata("first.npy", scene)[ATTRIBUTE]}, name="p").scene.volume
    np.testing.assert_allclose(found.origin, (-2, 1, 3), atol=1e-12)
    np.testing.assert_allclose(found.world_from_index, turn[:3, :3], atol=1e-12)


def test_what_is_moved_without_a_file_has_no_source() -> None:
    assert not FIRST.moved(np.eye(4)).source


def _wrong() -> Iterator[tuple[str, list[Any], Any, str]]:
    yield "a mask as text", ["mask"], "m.npy", "the mask that must be an object"
    yield "a mask without a name", ["mask", "name"], None, "the mask of the scene in its header lacks name"
    yield "a mask with more", ["mask", "shape"], 3, "unknown key 'shape'"
    yield "a fade as text", ["mask", "source", "fade"], "wide", "must be 2 numbers, got 'wide'"
    yield "a fade of nothing", ["mask", "source", "fade"], [1, 1], "fade must be two different finite numbers"
    yield "a source as text", ["mask", "source"], "m.npy", "must be an object"
    yield "volumes as text", ["added"], "second.npy", "added must be a list"
    yield "a volume as text", ["added", 0], "second.npy", "added volume 1 that must be an object"
    yield "a volume with more", ["added", 0, "size"], 3, "unknown key 'size'"
    yield "a volume without its place", ["added", 1, "spacing"], None, "added volume 2 of the scene .* lacks spacing"
    yield "matter as text", ["added", 0, "transfer_function"], "fog", "transfer function"
    yield "another kind", ["added", 1, "kind"], "vectors", "must be labels or blocks or colors, got 'vectors'"
    yield "no kind", ["added", 1, "kind"], None, "of values, got labels in labels.npy"
    yield "half a transform", ["source", "transform"], [[1, 0, 0, 0]], "must be 4 rows of numbers"
    yield "a flat transform", ["source", "transform"], np.diag([1, 1, 0, 1]).tolist(), "must not be singular"
    yield "no number", ["source", "transform"], [[1, 0, 0, "x"]] * 4, "must be a number"
    yield "a switch as a number", ["added", 1, "source", "labels"], 1, "labels has the wrong type: 1"


WRONG = list(_wrong())


@pytest.mark.parametrize(("keys", "value", "words"), [each[1:] for each in WRONG], ids=[each[0] for each in WRONG])
def test_a_wrong_header_is_one_line(drawn: Path, keys: list[Any], value: Any, words: str) -> None:
    metadata = json.loads(read_picture("picture.exr").attributes[ATTRIBUTE])
    at = metadata
    for key in keys[:-1]:
        at = at[key]
    if value is None:
        del at[keys[-1]]
    else:
        at[keys[-1]] = value
    with pytest.raises(InputError, match=words) as caught:
        stored_scene_of({ATTRIBUTE: json.dumps(metadata)}, name="p")
    assert str(caught.value).startswith("p: ") and "\n" not in str(caught.value) and len(str(caught.value)) < 500


# What tells values apart.


@pytest.mark.parametrize("dtype", ["u1", "i2", "f2", "f4", "f8", "u8"])
def test_a_checksum_tells_values_apart(dtype: str) -> None:
    values = (np.arange(60) % 50).reshape(3, 4, 5).astype(dtype)
    other = values.copy()
    other[1, 2, 3] += 1
    assert checksum_of(Volume(values)) == checksum_of(Volume(values.copy())) != checksum_of(Volume(other))
    assert checksum_of(Volume(values.astype(f">{dtype}"))) == checksum_of(Volume(values))


def test_a_checksum_tells_masks_apart() -> None:
    weights = random_volume(8).values
    assert checksum_of(Mask(weights)) == checksum_of(Mask(weights.copy())) != checksum_of(Mask(1 - weights))
    assert checksum_of(Mask(weights > 0.5)) != checksum_of(Mask(weights <= 0.5))
