"""Orientation cube: what of it lies under the mouse, and where a click turns to."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from texvol.scene.camera import Camera
from texvol.scene.framing import VIEWS, ViewChoice, view_of
from texvol.scene.volume import Volume
from texvol.window import cube, sides
from texvol.window.navigation import View

ASIDE = Camera.perspective((30, -20, 13), (5, 5, 5), (0, 0.2, 1))
PICKS = [each for each in product((-1, 0, 1), repeat=3) if any(each)]
PLAIN = Volume(np.zeros((4, 5, 6), np.float32))
BODY = Volume(np.zeros((4, 5, 6), np.float32), space="right-anterior-superior")


@pytest.mark.parametrize("picked", PICKS)
def test_each_visible_part_is_picked_where_it_is_drawn(picked: cube.Pick) -> None:
    visible = dict.fromkeys(cube.visible_faces(ASIDE))
    faces = [face for face in visible if picked[face[0]] == face[1]]
    for face in faces:
        (middle,) = cube.positions(ASIDE, cube.patch(face, picked).mean(axis=0, keepdims=True))
        assert cube.pick(ASIDE, (float(middle[0]), float(middle[1]))) == picked
    assert cube.pick(ASIDE, (2.0, 0.0)) is None and cube.pick(ASIDE, (0.0, -1.9)) is None


def test_three_faces_are_seen_from_the_side_and_their_parts_cover_them() -> None:
    assert len(cube.visible_faces(ASIDE)) == 3
    for face in cube.visible_faces(ASIDE):
        parts = [each for each in PICKS if each[face[0]] == face[1]]
        sizes = [np.linalg.norm(np.cross(p[1] - p[0], p[3] - p[0])) for p in (cube.patch(face, each) for each in parts)]
        assert sum(sizes) == pytest.approx(4), "nine parts make the face"


@pytest.mark.parametrize("volume", [PLAIN, BODY])
@pytest.mark.parametrize("picked", PICKS)
def test_a_click_turns_the_part_to_the_eye_and_keeps_distance_and_pivot(volume: Volume, picked: cube.Pick) -> None:
    view = View(ASIDE, (4.0, 6.0, 5.0))
    towards = cube.direction(picked)
    turned = sides.turned_to(view, towards, volume)
    np.testing.assert_allclose(-turned.camera.forward, towards, atol=1e-12)
    assert turned.pivot == view.pivot and turned.camera.fov == ASIDE.fov
    assert turned.pivot_depth == pytest.approx(view.pivot_depth)
    assert turned.camera.target_distance == pytest.approx(ASIDE.target_distance)
    if abs(towards[2]) < 0.9:
        assert abs(turned.camera.right[2]) < 1e-12 and turned.camera.upward[2] > 0, "upright"
    else:
        # Of the four ways to look along the axis, the one that turns the picture least.
        others = [np.array([np.cos(a), np.sin(a), 0]) for a in np.arange(4) * np.pi / 2]
        assert turned.camera.upward @ ASIDE.upward >= max(each @ ASIDE.upward for each in others) - 1e-12


def test_from_the_front_the_top_keeps_the_front_below() -> None:
    front = View.of(Camera.orthographic((0, -10, 0), (0, 0, 0), (0, 0, 1), 5))
    for towards, up in (((0, 0, 1.0), (0, 1, 0)), ((0, 0, -1.0), (0, -1, 0))):
        np.testing.assert_allclose(sides.turned_to(front, np.array(towards), PLAIN).camera.upward, up, atol=1e-12)


def test_letters_are_those_of_the_body_or_the_world() -> None:
    assert [sides.letters(BODY)[face] for face in ((0, 1), (0, -1), (1, 1), (1, -1), (2, 1), (2, -1))] == list("RLAPSI")
    assert sides.letters(PLAIN)[2, 1] == "+Z" and sides.letters(PLAIN)[0, -1] == "−X"
    for volume in (BODY, PLAIN):
        for face, text in sides.letters(volume).items():
            up = np.roll(np.eye(3)[face[0]], 1)
            strokes = np.concatenate(cube.letter_strokes(text, face, up))
            assert (np.abs(strokes) <= 1).all() and (strokes[:, face[0]] == face[1]).all(), "on the face"


@pytest.mark.parametrize("volume", [PLAIN, BODY])
@pytest.mark.parametrize("side", VIEWS)
def test_sides_are_those_of_the_command_line(volume: Volume, side: str) -> None:
    camera = sides.from_side(View.of(ASIDE), side, volume, 1.5).camera
    towards, up = view_of(volume, ViewChoice(side))
    np.testing.assert_allclose(-camera.forward, towards, atol=1e-12)
    np.testing.assert_allclose(camera.upward, up, atol=1e-12)
    assert camera.projection == "perspective"


def test_sides_have_names() -> None:
    assert list(sides.names(BODY).values()) == ["anterior", "posterior", "left", "right", "superior", "inferior", "iso"]
    assert list(sides.names(PLAIN).values()) == list(VIEWS)
