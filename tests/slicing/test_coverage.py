"""Coverage of the screen: which pixels a part of the box can reach."""

import numpy as np
import pytest

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.slicing.coverage import pixel_boxes_of, pixels_of

SIZE = 60, 40
VOLUME = Volume(np.zeros((5, 6, 7), np.uint8), (1.0, 0.7, 1.3))
CAMERAS = [Camera.perspective((12.0, -9.0, 7.0), VOLUME.centre, (0.1, 0.2, 1), fov=25.0),
           Camera.orthographic((9.0, 4.0, 5.0), VOLUME.centre, (0, 0, 1), height=8.0),
           Camera.orthographic((3.0, 2.0, 30.0), (3.0, 2.0, 2.0), (0, 1, 0), height=6.0)]  # fmt: skip


def parts(count: int) -> np.ndarray:
    """Low and high corners of random boxes, shape (count, 2, 3)."""
    return np.sort(np.random.default_rng(3).uniform(size=(count, 2, 3)), axis=1)


@pytest.mark.parametrize("camera", CAMERAS)
def test_pixels_are_those_whose_rays_meet_the_part(camera: Camera) -> None:
    eyes, directions = camera.rays(SIZE)
    for part in parts(40):
        low, high = VOLUME.centre + (part - 0.5) @ VOLUME.box_edges.T
        with np.errstate(divide="ignore"):
            ends = (np.array([low, high])[:, np.newaxis, np.newaxis] - eyes) / directions
        meets = ends.min(axis=0).max(axis=-1) <= ends.max(axis=0).min(axis=-1)
        where, mask = pixels_of(VOLUME, camera, SIZE, part)
        found = np.zeros(SIZE[::-1], np.bool_)
        found[where] = mask
        assert not (meets & ~found).any()
        assert (found & ~meets).sum() <= 1, "rays that pass an edge by less than 1e-4 pixels"


@pytest.mark.parametrize("camera", CAMERAS)
def test_boxes_of_pixels_are_around_them(camera: Camera) -> None:
    for part, low, high in zip(parts(40), *pixel_boxes_of(VOLUME, camera, SIZE, parts(40)), strict=True):
        (rows, columns), _ = pixels_of(VOLUME, camera, SIZE, part)
        assert low[0] <= columns.start and columns.stop <= high[0]
        assert low[1] <= rows.start and rows.stop <= high[1]


def test_what_is_behind_the_eye_is_off_the_screen() -> None:
    camera = Camera.perspective((12.0, -9.0, 7.0), (24.0, -18.0, 14.0), (0, 0, 1), fov=60.0)
    low, high = pixel_boxes_of(VOLUME, camera, SIZE, parts(5))
    np.testing.assert_array_equal(low, high)
