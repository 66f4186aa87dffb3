"""Polygons of single slabs make the picture of slab stacks; Wilson's make that of whole slabs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from support.odd_scenes.scenes import odd_scene
from support.quick_stats import quick_stats
from support.scenes import BONE, constant, inside, random_volume, smooth_volume

from texvol.opengl.wilson import sections
from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera, Projection
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.mask import Mask
from texvol.scene.scene import CLASSIFICATIONS, Classification, Scene
from texvol.scene.shapes import Mesh
from texvol.scene.transfer import TransferFunction, label_function
from texvol.scene.volume import Volume
from texvol.slicing.slabs import WHOLE_BOX, Slicing, box_corners
from texvol.util.errors import InputError

SIZE = (44, 38)
SAME = 2e-6
OBLIQUE = np.array([[1, 0.4, 0], [0.2, 1, 0.3], [0, -0.3, -1]])  # and left-handed
classifications = pytest.mark.parametrize("classification", CLASSIFICATIONS)


def oblique_noise() -> Volume:
    """A volume of noise on an oblique grid."""
    return Volume(random_volume(3, (12, 10, 9)).values, (1, 1.2, 0.8), (5, -3, 100), OBLIQUE)


def both(renderer: Renderer, scene: Scene, **accuracy: Any) -> float:
    """Largest difference of polygons and stacks, relative to the brightest number of the picture, or 1."""
    stacks, polygons = (renderer.render(scene, SIZE, slicing=each, **accuracy) for each in ("stacks", "polygons"))
    assert stacks[..., 3].any()
    return float(np.abs(polygons - stacks).max() / max(np.abs(stacks).max(), 1))


@classifications
@pytest.mark.parametrize("where", ["orthographic", "perspective", "inside"])
@pytest.mark.parametrize("rate", [0.3, 1, 7])
def test_polygons_make_the_picture_of_stacks(
    renderer: Renderer, classification: Classification, where: Any, rate: float
) -> None:
    volume = oblique_noise()
    camera = inside(volume, "perspective") if where == "inside" else Camera.framing(volume, where)
    scene = Scene(volume, BONE, camera, classification=classification)
    assert both(renderer, scene, sampling_rate=rate) <= SAME


def special_scenes() -> Iterator[Any]:
    """Scenes with everything that stacks model, by name."""
    volume = oblique_noise()
    plain = Scene(volume, BONE, Camera.framing(volume, "perspective"), classification="post")
    normal = (1.0, 0.4, -0.3)
    plane = ClipPlane(normal, float(np.dot(normal, volume.centre)))
    lit = Lighting((Light("head"), Light("directional", (1.0, 2, 3)), Light("point", tuple(volume.centre + 30.0))))
    mask = Mask(np.linspace(0, 1, volume.values.size).reshape(volume.values.shape).astype(np.float32))
    corners = volume.centre + 3.0 * np.array([(-1, -1, 0), (1, -1, 0.5), (0, 1, -0.5)])
    missing = volume.values.copy()
    missing[2:4, 3:6] = np.nan
    for name, scene in {
        "light": replace(plain, lighting=lit),
        "shadows": replace(plain, lighting=replace(lit, shadows=True)),
        "light, integrated": replace(plain, lighting=lit, classification="integrated"),
        "cut open": replace(plain, clip=(plane,)),
        "capped": replace(plain, clip=(plane,), caps=True),
        "mask": replace(plain, mask=mask),
        "depth cue": replace(plain, depth_cue=DepthCue(0.7)),
        "mesh": replace(plain, geometry=(Mesh(corners, [(0, 1, 2)], opacity=0.5),)),
        "missing": replace(plain, volume=Volume(missing, volume.spacing, volume.origin, volume.direction)),
    }.items():
        yield pytest.param(scene, id=name)


@pytest.mark.parametrize("scene", list(special_scenes()))
def test_whatever_stacks_model_polygons_do_as_well(renderer: Renderer, scene: Scene) -> None:
    assert both(renderer, scene, sampling_rate=1.3) <= SAME


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10_000))
def test_any_scene_is_the_same_or_refused(renderer: Renderer, number: int) -> None:
    odd = odd_scene(number)
    try:
        polygons = renderer.render(odd.scene, SIZE, sampling_rate=1.5, slicing="polygons")
    except InputError as error:
        labels = odd.scene.completed(SIZE).volume.labels  # a look may draw a volume as labels
        assert odd.scene.mode != "composite" or odd.scene.added or labels or "slicing" not in str(error)
        return
    stacks = renderer.render(odd.scene, SIZE, sampling_rate=1.5)
    brightest = np.nanmax(np.abs(stacks), initial=1.0)
    np.testing.assert_allclose(polygons, stacks, rtol=0, atol=SAME * brightest)


@pytest.mark.parametrize("classification, megabytes", [("slab", 0.03), ("post", 0.015), ("integrated", 0.03)])
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_bricks_are_the_same(classification: Classification, megabytes: float, projection: Projection) -> None:
    volume = random_volume(4, (24, 22, 20))
    scene = Scene(volume, BONE, Camera.framing(volume, projection), classification=classification)
    with Renderer(texture_memory=megabytes) as small:
        stacks = small.render(scene, SIZE, sampling_rate=1.5)
        polygons = small.render(scene, SIZE, sampling_rate=1.5, slicing="polygons")
        assert quick_stats(small)["bricks_drawn"] > 3
    assert np.abs(polygons - stacks).max() <= SAME


def test_a_thousand_slabs_keep_their_digits(renderer: Renderer) -> None:
    """Blended one by one into the picture, 2000 slabs would round to 6e-6."""
    volume = smooth_volume(20)
    scene = Scene(volume, constant(0.01), Camera.framing(volume), classification="slab")
    assert both(renderer, scene, sampling_rate=100) <= SAME


def test_every_slab_is_drawn_once(renderer: Renderer) -> None:
    volume = random_volume(5)
    scene = Scene(volume, constant(0.1), Camera.framing(volume, "perspective"), classification="slab")
    counts = []
    for slicing in ("stacks", "polygons"):
        renderer.render(scene, SIZE, early_termination=0, skip_empty=False, slicing=slicing)
        counts.append((quick_stats(renderer, samples=True)["samples"], quick_stats(renderer)["slicing"]))
    assert counts == [(counts[0][0], "stacks"), (counts[0][0], "polygons")]


def _cross(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twice the area between two vectors of a plane."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda view: np.linalg.norm(view) > 0.1), st.integers(2, 9))
@settings(max_examples=50, deadline=None)
def test_sections_are_convex_and_in_their_planes(view: tuple[float, float, float], planes: int) -> None:
    """And the sum of their areas times the distance of the planes goes to the volume of the box."""
    volume = Volume(np.zeros((5, 7, 9), np.uint8), (1, 2, 1.5), (3, -4, 5), OBLIQUE)
    up = np.eye(3)[np.argmin(np.abs(view))]
    camera = Camera.orthographic(volume.centre - 50 * np.array(view), volume.centre, up, 20)
    corners = box_corners(volume, camera, WHOLE_BOX)
    near, far = corners[:, 2].min(), corners[:, 2].max()
    depths = near + (far - near) * (np.arange(64 * planes) + 0.5) / (64 * planes)
    meets, polygons = sections(corners, depths)
    assert meets.all() and polygons.shape == (64 * planes, 6, 6)
    np.testing.assert_allclose(polygons[..., 2], depths[:, np.newaxis] + 0 * polygons[..., 2], rtol=1e-9)
    outline = polygons[..., :2]
    sides = np.roll(outline, -1, axis=1) - outline
    turns = _cross(sides, np.roll(sides, -1, axis=1))
    assert (turns >= -1e-9 * np.abs(turns).max()).all()
    from_first = outline - outline[:, :1]
    areas = _cross(from_first, np.roll(from_first, -1, axis=1)).sum(axis=1) / 2
    size_of_box = abs(np.linalg.det(volume.box_edges))
    assert areas.sum() * (far - near) / (64 * planes) == pytest.approx(size_of_box, rel=1e-3)
    # The positions in the box are those of the corners.
    back = (polygons[..., 3:] - 0.5) @ volume.box_edges.T
    np.testing.assert_allclose(camera.in_eye_space(back, volume.centre), polygons[..., :3], atol=1e-9)


@pytest.mark.parametrize("view, corners", [((0, 0, 1), 4), ((1, 1, 1), 6), ((1, 1.01, 0), 4), ((1, 1, 1.9), 6)])
def test_a_cube_is_cut_in_polygons_of_the_known_number_of_corners(view: Any, corners: int) -> None:
    volume = Volume(np.zeros((4, 4, 4), np.uint8))
    camera = Camera.orthographic(volume.centre - 9 * np.array(view), volume.centre, (0, 1, 0.1), 9)
    middle = float(camera.in_eye_space(np.zeros((1, 3)), volume.centre)[0, 2])
    _, polygons = sections(box_corners(volume, camera, WHOLE_BOX), np.array([middle]))
    assert len(np.unique(polygons[0].round(9), axis=0)) == corners


@pytest.mark.parametrize("extinction", [0.3, 5.0])
def test_wilsons_slabs_are_whole(renderer: Renderer, extinction: float) -> None:
    """In a constant medium a ray is as opaque as the number of slabs whose middles are in the box."""
    volume = Volume(np.ones((9, 10, 11), np.float32), (1, 1.1, 0.9), direction=OBLIQUE)
    camera = Camera.framing(volume)
    scene = Scene(volume, constant(extinction), camera, classification="slab")
    thickness, size = 0.8, (60, 50)
    renderer.render(scene, size, slab_thickness=thickness)  # its texels stand for thinner slabs in dense matter
    picture = renderer.render(scene, size, slab_thickness=thickness, slicing="wilson")
    origins, directions = camera.rays(size)
    to_box = np.linalg.inv(volume.box_edges)
    middle = float(camera.forward @ (volume.centre - camera.eye))
    middles = middle + thickness * (np.arange(-40, 40) + 0.5)
    points = origins[..., np.newaxis, :] + middles[:, np.newaxis] * directions[..., np.newaxis, :]
    in_box = (points - volume.centre) @ to_box.T
    inside_box = (np.abs(in_box) <= 0.5).all(axis=-1).sum(axis=-1)
    distance = np.abs(in_box).max(axis=-1) - 0.5
    near_an_edge = (np.abs(distance) < 0.02).any(axis=-1)
    expected = 1 - np.exp(-extinction * thickness * inside_box)
    assert inside_box.max() > 10 and near_an_edge.mean() < 0.7
    np.testing.assert_allclose(picture[..., 3][~near_an_edge], expected[~near_an_edge], atol=2e-6)


def test_wilsons_picture_goes_to_the_integral(renderer: Renderer) -> None:
    """Where rays are parallel; its error is of order 1, that of slabs that are cut as the box cuts them of order 2."""
    volume = smooth_volume(16)
    scene = Scene(volume, BONE, Camera.framing(volume), classification="slab")
    truth = renderer.render(replace(scene, classification="extinction"), SIZE, sampling_rate=128)
    errors = [
        np.abs(renderer.render(scene, SIZE, sampling_rate=rate, slicing="wilson") - truth).max() for rate in (2, 16)
    ]
    assert errors[1] < errors[0] / 4


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_the_estimate_knows_what_whole_slabs_lose(renderer: Renderer, projection: Projection) -> None:
    volume = smooth_volume(16)
    scene = Scene(volume, constant(0.2), Camera.framing(volume, projection), classification="slab")
    picture = renderer.render(scene, (64, 64), slicing="wilson")
    error = np.abs(picture - raycast(scene, (64, 64))).max()
    assert 0.5 * error <= renderer.stats["estimated_error"] <= 10 * error
    assert error > 5 * renderer_error_of_stacks(renderer, scene)


def renderer_error_of_stacks(renderer: Renderer, scene: Scene) -> float:
    """Largest error of slab stacks at the same rate."""
    return float(np.abs(renderer.render(scene, (64, 64)) - raycast(scene, (64, 64))).max())


def test_bricks_of_wilson_are_the_whole() -> None:
    volume = random_volume(4, (24, 22, 20))
    scene = Scene(volume, BONE, Camera.framing(volume, "perspective"), classification="slab")
    pictures = []
    for megabytes in (None, 0.16):
        with Renderer(texture_memory=megabytes) as renderer:
            pictures.append(renderer.render(scene, SIZE, slicing="wilson", texture_format="rgba32f"))
            assert (quick_stats(renderer)["bricks_drawn"] > 3) == (megabytes is not None)
    # A pixel whose middle is on the edge of a polygon may be in it or not.
    assert np.sort(np.abs(pictures[0] - pictures[1]).max(axis=2), axis=None)[-4] <= SAME


REFUSED: dict[str, tuple[Slicing, dict[str, Any], str]] = {
    "mode": ("polygons", {"mode": "mip"}, "slicing polygons does not draw mode mip: choose slicing stacks"),
    "labels": ("polygons", {"labels": True}, "slicing polygons does not draw labels: choose slicing stacks"),
    "several": ("polygons", {"several": True}, "does not draw several volumes: choose slicing stacks"),
    "post": ("wilson", {"classification": "post"}, "does not draw classification post: choose slicing polygons or"),
    "cut": ("wilson", {"clip": (ClipPlane((1.0, 0, 0), 2.0),)}, "what is cut open: choose"),
    "cue": ("wilson", {"depth_cue": DepthCue(0.5)}, "does not draw a depth cue"),
    "word": ("slabs", {}, "slicing must be stacks, polygons or wilson, got 'slabs'"),  # type: ignore[dict-item]
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_drawn_is_refused(renderer: Renderer, case: str) -> None:
    slicing, changes, message = REFUSED[case]
    scene = Scene(random_volume(1), BONE, classification="slab")
    if changes.get("labels"):
        volume = Volume(np.arange(8, dtype=np.uint8).reshape(2, 2, 2), labels=True)
        scene = Scene(volume, label_function(volume), classification="slab")
    elif changes.get("several"):
        added = (AddedVolume(random_volume(2), TransferFunction([0, 1], [(1, 1, 1)] * 2, [0, 1])),)
        scene = replace(scene, classification="extinction", added=added)
    else:
        scene = replace(scene, **changes)
    with pytest.raises(InputError, match=message):
        renderer.render(scene, SIZE, slicing=slicing)
