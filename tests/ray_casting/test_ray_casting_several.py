"""The oracle on several volumes: where they overlap matter adds up, whatever their grids, places and order."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from support.scenes import BONE, FOG, constant, path_lengths, random_volume
from support.several import turned

from texvol.geometry import Mesh
from texvol.ray_casting import raycast
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import DepthCue, Light, Lighting
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.volume import Volume

SIZE = (14, 12)
# Some hundred pieces of a few ulps each, as in test_ray_casting.
EXACT = {"rtol": 1e-12, "atol": 1e-13}
# Halves of stretches agree to 1e-10, and each is better than that; in some tens of them.
AGREED = {"rtol": 0, "atol": 1e-9}
ALL = pytest.mark.parametrize("classification", CLASSIFICATIONS)
BOTH = pytest.mark.parametrize("classification", ["extinction", "post"])
PROJECTIONS = pytest.mark.parametrize("projection", ["orthographic", "perspective"])
RED, BLUE = (0.9, 0.2, 0.1), (0.1, 0.3, 0.8)
LIGHTS = Lighting((Light("point", (3.0, 9.0, 11.0), (0.3, 0.8, 0.6)), Light("directional", (1, -2, 0.5))))
OPAQUE = TransferFunction([0, 0.5, 1], [RED, BLUE, BLUE], [0.2, np.inf, np.inf])
GRADED = replace(
    FOG,
    modulation=np.array([(0.05, 0.2), (0.4, 1.0)]),
    graded=(Graded([0.2, 0.8], np.full((2, 3), 0.1), [0.3, 0.1], 0.1, 0.5),),
    contours=(Contour(0.5, 1.0, (0.1, 0, 0.2), 0.2),),
)


def other(volume: Volume, medium: Any = FOG, **more: Any) -> AddedVolume:
    return AddedVolume(volume, medium, **more)


def view(volume: Volume, projection: str) -> Camera:
    return Camera.framing(volume, projection, fov=50 if projection == "perspective" else None)  # type: ignore[arg-type]


def spans(volume: Volume, camera: Camera, size: tuple[int, int]) -> np.ndarray:
    """Where each ray, from the eye on, enters the box and leaves it, (2, height, width); equal where it does not."""
    origins, directions = camera.rays(size)
    inverse = np.linalg.inv(volume.box_edges)
    position, line_of_sight = (origins - volume.box_corner) @ inverse.T, directions @ inverse.T
    with np.errstate(divide="ignore"):
        a, b = -position / line_of_sight, (1 - position) / line_of_sight
    enter, leave = np.maximum(np.minimum(a, b).max(axis=2), 0), np.maximum(a, b).min(axis=2)
    return np.stack([enter, np.maximum(enter, leave)])


def two_boxes(camera: Camera, parts: list[tuple[Volume, float, tuple[float, float, float]]]) -> np.ndarray:
    """Constant media that overlap: on each ray from one end of a box to the next, with what both have together."""
    ends = np.sort(np.concatenate([spans(volume, camera, SIZE) for volume, _, _ in parts]), axis=0)
    light, depth = np.zeros((*ends.shape[1:], 3)), np.zeros(ends.shape[1:])
    for here, there in pairwise(ends):
        middle = (here + there) / 2
        tau, q = np.zeros_like(depth), np.zeros_like(light)
        for volume, extinction, color in parts:
            enter, leave = spans(volume, camera, SIZE)
            inside = (middle > enter) & (middle < leave)
            tau += extinction * inside
            q += (extinction * inside)[..., None] * np.array(color)
        alpha = -np.expm1(-tau * (there - here))
        fraction = np.divide(alpha, tau, out=np.zeros_like(tau), where=tau > 0)
        light += np.exp(-depth)[..., None] * fraction[..., None] * q
        depth += tau * (there - here)
    return np.concatenate([light, -np.expm1(-depth)[..., None]], axis=-1)


@PROJECTIONS
@ALL
def test_two_overlapping_constant_boxes_at_an_angle_have_their_closed_form(
    classification: Any, projection: str
) -> None:
    first = Volume(np.zeros((5, 6, 7), np.uint8), (1, 1, 1.5))
    second = Volume(np.ones((4, 3, 5)), (1.3, 1, 1)).moved(turned(40, shift=(1.5, 0.5, 2)))
    added = (other(second, constant(0.4, BLUE)),)
    scene = Scene(first, constant(0.25, RED), classification=classification, added=added)
    camera = view(scene.box, projection)
    expected = two_boxes(camera, [(first, 0.25, RED), (second, 0.4, BLUE)])
    overlap = (path_lengths(first, camera, SIZE) > 0) & (path_lengths(second, camera, SIZE) > 0)
    assert 0.1 < overlap.mean() < 0.9
    np.testing.assert_allclose(raycast(replace(scene, camera=camera), SIZE), expected, **EXACT)


@ALL
@pytest.mark.parametrize("light", [None, LIGHTS], ids=["unlit", "lit"])
def test_half_of_it_twice_is_all_of_it(classification: Any, light: Any) -> None:
    volume = random_volume(3)
    half = replace(BONE, extinctions=BONE.extinctions / 2)
    camera, cue = view(volume, "perspective"), DepthCue(0.5, (0.2, 0.1, 0.4))
    common: dict[str, Any] = {"camera": camera, "classification": classification, "lighting": light, "depth_cue": cue}
    twice = Scene(volume, half, added=(other(volume, half),), **({"classification": "slab"} | common))
    np.testing.assert_allclose(
        raycast(twice, SIZE), raycast(Scene(volume, BONE, **({"classification": "slab"} | common)), SIZE), **AGREED
    )


def test_shadows_fall_from_one_volume_on_another() -> None:
    """One volume and the same in two halves, which are each in the other's shadow, lie in the same light."""
    whole = random_volume(12, (3, 3, 30))  # long: few nodes
    lights = Lighting((Light("point", (3.0, 9.0, 11.0)),), shadows=True)
    camera = view(whole, "perspective")
    half = replace(BONE, extinctions=BONE.extinctions / 2)
    one = raycast(Scene(whole, BONE, camera, lighting=lights, classification="slab"), SIZE)
    two = raycast(Scene(whole, half, camera, lighting=lights, added=(other(whole, half),), classification="slab"), SIZE)
    np.testing.assert_allclose(two, one, **AGREED)
    unshadowed = raycast(
        Scene(whole, BONE, camera, lighting=replace(lights, shadows=False), classification="slab"), SIZE
    )
    assert np.abs(one - unshadowed).max() > 0.05


