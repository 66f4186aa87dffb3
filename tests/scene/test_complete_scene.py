"""A scene completed for a picture: camera, transfer functions and mask are settled, and wrong parts are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.scenes import FOG, random_volume

from texvol import AddedVolume, Camera, InputError, Mask, Scene
from texvol.scene.framing import framed
from texvol.scene.looks import look_for
from texvol.scene.scene import CompleteScene
from texvol.scene.transfer import preset, proposed_for

SIZE = (40, 30)


def test_what_is_left_open_is_settled() -> None:
    volume, other = random_volume(1), random_volume(2)
    complete = Scene(volume, added=(AddedVolume(other),), classification="slab").completed(SIZE)
    assert isinstance(complete, CompleteScene)
    assert complete.camera == framed(complete, aspect=4 / 3)
    assert complete.transfer_function is look_for(volume).transfer_function
    assert complete.lighting == look_for(volume).lighting
    assert complete.added[0].transfer_function is proposed_for(other)


def test_what_is_given_stays() -> None:
    volume = random_volume(1)
    camera, mask = Camera.framing(volume, "perspective"), Mask(volume.values > 0.5)
    complete = Scene(volume, FOG, camera, mask=mask, classification="slab").completed(SIZE)
    assert (complete.camera, complete.transfer_function, complete.mask) == (camera, FOG, mask)
    assert complete.volume is volume


def test_the_same_scene_and_size_give_the_same_object() -> None:
    scene = Scene(random_volume(1), classification="slab")
    complete = scene.completed(SIZE)
    assert scene.completed(SIZE) is complete and complete.completed((5, 5)) is complete
    other = scene.completed((30, 40))
    assert other.camera != complete.camera and other.transfer_function is complete.transfer_function


def test_all_classifications_have_one_camera() -> None:
    """Framing goes over all that shows, and takes longer than the picture of a large mesh."""
    scene = Scene(random_volume(1))
    slab, post = (scene.classified_as(each) for each in ("slab", "post"))
    assert slab.completed((8, 6)).camera is post.completed((8, 6)).camera
    assert slab.completed((6, 6)).camera is scene.completed((12, 12)).camera
    assert slab.completed((8, 6)).camera is not slab.completed((6, 6)).camera


def test_masked_values_are_missing_where_values_are_seen() -> None:
    volume = random_volume(1)
    mask = Mask(volume.values > 0.5)
    complete = Scene(volume, mode="mip", mask=mask, classification="slab").completed(SIZE)
    assert complete.mask is None
    np.testing.assert_array_equal(np.isnan(complete.volume.values), mask.hidden)


def test_an_isosurface_keeps_its_own_colour() -> None:
    assert (
        Scene(random_volume(1), mode="isosurface", isovalue=0.5, classification="slab")
        .completed(SIZE)
        .transfer_function
        is None
    )
    assert (
        Scene(random_volume(1), mode="mip", coloring="tf", classification="slab").completed(SIZE).transfer_function
        is not None
    )


def test_a_preset_is_welcome_by_name() -> None:
    volume = random_volume(1)
    expected = preset("fog", volume)
    for function in (
        Scene(volume, "fog", classification="slab").transfer_function,
        AddedVolume(volume, "fog").transfer_function,
    ):  # type: ignore[arg-type]
        assert function is not None
        np.testing.assert_array_equal(function.numbers, expected.numbers)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (
            {"volume": np.zeros((2, 2, 2))},
            r"scene: volume must be a Volume, got ndarray; make one of an array by texvol",
        ),
        ({"transfer_function": "ct-bon"}, "preset 'ct-bon' not found"),
        ({"transfer_function": 3}, "scene: transfer_function must be a TransferFunction, got int"),
        ({"camera": "front"}, "scene: camera must be a Camera, got str"),
        (
            {"lighting": "sun"},
            "scene: lighting must be a Lighting or one of none, head, three-point, studio",
        ),
        ({"depth_cue": 0.5}, "scene: depth_cue must be a DepthCue, got float"),
        ({"gradient": "central"}, "scene: gradient must be an Estimator, got str"),
        ({"mask": np.ones((4, 4, 4))}, "scene: mask must be a Mask, got ndarray"),
        ({"clip": [(1, 0, 0, 0)]}, "scene: each of clip must be a ClipPlane, got tuple"),
        ({"added": [3]}, "scene: each of added must be an AddedVolume, got int"),
        ({"geometry": [3]}, "scene: each of geometry must be a Mesh or Lines, got int"),
    ],
)
def test_wrong_types_are_refused_when_a_scene_is_made(parts: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Scene(**({"classification": "slab"} | ({"volume": random_volume(1)} | parts)))
