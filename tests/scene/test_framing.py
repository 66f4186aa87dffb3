"""Framing by what shows, and views by their names."""

from __future__ import annotations

import numpy as np
import pytest
from support.scenes import constant

import texvol
from texvol import Camera, ClipPlane, Mask, Scene, TransferFunction, Volume
from texvol.scene.framing import VIEWS, ViewChoice, framed, view_of, zoomed

SIZE = (96, 72)
SOLID = TransferFunction(np.array([0.4, 0.6]), np.ones((2, 3)), np.array([0.0, 5.0]))


def ball(
    at: tuple[float, float, float] = (0.2, -0.3, 0.25), radius: float = 0.35, side: int = 40, **told: str
) -> Volume:
    """A ball of 1 somewhere in a box of 0, which reaches from -1 to 1 along each axis."""
    axis = np.linspace(-1, 1, side)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = np.sqrt((x - at[0]) ** 2 + (y - at[1]) ** 2 + (z - at[2]) ** 2)
    spacing = axis[1] - axis[0]
    values = np.clip((radius - distance) / spacing + 0.5, 0, 1)
    return Volume(values, (spacing,) * 3, (-1, -1, -1), **told)


def filled(scene: Scene, camera: Camera, size: tuple[int, int] = SIZE) -> tuple[float, float]:
    """Fractions of the picture's width and height that hold 99 % of its opacity, from the picture itself."""
    from dataclasses import replace

    with texvol.Renderer() as renderer:
        opacity = renderer.render(replace(scene, camera=camera), size, sampling_rate=2)[..., 3].astype(np.float64)
    found = []
    for axis in (0, 1):
        sums = np.cumsum(opacity.sum(axis=axis)) / opacity.sum()
        found.append((np.searchsorted(sums, 0.995) - np.searchsorted(sums, 0.005) + 1) / sums.size)
    return found[0], found[1]


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("view", [None, *VIEWS])
def test_what_shows_fills_nine_tenths_of_the_shorter_side(projection: str, view: str | None) -> None:
    scene = Scene(ball(), SOLID, classification="post")
    choice = ViewChoice(view)
    camera = framed(scene, projection, choice=choice, aspect=SIZE[0] / SIZE[1])  # type: ignore[arg-type]
    across, above = filled(scene, camera)
    assert 0.85 <= above <= 0.95
    assert across == pytest.approx(above * SIZE[1] / SIZE[0], abs=0.03)  # a ball is as wide as high


def test_a_wide_object_fills_the_width() -> None:
    values = np.zeros((20, 20, 60))
    values[9:12, 8:12, 3:57] = 1
    scene = Scene(Volume(values), SOLID, classification="post")
    across, _ = filled(scene, framed(scene, choice=ViewChoice("front"), aspect=1.0), (64, 64))
    assert 0.85 <= across <= 0.95


def test_haze_that_nobody_sees_does_not_count() -> None:
    volume = ball(side=100)
    # From 0.4 on the medium rises by 25 for each unit: over the whole box an optical depth of 0.01.
    hazy = Scene(Volume(np.maximum(volume.values, 0.4002), volume.spacing, volume.origin), SOLID)
    clear = Scene(volume, SOLID)
    assert framed(hazy).height == pytest.approx(framed(clear).height, rel=0.05)


@pytest.mark.parametrize("kept", ["crop", "clip", "mask"])
def test_what_is_cut_away_does_not_count(kept: str) -> None:
    """The half of the box with x < 0 is cut away, and with it one of two balls."""
    two = ball((-0.6, 0, 0), 0.3).values + ball((0.6, 0, 0), 0.3).values
    volume = Volume(two, (2 / 39,) * 3, (-1, -1, -1))
    half = np.zeros(two.shape, bool)
    half[:, :, 20:] = True
    parts = {
        "crop": {"crop": ((0, 2), (-2, 2), (-2, 2))},
        "clip": {"clip": (ClipPlane((1, 0, 0), 0),)},
        "mask": {"mask": Mask(half)},
    }[kept]
    whole, part = Scene(volume, SOLID), Scene(volume, SOLID, **parts)
    camera = framed(part, choice=ViewChoice("front"))
    assert framed(whole, choice=ViewChoice("front")).height > 2.5 * camera.height
    assert camera.target[0] == pytest.approx(0.6, abs=0.03)