def test_a_screen_darkens_what_lies_behind_it_from_the_light() -> None:
    """A constant screen of depth 1.5 over a thin fog: e^-1.5 of the light arrives under it, all of it beside it."""
    fog, thin = Volume(np.zeros((3, 12, 12), np.uint8)), 1e-10
    # It is black, and casts a shadow all the same.
    screen = Volume(np.zeros((2, 4, 4)), (2, 2, 1), (2.5, 2.5, 10), colors=np.zeros((2, 4, 4, 3)))
    light = Lighting((Light("directional", (0, 0, 1)),), ambient=0.0, diffuse=1.0, specular=0.0, shadows=True)
    camera = Camera.orthographic((5.5, 5.5, -9), (5.5, 5.5, 0), (0, 1, 0), height=12)
    scene = Scene(
        fog,
        constant(thin, (1, 1, 1)),
        camera,
        lighting=light,
        added=(other(screen, constant(0.75)),),
        classification="slab",
    )
    red = raycast(scene, (12, 12))[..., 0]
    # Between nodes it changes linearly, over 12/64: no pixel lies as near to the screen's edges.
    inside = (np.arange(12) > 1.5) & (np.arange(12) < 9.5)
    np.testing.assert_allclose(red / (3 * thin), np.where(np.outer(inside, inside), np.exp(-1.5), 1), rtol=1e-8)


