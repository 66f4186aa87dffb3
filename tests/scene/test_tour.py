"""Path of the camera through saved views: it meets each, moves smoothly, and keeps the horizon level."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from texvol.scene.camera import Camera
from texvol.scene.tour import SavedView, Tour, between
from texvol.util.errors import InputError


def seen_from(azimuth: float, elevation: float, distance: float = 10, **how: Any) -> Camera:
    """Perspective camera on a sphere about the origin, upright; angles in degrees."""
    a, e = np.radians([azimuth, elevation])
    eye = distance * np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    return Camera.perspective(tuple(eye), (0, 0, 0), (0, 0, 1), **how)


FLAT = Camera.orthographic((1, 2, 40), (0.5, 1, 0), (0, 0, 1), 30)
TILTED = Camera.perspective((3, -30, 5), (1, 1, 1), (0.3, 0.1, 1), fov=25)
ABOVE = Camera.orthographic((0, 0, 30), (0, 0, 0), (0, 1, 0), 12)
LEVEL = [seen_from(0, 30), seen_from(170, 10, 20), seen_from(90, 60, 5, fov=70), seen_from(-50, -20)]
MIXED = [LEVEL[0], FLAT, TILTED, ABOVE]
SECONDS = [1.0, 2.5, 0.5, 1.25]


def tour(cameras: list[Camera], **how: bool) -> Tour:
    views = zip(cameras, SECONDS, strict=True)
    return Tour(tuple(SavedView(f"view {n}", each, time) for n, (each, time) in enumerate(views)), **how)


WAYS = [{"closed": closed, "stops": stops} for closed in (False, True) for stops in (False, True)]


def quantities(camera: Camera) -> np.ndarray:
    """Axes of the picture, target, and logarithm of the height at the target."""
    far = camera.target_distance if camera.projection == "perspective" else 1.0
    height = np.log(2 * camera.half_height * far)
    return np.concatenate([camera.right, camera.upward, camera.forward, camera.target, [height]])


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("cameras", [LEVEL, MIXED])
def test_the_path_meets_every_view_exactly(cameras: list[Camera], way: dict[str, bool]) -> None:
    path = tour(cameras, **way)
    met = [*cameras, cameras[0]] if way["closed"] else cameras
    assert [path.at(time) for time in path.times] == met
    assert path.at(-1) == cameras[0] and path.at(path.seconds + 1) == met[-1]
    for time, camera in zip(path.times, met, strict=True):  # not only there, but on the way to it
        for near in (time - 1e-7, time + 1e-7):
            # A rate of at most a few units a second.
            np.testing.assert_allclose(quantities(path.at(near)), quantities(camera), atol=2e-6)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("cameras", [LEVEL, MIXED])
def test_the_camera_never_jerks(cameras: list[Camera], way: dict[str, bool]) -> None:
    """The velocity before a view equals that after it, and is 0 where the camera stops."""
    path, step = tour(cameras, **way), 1e-4
    for time in path.times[1:-1]:
        before, here, after = (quantities(path.at(time + sign * step)) for sign in (-1, 0, 1))
        # A jump of velocity has the size of the velocity; what the acceleration makes of it has that of the step.
        np.testing.assert_allclose((after - here) / step, (here - before) / step, atol=0.02)
        moving = np.abs((after - here) / step).max()
        assert moving < 0.01 if way["stops"] else moving > 0.1
    if not way["closed"] or way["stops"]:
        for time, toward in ((0.0, step), (path.seconds, -step)):
            assert np.abs(quantities(path.at(time + toward)) - quantities(path.at(time))).max() / step < 0.01


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("cameras", [LEVEL, MIXED])
def test_the_picture_turns_by_small_steps_only(cameras: list[Camera], way: dict[str, bool]) -> None:
    frames = [quantities(each) for each in tour(cameras, **way).cameras(500)]
    # Half a turn in half a second, eased, is 1.5 times 2 π a second at most: 0.1 a picture of these.
    assert max(np.abs(two - one)[:9].max() for one, two in pairwise(frames)) < 0.12


@pytest.mark.parametrize("way", WAYS)
def test_the_horizon_stays_level_between_upright_views(way: dict[str, bool]) -> None:
    for camera in tour(LEVEL, **way).cameras(200):
        sine = float(np.hypot(camera.right[2], camera.upward[2]))
        assert abs(camera.right[2]) < 1e-12 or sine < 0.2, "only near the pole is it let go"


def test_half_of_a_quarter_turn_is_an_eighth() -> None:
    camera = between(seen_from(0, 0), seen_from(90, 0)).at(0.5)
    np.testing.assert_allclose(quantities(camera), quantities(seen_from(45, 0)), atol=1e-14)
    assert camera.fov == pytest.approx(40) and camera.target_distance == pytest.approx(10)


def test_the_way_is_the_shorter_one() -> None:
    path = between(seen_from(170, 20), seen_from(-170, 20))
    assert all(each.eye[0] < -9 for each in path.cameras(20))


def test_perspective_becomes_orthographic_at_the_same_height() -> None:
    near, flat = seen_from(20, 10, 30), Camera.orthographic((0, 40, 3), (0, 0, 0), (0, 0, 1), height=7)
    frames = between(near, flat).cameras(1000)
    assert {each.projection for each in frames[:-15]} == {"perspective"} and frames[-1] == flat
    heights = np.exp([quantities(each)[-1] for each in frames])
    assert (np.diff(heights) < 0).all() and heights[-1] == pytest.approx(7)
    slopes = [each.half_height for each in frames if each.projection == "perspective"]
    # The eye recedes until perspective is nearly gone: no jump in the picture.
    assert (np.diff(slopes) <= 1e-12).all() and slopes[-1] < 1e-3


def test_height_and_slope_do_not_overshoot() -> None:
    cameras = [seen_from(0, 0, 10), seen_from(30, 0, 10), seen_from(60, 0, 2), seen_from(90, 0, 2)]
    heights = [quantities(each)[-1] for each in tour(cameras, stops=False).cameras(300)]
    assert max(heights) < heights[0] + 1e-12 and min(heights) > heights[-1] - 1e-12


def test_numbers_of_pictures() -> None:
    assert tour(LEVEL).seconds == 4.0 and tour(LEVEL, closed=True).seconds == 5.25
    assert tour(LEVEL).pictures(30) == 121, "both ends are seen"
    assert tour(LEVEL, closed=True).pictures(24) == 126, "the first view follows the last picture"
    assert Tour().pictures(30) == Tour((SavedView("one", FLAT),), closed=True).pictures(30) == 1


def test_pictures_are_at_equal_times_and_meet_the_views() -> None:
    path = tour(LEVEL)
    frames = path.cameras(path.pictures(20))
    assert [frames[number] for number in (0, 20, 70, 80)] == LEVEL and len(frames) == 81
    looped = tour(LEVEL, closed=True).cameras(21)  # 0.25 s apart
    assert [looped[number] for number in (0, 4, 14, 16)] == LEVEL and looped[-1] != LEVEL[0]
    assert path.cameras(1) == [LEVEL[0]]


def test_one_view_makes_no_path() -> None:
    with pytest.raises(InputError, match="at least 2 saved views are needed, got 1"):
        Tour((SavedView("alone", FLAT),)).cameras(3)


@pytest.mark.parametrize(
    "parts, message",
    [
        ({"name": ""}, "name must be one line of text, got ''"),
        ({"name": "two\nlines"}, "name must be one line"),
        ({"seconds": 0}, "seconds must be a positive number, 3600 at most, got 0"),
        ({"seconds": float("nan")}, "seconds must be"),
        ({"seconds": "2"}, "seconds must be"),
        ({"camera": None}, "camera must be a Camera"),
    ],
)
def test_what_is_no_view(parts: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(SavedView("front", FLAT), **parts)