def test_nothing_to_see_frames_the_box() -> None:
    volume = ball()
    nothing = Scene(volume, TransferFunction(np.array([5.0, 6.0]), np.ones((2, 3)), np.array([0.0, 5.0])))
    assert framed(nothing) == Camera.framing(volume)
    assert framed(Scene(volume, SOLID), whole_box=True) == Camera.framing(volume)
    assert framed(Scene(Volume(np.full((3, 3, 3), np.nan)))).height > 0


def test_every_view_of_a_turn_holds_what_shows() -> None:
    scene = Scene(ball((0.5, 0.1, -0.2)), SOLID, classification="post")
    first = framed(scene, turning=True, aspect=SIZE[0] / SIZE[1])
    for degrees in (0, 70, 200):
        from texvol.scene.orbit import turned

        across, above = filled(scene, turned(first, degrees))
        assert 0.6 < above <= 0.95 and across < 0.95


def test_surfaces_and_projections_are_framed() -> None:
    volume = ball()
    # A surface is as opaque at its rim as in its middle, where the medium is thin: its cells reach a little farther.
    surface = framed(Scene(volume, mode="isosurface", isovalue=0.5)).height
    assert 0.7 / 0.95 < surface < 0.7 / 0.85
    assert framed(Scene(volume, mode="mip")).height > 2 * framed(Scene(volume, SOLID)).height


def test_many_samples_are_framed_as_few() -> None:
    few, many = (framed(Scene(ball(side=side), SOLID)).height for side in (40, 160))
    assert many == pytest.approx(few, rel=0.03)


@pytest.mark.parametrize(
    "space, front, right",
    [
        ("", (0, -1, 0), (1, 0, 0)),
        ("right-anterior-superior", (0, 1, 0), (1, 0, 0)),
        ("left-posterior-superior", (0, -1, 0), (-1, 0, 0)),
        ("anterior-superior-right", (1, 0, 0), (0, 0, 1)),
    ],
)
def test_views_are_those_of_the_body_where_it_is_known(
    space: str, front: tuple[int, int, int], right: tuple[int, int, int]
) -> None:
    volume = ball(space=space)
    up = np.cross(right, front) * (1 if np.cross(right, front).sum() > 0 else -1)
    for view, towards in {"front": front, "right": right, "back": np.negative(front), "top": up}.items():
        np.testing.assert_allclose(view_of(volume, ViewChoice(view))[0], towards, atol=1e-12)
    np.testing.assert_allclose(view_of(volume, ViewChoice("front"))[1], up, atol=1e-12)


def test_angles_turn_a_view() -> None:
    volume = ball()
    np.testing.assert_allclose(view_of(volume, ViewChoice("front", 90, None))[0], (1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(view_of(volume, ViewChoice(None, None, 90))[0], (0, 0, 1), atol=1e-12)
    np.testing.assert_allclose(
        view_of(volume, ViewChoice("iso"))[0], view_of(volume, ViewChoice("front", 45, 35.264389682754654))[0]
    )
    towards, up = view_of(volume, ViewChoice("left", 10, -20))
    assert abs(towards @ up) < 1e-12 and np.linalg.norm(towards) == pytest.approx(1)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_zoom_enlarges(projection: str) -> None:
    scene = Scene(ball(), constant(0.0))
    camera = framed(scene, projection)  # type: ignore[arg-type]
    assert zoomed(camera, 2).half_height == pytest.approx(camera.half_height / 2)
