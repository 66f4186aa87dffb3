"""First pictures: ranges of values, exposure and side of view that suit data of which nothing is said."""

from __future__ import annotations

import numpy as np
import pytest

from texvol import Renderer, Scene, Volume
from texvol.scene.channel import Channel
from texvol.scene.framing import ViewChoice, framed
from texvol.scene.looks import look_for
from texvol.scene.transfer.presets import channel_function, proposed_in_light
from texvol.scene.transfer.units import medium_range

SIDE = 64
AXIS = np.linspace(-1, 1, SIDE)
Z, Y, X = np.meshgrid(AXIS, AXIS, AXIS, indexing="ij")
RADIUS = np.sqrt(X**2 + Y**2 + Z**2)
NOISE = np.random.default_rng(1).uniform(0, 20, RADIUS.shape)
SIZE = (64, 64)


def test_a_small_object_far_above_all_else_is_the_medium() -> None:
    """A ball in less than a thousandth of the box, which the 99.9th percentile does not see."""
    values = np.where(np.sqrt((X - 0.3) ** 2 + Y**2 + Z**2) < 0.1, 3000.0, NOISE)
    low, high = medium_range(Volume(values))
    assert NOISE.max() * 0.99 <= low <= 20 and high == 3000


def test_a_broad_background_does_not_take_the_medium_with_it() -> None:
    """The background has not fallen to a twentieth of its height where the medium's own values begin."""
    normal = np.random.default_rng(7).normal(size=RADIUS.shape)
    values = np.where(RADIUS < 0.85, 180 + 50 * normal, 60 + 20 * normal)
    low, _ = medium_range(Volume(values.clip(0)))
    assert 85 < low < 140


@pytest.mark.parametrize("kind", ["hot pixels", "a long tail"])
def test_what_is_bright_without_being_an_object_is_none(kind: str) -> None:
    if kind == "hot pixels":
        values = NOISE.copy()
        values.reshape(-1)[np.random.default_rng(2).choice(values.size, 100, replace=False)] = 3000.0
    else:
        values = np.exp(3 * np.cos(9 * X) * np.cos(8 * Y) * np.cos(7 * Z) + 4 * np.exp(-8 * RADIUS))
    low, high = medium_range(Volume(values))
    assert high == pytest.approx(np.percentile(values, 99.9), rel=0.1)
    assert low < high


def test_what_is_faint_shows_where_most_of_the_medium_is_faint() -> None:
    """Half of the medium of a thin halo around a bright core lies near the low end."""
    halo = Volume(np.where(RADIUS < 0.2, 200.0, np.where(RADIUS < 0.8, 15.0, 0.0)))
    solid = Volume(np.where(RADIUS < 0.8, 200.0, 0.0) - np.where(RADIUS < 0.2, 100.0, 0.0))
    faint, usual = (proposed_in_light(volume).values / medium_range(volume)[1] for volume in (halo, solid))
    assert 0.5 < faint[-1] / usual[-1] < 0.65


@pytest.mark.parametrize("thickness", [0.3, 0.03])
def test_light_of_a_stain_is_about_white_whatever_its_thickness(thickness: float) -> None:
    """A plate of one brightness, as seen through it from its broad side; without absorption, which is a part."""
    values = np.broadcast_to(np.where(np.abs(Z) < thickness, 1000.0, 0.0), (SIDE,) * 3)
    volume = Volume(np.where((np.abs(X) < 0.5) & (np.abs(Y) < 0.5), values, 0.0))
    channel = channel_function(volume, Channel(1))
    layers = int((np.abs(AXIS) < thickness).sum())
    light = channel.classify(np.array([1000.0])).emission.max() * layers
    assert 0.1 < light < 1.2


def test_haze_beside_a_stain_does_not_count_for_framing() -> None:
    core = 1000 * np.exp(-((RADIUS / 0.15) ** 4))
    plain, hazy = (
        Scene(Volume(values, unit="µm"), "fluorescence") for values in (core, core + 25.0 * (np.abs(Z) < 0.1))
    )
    assert framed(hazy).height == pytest.approx(framed(plain).height, rel=0.1)


def plate(thickness: float = 0.1, **told: str) -> Volume:
    """A round plate that is thin along z."""
    return Volume(np.where((X**2 + Y**2 < 0.7) & (np.abs(Z) < thickness), 100.0, 0.0), **told)


def slant(scene: Scene, axis: int, **how: ViewChoice) -> float:
    """Degrees between the view and an axis of the world."""
    return float(np.degrees(np.arccos(abs(framed(scene, **how).forward[axis]))))


def test_what_is_flat_is_seen_from_its_broad_side() -> None:
    scene = Scene(plate()).looked
    assert slant(scene, 2) == pytest.approx(35)
    turned = Scene(Volume(np.moveaxis(plate().values, 0, 2))).looked
    assert slant(turned, 0) == pytest.approx(35)


def test_what_is_long_is_not_seen_along_its_length() -> None:
    front = framed(Scene(Volume(np.where(RADIUS < 0.7, 100.0, 0.0))).looked).forward
    for across, axis in ((X**2 + Z**2, 1), (X**2 + Y**2, 2)):
        for space in ("", "right-anterior-superior"):
            rod = Scene(Volume(np.where(across < 0.03, 100.0, 0.0), space=space)).looked
            if axis == 1:
                assert slant(rod, axis) == pytest.approx(55)
            elif not space:
                np.testing.assert_allclose(framed(rod).forward, front)


def test_a_few_thin_slices_of_a_body_are_seen_from_their_broad_side() -> None:
    assert slant(Scene(plate(space="left-posterior-superior")).looked, 2) == pytest.approx(35)


def test_a_chosen_side_and_a_body_are_seen_from_the_front() -> None:
    assert slant(Scene(plate(0.3, space="left-posterior-superior")).looked, 2) > 60
    assert slant(Scene(plate()).looked, 2, choice=ViewChoice("front")) == pytest.approx(90)


def test_a_signed_distance_is_a_solid_up_to_its_surface() -> None:
    for sign in (1.0, -1.0):
        volume = Volume(sign * (RADIUS - 0.5), (AXIS[1] - AXIS[0],) * 3, (-1, -1, -1))
        look = look_for(volume)
        outside, inside = look.transfer_function.classify(np.array([sign * 0.001, sign * -0.05])).extinction
        assert outside == 0 < inside
        with Renderer() as renderer:
            opacity = renderer.render(Scene(volume), SIZE)[..., 3]
        # A disc of nine tenths of the picture, but for its border.
        assert opacity.mean() == pytest.approx(np.pi / 4 * 0.9**2, abs=0.06)