def refined(volume: Volume, factor: int) -> Volume:
    """The same field on a grid `factor` times as fine, out to the outermost samples and no farther."""
    values = volume.values.astype(np.float64)
    for axis in range(3):
        count = values.shape[axis]
        at = np.arange((count - 1) * factor + 1) / factor
        low = np.minimum(at.astype(int), count - 2)
        fraction = (at - low).reshape([-1 if a == axis else 1 for a in range(3)])
        values = np.take(values, low, axis) * (1 - fraction) + np.take(values, low + 1, axis) * fraction
    return Volume(values, volume.spacing / factor, volume.origin, volume.direction)


@PROJECTIONS
def test_two_grids_are_their_sum_on_a_common_fine_one(projection: str) -> None:
    """Of value as extinction: fields are seen where both are, the crop box leaves nothing else."""
    coarse, finer = random_volume(1, (5, 4, 6)), random_volume(2, (13, 10, 16))
    finer = Volume(finer.values, coarse.spacing / 3, coarse.origin)
    corner = coarse.spacing * (np.array(coarse.dimensions) - 1)
    crop = tuple((0.0, float(end)) for end in corner)
    grey = TransferFunction([0, 1], [(0.4, 0.7, 0.9)] * 2, [0, 0.8])
    camera = view(coarse, projection)
    two = Scene(coarse, grey, camera, crop=crop, added=(other(finer, grey),), classification="slab")  # type: ignore[arg-type]
    total = refined(coarse, 3)
    total = Volume(total.values + finer.values, total.spacing, total.origin)
    double = TransferFunction([0, 2], grey.colors, [0, 1.6])
    one = Scene(total, double, camera, crop=crop, classification="slab")  # type: ignore[arg-type]
    np.testing.assert_allclose(raycast(two, SIZE), raycast(one, SIZE), **EXACT)


def crowd(**more: Any) -> tuple[list[AddedVolume], dict[str, Any]]:
    """Three volumes, of three grids, that overlap."""
    third = Volume((random_volume(6, (4, 5, 6)).values * 4).astype(np.uint8), (1.5, 1, 1), (1, 2, 0), labels=True)
    parts = [
        other(random_volume(4), replace(FOG, extinctions=FOG.extinctions * 20)),
        other(random_volume(5, (7, 9, 5)).moved(turned(25, shift=(2, 1, 0))), BONE),
        other(third, TransferFunction([0, 1, 2, 3], [RED, BLUE, RED, BLUE], [0, 0.2, 0.1, 0.4])),
    ]
    return parts, more


def scene_of(parts: list[AddedVolume], **more: Any) -> Scene:
    first, *further = parts
    return Scene(
        first.volume,
        first.transfer_function,
        mask=first.mask,
        added=tuple(further),
        **({"classification": "slab"} | more),
    )


@ALL
@pytest.mark.parametrize("light", [None, LIGHTS], ids=["unlit", "lit"])
def test_the_order_of_volumes_does_not_matter(classification: Any, light: Any) -> None:
    parts, _ = crowd()
    camera = view(scene_of(parts).box, "perspective")
    common = {"camera": camera, "classification": classification, "lighting": light}
    pictures = [raycast(scene_of([parts[i] for i in order], **common), SIZE) for order in ((0, 1, 2), (2, 0, 1))]
    assert pictures[0][..., 3].max() > 0.5
    np.testing.assert_allclose(*pictures, **AGREED)


@ALL
def test_a_volume_behind_another_is_composited_behind_it(classification: Any) -> None:
    front = random_volume(7)
    back = random_volume(8).moved(turned(0, shift=(0, 0, 20)))
    camera = Camera.perspective((3, 4, -15), (3, 4, 5), (0, 1, 0), fov=40)
    common: dict[str, Any] = {"camera": camera, "classification": classification}
    near, far = (
        raycast(Scene(volume, BONE, **({"classification": "slab"} | common)), SIZE) for volume in (front, back)
    )
    over = near + (1 - near[..., 3:]) * far
    for one, two in ((front, back), (back, front)):
        picture = raycast(Scene(one, BONE, added=(other(two, BONE),), **({"classification": "slab"} | common)), SIZE)
        np.testing.assert_allclose(picture, over, **AGREED)
    assert ((near[..., 3] > 0.1) & (far[..., 3] > 0.1)).any()


