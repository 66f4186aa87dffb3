"""Camera moves: matter follows the hand, what is under the cursor stays, and one goes through the volume."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.window import navigation
from texvol.window.navigation import AXES, Position, View

VOLUME = Volume(np.zeros((20, 30, 40), np.uint8), spacing=(1.0, 2.0, 0.5), origin=(100.0, -50.0, 7.0))
ASPECT = 4 / 3
angles = st.floats(-3, 3)
positions = st.tuples(st.floats(-1.3, 1.3), st.floats(-1, 1))
views = st.sampled_from(["orthographic", "perspective"]).map(lambda kind: view_of(kind))
# Positions are worked out in float64 from numbers of about 1e2 in a few dozen operations.
ROUNDING = 1e-9


def view_of(projection: Any) -> View:
    return View.of(Camera.framing(VOLUME, projection, aspect=ASPECT))


def seen_at(view: View, point: Any) -> NDArray[np.float64]:
    """Where a point of the world is in the picture, in half heights from its middle."""
    camera = view.camera
    right, up, depth = camera.in_eye_space(np.zeros((1, 3)), np.asarray(point, np.float64))[0]
    scale = camera.half_height if camera.projection == "orthographic" else camera.half_height * depth
    return np.array([right, up]) / scale


def under(view: View, position: Position) -> NDArray[np.float64]:
    """The point of the world that is seen there, at the pivot's depth."""
    camera = view.camera
    middle = np.array(camera.eye) + view.pivot_depth * camera.forward
    return np.asarray(middle + (position[0] * camera.right + position[1] * camera.upward) * view.half_height)


@given(views, st.booleans(), angles, angles)
def test_a_turn_keeps_the_pivot_and_every_distance(view: View, free: bool, right: float, up: float) -> None:
    pivot = VOLUME.centre + (3, -2, 1)
    view = navigation.with_pivot(view, pivot)
    turned = navigation.orbit(view, right, up, free=free)
    assert np.allclose(seen_at(turned, pivot), seen_at(view, pivot), atol=ROUNDING)
    for name in ("eye", "target"):
        before, after = (np.linalg.norm(np.subtract(getattr(each.camera, name), pivot)) for each in (view, turned))
        assert after == pytest.approx(before, rel=1e-12)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("hand", [(0.1, 0.0), (-0.1, 0.0), (0.0, 0.1), (0.0, -0.1)])
def test_matter_before_the_pivot_follows_the_hand(projection: str, free: bool, hand: Position) -> None:
    view = view_of(projection)
    nearer = np.array(view.pivot) - 3 * view.camera.forward
    moved = seen_at(navigation.orbit(view, *hand, free=free), nearer) - seen_at(view, nearer)
    assert moved @ hand > 0
    # And hardly to the side.
    assert abs(moved[0] * hand[1] - moved[1] * hand[0]) < 0.2 * abs(moved @ hand)


@given(st.lists(st.tuples(angles, angles), max_size=20))
def test_on_a_turntable_up_stays_up(turns: list[Position]) -> None:
    view = view_of("perspective")
    for right, up in turns:
        view = navigation.orbit(view, right, up)
        assert view.camera.up == (0, 0, 1)
        # The axis is never seen upside down, nor tilted.
        assert view.camera.upward[2] > 0
        assert abs(view.camera.right[2]) < 1e-6


@given(views, positions, positions)
def test_what_is_grasped_follows_the_hand_when_it_moves(view: View, start: Position, end: Position) -> None:
    point = under(view, start)
    moved = navigation.pan(view, end[0] - start[0], end[1] - start[1])
    assert np.allclose(seen_at(moved, point), end, atol=ROUNDING)
    assert moved.pivot == view.pivot


@given(views, positions, st.floats(0.5, 2))
def test_what_is_under_the_cursor_stays_when_one_comes_nearer(view: View, position: Position, factor: float) -> None:
    point = under(view, position)
    nearer = navigation.dolly(view, factor, position, VOLUME)
    assert np.allclose(seen_at(nearer, point), position, atol=1e-7)
    # And grows by the factor.
    aside = point + 1e-3 * view.camera.right
    sizes = [np.linalg.norm(seen_at(each, aside) - seen_at(each, point)) for each in (view, nearer)]
    if view.camera.projection == "orthographic":
        assert sizes[1] == pytest.approx(sizes[0] / factor, rel=1e-6)
    elif abs(factor - 1) > 1e-9:  # rounding is larger than the effect of a smaller step
        assert (sizes[1] > sizes[0]) == (factor < 1)


def test_one_comes_into_the_volume_and_out_of_it_on_the_other_side() -> None:
    view = view_of("perspective")
    forward = view.camera.forward
    direction = []
    for _ in range(60):
        view = navigation.dolly(view, 1 / 1.15, (0.0, 0.0), VOLUME)
        direction.append(float(forward @ (np.array(view.camera.eye) - VOLUME.centre)))
        # One always turns about something ahead.
        assert view.camera.forward @ np.subtract(view.pivot, view.camera.eye) > 0
    steps = np.diff([*direction])
    assert direction[0] < -VOLUME.radius < 0 < VOLUME.radius < direction[-1]
    # A wheel never sticks, and never leaps: no step is longer than the first, nor shorter than a 40th of the box.
    assert (steps > VOLUME.radius / 40).all()
    assert (np.diff(steps) < 1e-9).all()


