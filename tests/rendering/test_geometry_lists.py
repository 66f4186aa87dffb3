"""Surfaces in lists of hits: pictures are those of depth peeling to the last bit, also where lists have no room."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.pairs import each_classification_in_a_projection
from support.scenes import BONE, random_volume
from support.shapes import globe, quad

from texvol import Camera, ClipPlane, DepthCue, DepthPicture, Light, Lighting, Renderer, Scene
from texvol.geometry import Lines, Mesh
from texvol.opengl.surfaces import hit_lists, on_device, on_screen, surfaces
from texvol.scene.scene import Classification

SIZE = (61, 47)
VOLUME = random_volume(5, (13, 9, 14))
CENTRE, RADIUS = VOLUME.centre, VOLUME.radius
EYE = CENTRE + RADIUS * np.array([1.5, -2.0, 1.2])
PROJECTIONS = pytest.mark.parametrize("projection", ["orthographic", "perspective"])
PLANE = ClipPlane((0.3, -0.2, 1.0), float(np.dot((0.3, -0.2, 1.0), CENTRE)))
CHANGED: dict[str, dict[str, Any]] = {
    "plain": {},
    "cut": {"clip": (PLANE,)},
    "lit from a point": {"lighting": Lighting((Light("point", tuple(EYE)),))},
    "with a depth cue": {"depth_cue": DepthCue(0.7, (0.1, 0.2, 0.5))},
}


def shapes() -> tuple[Mesh | Lines, ...]:
    """Balls in each other, two quads at one place, triangles through the plane of an eye inside, and lines."""
    (inner, inside), (outer, outside) = globe(6), globe(9)
    wall = quad(CENTRE, RADIUS * np.array([0.6, 0.1, 0.0]), RADIUS * np.array([0.0, 0.1, 0.7]), (0.2, 0.7, 0.9), 0.4)
    solid = quad(CENTRE, RADIUS * np.array([0.2, 0, 0]), RADIUS * np.array([0, 0.2, 0.2]), (0.9, 0.1, 0.8), 1.0)
    ends = CENTRE + RADIUS * np.random.default_rng(3).uniform(-0.7, 0.7, (9, 3))
    pairs = np.stack([np.arange(8), np.arange(1, 9)], axis=1)
    return (
        wall.mesh(),
        Mesh(CENTRE + 0.5 * RADIUS * outer, outside, color=(0.9, 0.8, 0.3), opacity=0.3),
        replace(wall.mesh(), color=(0.9, 0.1, 0.1)),
        Lines(ends, pairs, (1.0, 0.5, 0.2), 0.6, 3.0),
        solid.mesh(),
        replace(solid.mesh(), color=(0.1, 0.9, 0.1)),
        Mesh(CENTRE + 0.3 * RADIUS * inner, inside, color=(0.2, 0.4, 0.9), lit=False),
        Lines(ends[::-1] + 0.05 * RADIUS, pairs, (0.2, 1.0, 0.4), 0.5, 2.0, cut=False),
        Lines(ends[:3], [(0, 1)], (0.1, 0.1, 0.1), 1.0, 5.0),
    )


def scene(projection: Any, classification: Classification = "slab", **changes: Any) -> Scene:
    camera = Camera.framing(VOLUME, projection, eye=EYE)
    return Scene(VOLUME, BONE, camera, classification=classification, geometry=shapes(), **changes)


def programs(renderer: Renderer) -> set[str]:
    found = renderer._pictures.in_memory.cache._surfaces
    assert found is not None
    return {key[0] for key in found._programs.kept}


@pytest.fixture
def in_lists(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take lists for any number of primitives."""
    monkeypatch.setattr(hit_lists, "_FEWEST", 0)


def peeled(of: Scene, size: tuple[int, int] = SIZE) -> np.ndarray:
    with pytest.MonkeyPatch.context() as patch, Renderer() as fresh:
        patch.setattr(hit_lists, "_FEWEST", 1 << 40)
        picture = fresh.render(of, size)
        assert programs(fresh) == {"surface", "texels"}
    return picture


def listed(of: Scene, size: tuple[int, int] = SIZE) -> np.ndarray:
    with Renderer() as fresh:
        picture = fresh.render(of, size)
        assert programs(fresh) == {"surface_hits.comp", "surface_next", "texels"}
    return picture


@each_classification_in_a_projection
def test_lists_make_the_picture_of_peeling(in_lists: None, classification: Classification, projection: str) -> None:
    drawn = scene(projection, classification)
    np.testing.assert_array_equal(listed(drawn), peeled(drawn))