@PROJECTIONS
@BOTH
def test_all_that_is_moved_together_looks_the_same(classification: Any, projection: str) -> None:
    parts, _ = crowd()
    camera = view(scene_of(parts).box, projection)
    matrix = turned(110, shift=(30, -20, 50))
    position = lambda point: matrix[:3, :3] @ np.array(point) + matrix[:3, 3]  # noqa: E731
    moved = replace(
        camera, eye=position(camera.eye), target=position(camera.target), up=matrix[:3, :3] @ np.array(camera.up)
    )
    there = [replace(part, volume=part.volume.moved(matrix)) for part in parts]
    one = raycast(scene_of(parts, camera=camera, classification=classification), SIZE)
    two = raycast(scene_of(there, camera=moved, classification=classification), SIZE)
    np.testing.assert_allclose(one, two, **AGREED)


@pytest.mark.parametrize("light", [None, LIGHTS], ids=["unlit", "lit"])
@pytest.mark.parametrize(
    ("classification", "medium"),
    [
        *((kind, medium) for kind in CLASSIFICATIONS for medium in (BONE, OPAQUE)),
        ("extinction", GRADED),
        ("post", GRADED),
    ],
)
def test_an_empty_volume_adds_nothing(classification: Any, medium: Any, light: Any) -> None:
    """And so the walk through several is that through one, with light, cue, caps, cuts, surfaces, gaps and all."""
    volume = random_volume(9)
    values = volume.values.copy()
    values[2:4, 3, 4:] = np.nan
    volume = Volume(values, volume.spacing)
    c = volume.centre
    sail = Mesh(c + np.array([(-9, -9, 1), (9, -9, -2), (0, 9, 1)]), [(0, 1, 2)], color=RED, opacity=0.5)
    alone = Scene(
        volume, medium, view(volume, "perspective"), (0.1, 0.2, 0.3), classification, light,
        depth_cue=DepthCue(0.4, (0.5, 0.1, 0.2)), clip=(ClipPlane((1, 2, 0.5), float(np.dot(c, (1, 2, 0.5)) - 2)),),
        crop=((0.5, 7.0), (1.0, 9.0), (-9.0, 9.0)), caps=medium is not BONE, geometry=(sail,),
    )  # fmt: skip
    # In the box, so that the cue has the same range; not finer, so that caps are as thin.
    empty = Volume(np.zeros((4, 5, 3)), (0.9, 1.1, 0.8), (1, 1.7, 0.9))
    both = replace(alone, added=(other(empty, constant(0.0)),))
    np.testing.assert_allclose(raycast(both, SIZE), raycast(alone, SIZE), **AGREED)


@PROJECTIONS
@BOTH
def test_where_two_are_cut_open_the_cap_shows_their_mixture(classification: Any, projection: str) -> None:
    first = Volume(np.zeros((8, 8, 8), np.uint8))
    second = Volume(np.zeros((8, 8, 8), np.uint8), origin=(3, 0, 0))
    plane = ClipPlane((0, 0, 1), 3.3)
    scene = Scene(
        first, constant(0.3, RED), classification=classification, clip=(plane,), caps=True,
        added=(other(second, constant(0.1, BLUE)),),
    )  # fmt: skip
    camera = Camera.framing(scene.box, projection, eye=scene.box.centre - (0, 0.1, 30), up=(0, 1, 0))
    picture = raycast(replace(scene, camera=camera), SIZE)
    eyes, lines_of_sight = camera.rays(SIZE)
    met = eyes + ((3.3 - eyes[..., 2]) / lines_of_sight[..., 2])[..., None] * lines_of_sight
    tau = [
        amount * ((met[..., :2] > low) & (met[..., :2] < np.add(low, 8))).all(axis=-1)
        for amount, low in ((0.3, (-0.5, -0.5)), (0.1, (2.5, -0.5)))
    ]
    total = tau[0] + tau[1]
    mixed = (tau[0][..., None] * np.array(RED) + tau[1][..., None] * np.array(BLUE))[total > 0] / total[total > 0, None]
    assert (tau[0] * tau[1] > 0).sum() > 5
    np.testing.assert_allclose(picture[total > 0, :3], mixed, atol=1e-12)
    np.testing.assert_array_equal(picture[total > 0, 3], 1)