@given(views, st.floats(-10, 10))
def test_rolling_turns_the_picture_counterclockwise(view: View, angle: float) -> None:
    point = np.array(view.pivot) + view.camera.right
    before, after = (seen_at(each, point) for each in (view, navigation.roll(view, angle)))
    turned = np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0])
    assert np.exp(1j * turned) == pytest.approx(np.exp(1j * angle), abs=1e-9)


@given(st.floats(navigation.LEAST_FOV, navigation.LARGEST_FOV))
def test_another_angle_of_view_keeps_the_size_at_the_pivot(fov: float) -> None:
    view = view_of("perspective")
    aside = np.array(view.pivot) + view.camera.upward
    other = navigation.with_fov(view, fov)
    assert other.camera.fov == fov
    assert np.allclose(seen_at(other, aside), seen_at(view, aside), rtol=1e-9)


@given(views, angles, angles, st.floats(0.1, 2))
def test_the_other_projection_keeps_the_size_at_the_pivot_and_the_whole_box(
    view: View, right: float, up: float, nearer: float
) -> None:
    # Also from within the box.
    view = navigation.dolly(navigation.orbit(view, right, up), nearer, (0.0, 0.0), VOLUME)
    other = {"orthographic": "perspective", "perspective": "orthographic"}[view.camera.projection]
    changed = navigation.with_projection(view, other, VOLUME)  # type: ignore[arg-type]
    assert changed.camera.projection == other
    aside = np.array(view.pivot) + view.camera.upward
    assert np.allclose(seen_at(changed, aside), seen_at(view, aside), rtol=1e-9)
    if other == "orthographic":
        depths = changed.camera.in_eye_space(VOLUME.corners_from_centre, VOLUME.centre)[:, 2]
        assert (depths > 0).all()
    back = navigation.with_projection(changed, view.camera.projection, VOLUME)
    assert np.allclose(seen_at(back, aside), seen_at(view, aside), rtol=1e-9)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("axis", AXES)
def test_from_each_axis_the_whole_box_is_seen(projection: str, axis: str) -> None:
    view = navigation.along_axis(view_of(projection), axis, VOLUME, ASPECT)
    assert np.allclose(view.camera.forward, -np.array(AXES[axis][0]), atol=1e-12)
    assert np.allclose(view.camera.upward, AXES[axis][1], atol=1e-12)
    corners = [seen_at(view, VOLUME.centre + corner) for corner in VOLUME.corners_from_centre]
    reach = np.abs(corners).max(axis=0)
    assert reach[0] <= ASPECT and reach[1] <= 1
    # With no more air around it than a framed picture has.
    assert max(reach[0] / ASPECT, reach[1]) == pytest.approx(1 / 1.05, rel=1e-9)


@given(views, angles, angles)
def test_the_whole_box_is_framed_from_here(view: View, right: float, up: float) -> None:
    turned = navigation.pan(navigation.orbit(view, right, up), 0.7, 0.2)
    framed = navigation.framed(turned, VOLUME, ASPECT)
    assert np.allclose(framed.camera.forward, turned.camera.forward, atol=1e-9)
    corners = np.abs([seen_at(framed, VOLUME.centre + corner) for corner in VOLUME.corners_from_centre])
    assert corners[:, 0].max() <= ASPECT and corners[:, 1].max() <= 1


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_reset_is_the_camera_of_render(projection: str) -> None:
    view = navigation.orbit(view_of(projection), 1.0, 0.5)
    assert navigation.reset(view, VOLUME, ASPECT).camera == Camera.framing(VOLUME, projection, aspect=ASPECT)  # type: ignore[arg-type]


@given(views, st.lists(st.tuples(st.integers(0, 7), st.floats(-1, 1), st.floats(-1, 1)), max_size=40))
def test_no_moves_lead_to_a_view_that_is_none(view: View, moves: list[tuple[int, float, float]]) -> None:
    kinds = (
        lambda v, a, b: navigation.orbit(v, 3 * a, 3 * b),
        lambda v, a, b: navigation.orbit(v, 3 * a, 3 * b, free=True),
        lambda v, a, b: navigation.pan(v, a, b),
        lambda v, a, b: navigation.dolly(v, float(np.exp(2 * a)), (b, a), VOLUME),
        lambda v, a, b: navigation.advance(v, a, VOLUME),
        lambda v, a, b: navigation.roll(v, a),
        lambda v, a, b: navigation.with_fov(v, 150 * abs(a)),
        lambda v, a, b: navigation.with_projection(v, "perspective" if a > 0 else "orthographic", VOLUME),
    )
    for kind, a, b in moves:
        view = kinds[kind](view, a, b)  # a Camera refuses what is none
        assert np.isfinite(view.camera.eye_from_world).all()
        assert view.pivot_depth > 0