@PROJECTIONS
@pytest.mark.parametrize("name", CHANGED)
def test_light_cuts_and_cues_are_those_of_peeling(in_lists: None, name: str, projection: str) -> None:
    drawn = scene(projection, **CHANGED[name])
    picture = listed(drawn)
    np.testing.assert_array_equal(picture, peeled(drawn))
    if CHANGED[name]:
        assert (listed(scene(projection)) != picture).any(), "the change is seen"


@PROJECTIONS
def test_an_eye_among_surfaces_sees_those_of_peeling(in_lists: None, projection: Any) -> None:
    camera = Camera.framing(VOLUME, projection, eye=CENTRE + 0.4 * RADIUS * np.array([0.5, -0.5, 0.6]))
    drawn = replace(scene(projection), camera=camera)
    np.testing.assert_array_equal(listed(drawn), peeled(drawn))


def test_a_depth_picture_ends_lists_where_it_ends_peeling(in_lists: None) -> None:
    distances = np.linspace(1.8, 3.2, SIZE[0] * SIZE[1]).reshape(SIZE[::-1]) * RADIUS
    drawn = scene("perspective", depth=DepthPicture(distances))
    picture = listed(drawn)
    np.testing.assert_array_equal(picture, peeled(drawn))
    assert (picture != listed(scene("perspective"))).any()


@pytest.mark.parametrize("hits", [0, 300])
def test_lists_without_room_are_peeled(in_lists: None, monkeypatch: pytest.MonkeyPatch, hits: int) -> None:
    """300 hits are enough for the opaque surfaces, or a part of them, and not for the translucent ones."""
    monkeypatch.setattr(surfaces, "_MOST_BYTES", 16 * hits)
    drawn = scene("perspective")
    with Renderer() as fresh:
        picture = fresh.render(drawn, SIZE)
        assert "surface" in programs(fresh)
    np.testing.assert_array_equal(picture, peeled(drawn))


def test_lists_grow_to_the_hits_there_are(in_lists: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hit_lists, "_FIRST_HITS", 64)
    drawn = scene("orthographic")
    np.testing.assert_array_equal(listed(drawn), peeled(drawn))


def test_too_many_rectangles_are_peeled(in_lists: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(on_device, "MOST_RECTANGLES", 10)
    drawn = scene("perspective")
    with Renderer() as fresh:
        picture = fresh.render(drawn, SIZE)
        assert programs(fresh) == {"surface", "texels"}
    np.testing.assert_array_equal(picture, peeled(drawn))


def test_a_renderer_goes_from_lists_to_other_sizes_and_scenes(in_lists: None) -> None:
    drawn = scene("perspective")
    fewer = replace(drawn, geometry=drawn.geometry[:2])
    with Renderer() as fresh:
        for each, size in ((drawn, SIZE), (fewer, SIZE), (drawn, (33, 40)), (drawn, SIZE)):
            np.testing.assert_array_equal(fresh.render(each, size), peeled(each, size))


def test_few_primitives_and_older_drivers_do_without_lists() -> None:
    many = [Mesh(np.eye(3), np.tile([(0, 1, 2)], (hit_lists._FEWEST, 1)))]
    assert hit_lists.has_lists(SimpleNamespace(version_code=430), many)  # type: ignore[arg-type]
    assert not hit_lists.has_lists(SimpleNamespace(version_code=420), many)  # type: ignore[arg-type]
    assert not hit_lists.has_lists(SimpleNamespace(version_code=450), shapes())  # type: ignore[arg-type]


def test_threads_find_the_primitives_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = scene("perspective").completed(SIZE)
    arguments = drawn.geometry, drawn.volume, drawn.camera, SIZE, 0.1 * RADIUS
    whole = on_screen.primitives_of(*arguments)
    monkeypatch.setattr(on_screen, "_AT_ONCE", 7)
    for found, right in zip(on_screen.primitives_of(*arguments), whole, strict=True):
        np.testing.assert_array_equal(found, right)


def test_primitives_between_the_centres_of_pixels_are_left_out() -> None:
    camera = Camera.orthographic((0, 0, 50), (0, 0, 0), (0, 1, 0), height=16)  # a pixel of a world unit at 16 rows
    corners = np.array([(0.0, 0.0, 0.0), (0.3, 0.0, 0.0), (0.0, 0.3, 0.0)])
    beside, over = (Mesh(corners + (at, at, 0.0), [(0, 1, 2)]) for at in (0.1, 0.4))
    found = on_screen.primitives_of((beside, over), VOLUME, camera, (24, 16), 1.0)
    assert found.shape.tolist() == [1]