@ALL
def test_opaque_matter_hides_what_is_behind_it_and_outshines_what_is_in_it(classification: Any) -> None:
    """A block of infinite extinction in fog, against the same block at an extinction of 1e9."""
    fog, block = Volume(np.zeros((9, 9, 9), np.uint8)), Volume(np.zeros((3, 3, 3), np.uint8), origin=(3.2, 3.1, 2.9))
    camera = view(fog, "perspective")
    common: dict[str, Any] = {"camera": camera, "classification": classification}
    opaque, dense = (
        raycast(
            Scene(
                fog,
                constant(0.1, RED),
                added=(other(block, constant(tau, BLUE)),),
                **({"classification": "slab"} | common),
            ),
            SIZE,
        )
        for tau in (np.inf, 1e9)
    )
    assert (opaque[..., 3] == 1).any() and (opaque[..., 3] < 1).any()
    np.testing.assert_allclose(opaque, dense, rtol=0, atol=1e-8)  # of a depth of 1e9 fog adds 1e-10; edges more


@ALL
def test_of_two_opaque_volumes_at_one_place_the_mean_colour_shows(classification: Any) -> None:
    one, two = Volume(np.zeros((5, 5, 5), np.uint8)), Volume(np.zeros((10, 10, 10), np.uint8), (0.5,) * 3, (-0.25,) * 3)
    scene = Scene(
        one, constant(np.inf, RED), classification=classification, added=(other(two, constant(np.inf, BLUE)),)
    )
    picture = raycast(replace(scene, camera=view(one, "perspective")), SIZE)
    met = picture[..., 3] > 0
    assert met.any()
    np.testing.assert_allclose(picture[met], [*np.add(RED, BLUE) / 2, 1.0] * np.ones((met.sum(), 1)), rtol=1e-12)


@BOTH
def test_a_far_origin_costs_no_digits_but_its_own(classification: Any) -> None:
    """At 2^20 places of whole and half numbers are exact, and the picture is that at 0."""
    pictures = []
    for origin in (np.zeros(3), np.full(3, 2.0**20)):
        first = Volume(random_volume(10).values, (1, 1, 1), origin)
        second = Volume(random_volume(11).values, (0.5, 1, 1), origin + (1, 2.5, 0.5))
        camera = Camera.perspective(origin + (20, -16, 9), origin + (4, 4, 4), (0, 0, 1), fov=45)
        added = (other(second, BONE),)
        pictures.append(raycast(Scene(first, BONE, camera, classification=classification, added=added), SIZE))
    # The rays' own places have been rounded to 2^-33, as for a single volume.
    np.testing.assert_allclose(*pictures, rtol=0, atol=1e-8)


def test_the_cue_goes_by_the_box_of_all() -> None:
    first = Volume(np.zeros((4, 4, 4), np.uint8))
    second = Volume(np.zeros((4, 4, 4), np.uint8), origin=(0, 0, 20))
    camera = Camera.orthographic((1.5, 1.5, -10), (1.5, 1.5, 0), (0, 1, 0), height=2)
    cue = DepthCue(1.0, (0, 0, 1))
    scene = Scene(
        first,
        constant(np.inf, RED),
        camera,
        depth_cue=cue,
        added=(other(second, constant(np.inf, RED)),),
        classification="slab",
    )
    seen = raycast(scene, (1, 1))[0, 0]
    np.testing.assert_allclose(seen[:3], RED, rtol=1e-8)  # nearest: no cue
    far = raycast(replace(scene, clip=(ClipPlane((0, 0, 1), 12.0),)), (1, 1))[0, 0]
    fraction = (29.5 - 9.5) / (33.5 - 9.5)
    np.testing.assert_allclose(far[:3], np.array(RED) * (1 - fraction) + np.array([0, 0, fraction]), rtol=1e-8)
