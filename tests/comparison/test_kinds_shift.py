"""Shifts are found to a hundredth of a pixel, whatever the content, the size and what the border brings in."""

from __future__ import annotations

import numpy as np
import pytest
from support import planted_differences as planted
from support.scenes import BONE, FOG, smooth_volume

from texvol.comparison.kinds import Kind, kinds_of, registration
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene

# Splines and Lagrange's polynomials differ where waves are short: `detail` has waves of some 8 pixels.
HUNDREDTH = 0.01


def waves(size: tuple[int, int], dx: float = 0.0, dy: float = 0.0, phase: float = 0.0) -> np.ndarray:
    """A closed form, moved exactly: waves of a quarter of the picture and longer, up to the border, opaque."""
    width, height = size
    x, y = np.meshgrid(np.arange(width) - dx, np.arange(height) - dy)
    side = min(size)
    parts = [
        0.5 + 0.25 * np.sin(2 * np.pi * (a * x + b * y) / side + c + phase) + 0.2 * np.cos(2 * np.pi * d * y / side)
        for a, b, c, d in ((1.3, 0.4, 0, 1.7), (-0.6, 2.1, 1, 0.5), (2.2, 1.4, 2, 3.1))
    ]
    return np.dstack([*parts, np.ones((height, width))]).astype(np.float32)


def shift_of(kinds: tuple[Kind, ...]) -> tuple[float, float]:
    assert kinds and kinds[0].name == "shifted", kinds
    return kinds[0].parameters["dx"], kinds[0].parameters["dy"]


@pytest.mark.parametrize("size", [(16, 16), (16, 24), (33, 64), (128, 100), (301, 77), (320, 240)])
@pytest.mark.parametrize("shift", [(0.1, 0.0), (-0.1, 0.37), (0.02, -0.01), (1, 0), (-2.5, 1.25)])
def test_a_closed_form_moved_exactly(size: tuple[int, int], shift: tuple[float, float]) -> None:
    found = shift_of(kinds_of(waves(size, *shift), waves(size)))
    assert found == pytest.approx(shift, abs=HUNDREDTH)


@pytest.mark.parametrize("size", [(16, 16), (64, 48), (400, 300)])
@pytest.mark.parametrize("shift", [(5.3, 0.0), (-5.3, 5.3)])
def test_a_shift_of_several_pixels_also_of_a_small_picture(size: tuple[int, int], shift: tuple[float, float]) -> None:
    found = shift_of(kinds_of(waves(size, *shift), waves(size)))
    assert found == pytest.approx(shift, abs=HUNDREDTH)


# Each pair of picture, order of the splines and shift.
MOVED = [
    (picture, order, [(0.1, 0.0), (0.25, 0.5), (-7.75, 3.5)][(i + j) % 3])
    for i, picture in enumerate(planted.PICTURES)
    for j, order in enumerate((1, 3, 5))
]


@pytest.mark.parametrize("picture, order, shift", MOVED)
def test_whatever_it_was_moved_with(picture: str, order: int, shift: tuple[float, float]) -> None:
    reference = planted.PICTURES[picture]()
    found = shift_of(kinds_of(planted.moved(*shift, order)(reference), reference))
    assert found == pytest.approx(shift, abs=HUNDREDTH)


def test_the_shift_of_a_large_picture_is_refined_in_copies_of_half_its_size(monkeypatch: pytest.MonkeyPatch) -> None:
    size = (2 * registration._LARGEST_FINE, 100)
    refined, widths = registration._refined, []
    monkeypatch.setattr(registration, "_refined", lambda one, *more: widths.append(one.shape[1]) or refined(one, *more))
    found = shift_of(kinds_of(waves(size, 0.1, -0.06), waves(size)))
    assert found == pytest.approx((0.1, -0.06), abs=HUNDREDTH)
    assert size[0] / 4 <= max(widths) <= size[0] / 2


@pytest.mark.parametrize("shift", [(0.1, 0.0), (-0.4, 0.6), (12.3, -4.1)])
@pytest.mark.parametrize("medium", [FOG, BONE], ids=["fog", "bone"])
def test_a_camera_that_looks_past_by_part_of_a_pixel(renderer, medium, shift) -> None:  # type: ignore[no-untyped-def]
    size, volume = (150, 120), smooth_volume(32)
    pixel = 2 * volume.radius / size[1]
    # Off the axes of the box, whose outline would jump from one row of pixels to the next at once.
    view, up = np.array([0.48, 0.6, -0.64]), np.array([0.36, 0.48, 0.8])
    assert abs(view @ up) < 0.1
    right = np.cross(view, up) / np.linalg.norm(np.cross(view, up))
    upwards = np.cross(right, view)
    # What is shown moves to the right and down when the camera moves to the left and up.
    by = pixel * (-shift[0] * right + shift[1] * upwards)
    cameras = [
        Camera.orthographic(target - 300 * view, target, up, height=2 * volume.radius)
        for target in (np.asarray(volume.centre), np.asarray(volume.centre) + by)
    ]
    pictures = [
        renderer.render(Scene(volume, medium, camera, classification="slab"), size, sampling_rate=2)
        for camera in cameras
    ]
    found = shift_of(kinds_of(pictures[1], pictures[0]))
    # The box's outline is not smoothed: it jumps from pixel to pixel, one in 150 along each side.
    assert found == pytest.approx(shift, abs=0.02)


def test_words_say_which_way() -> None:
    reference = planted.cloud()
    (right_up,) = kinds_of(planted.moved(0.5, -0.25)(reference), reference)
    assert "(+0.50, -0.25) pixels, right and up" in right_up.words
    (down,) = kinds_of(planted.moved(0, 0.25)(reference), reference)
    assert "(+0.00, +0.25) pixels, down" in down.words


def test_two_pictures_of_other_content_are_not_shifted() -> None:
    for seed in range(5):
        kinds = kinds_of(planted.cloud(seed=50 + seed), planted.cloud(seed=70 + seed))
        assert kinds[0].name != "shifted"


def test_what_repeats_itself_is_not_shifted_by_a_period() -> None:
    y, x = np.mgrid[:128, :128]
    reference = np.repeat((0.5 + 0.25 * np.sin(x / 9) * np.cos(y / 7))[..., None], 4, 2)
    reference[..., 3] = 1
    candidate = reference.copy()
    candidate[40:44, 50:54, :3] *= 0.5
    # Shifted by a period of 18 π the block lies outside of what both show.
    assert "shifted" not in {kind.name for kind in kinds_of(candidate, reference)}


@pytest.mark.parametrize("how", [np.float32, np.float16])
@pytest.mark.parametrize("shift", [(0.1, 0.0), (0.0, -0.3), (2.0, 0.25)])
def test_of_what_repeats_itself_the_smallest_shift_is_found(shift: tuple[float, float], how: type) -> None:
    y, x = np.mgrid[:120, :160]

    def waves(dx: float, dy: float) -> np.ndarray:
        light = 0.5 + 0.4 * np.sin((x - dx) / 9) * np.cos((y - dy) / 7)
        return np.dstack([light, light, light, np.ones_like(light)]).astype(how).astype(np.float32)

    assert shift_of(kinds_of(waves(*shift), waves(0, 0))) == pytest.approx(shift, abs=HUNDREDTH)
