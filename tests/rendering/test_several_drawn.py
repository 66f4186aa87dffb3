"""Several volumes in one scene: what they emit and absorb adds up, whatever their grids, their order and their cuts."""

from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.pairs import each_classification_in_a_projection
from support.quick_stats import quick_stats
from support.scenes import BONE, FOG, constant, random_volume, smooth_volume, sparse_volume
from support.several import boxes, picture_of, scene_of, turned
from support.shapes import quad

from texvol import (
    Camera,
    ClipPlane,
    DepthCue,
    InputError,
    Light,
    Lighting,
    Mask,
    Renderer,
    Scene,
    TransferFunction,
    Volume,
)
from texvol.scene.added_volume import AddedVolume, common_box

SIZE = (48, 40)
# float32 sums of a few dozen slabs, each of a picture of at most 1.
ROUNDING = 2e-6


def thinner(medium: TransferFunction, fraction: float) -> TransferFunction:
    """A share of the matter."""
    return replace(medium, extinctions=medium.extinctions * fraction)


def in_two(scene: Scene) -> Scene:
    """The same scene, its volume's matter as that of two volumes in one place."""
    medium = scene.transfer_function
    assert medium is not None
    return replace(
        scene, transfer_function=thinner(medium, 0.25), added=(AddedVolume(scene.volume, thinner(medium, 0.75)),)
    )


def seen(volume: Volume, medium: TransferFunction, projection: Any = "perspective", **more: Any) -> Scene:
    eye = volume.centre + volume.radius * np.array([1.6, -2.0, 1.1])
    return Scene(volume, medium, Camera.framing(volume, projection, eye=eye), **({"classification": "slab"} | more))


@each_classification_in_a_projection
@pytest.mark.parametrize("density", [1.0, 40.0])
def test_overlapping_boxes_have_their_closed_form(
    renderer: Renderer, classification: Any, projection: Any, density: float
) -> None:
    parts = boxes(density)
    scene = scene_of(parts, classification=classification)
    scene = replace(scene, camera=Camera.framing(scene.box, projection))
    assert scene.camera is not None
    expected = picture_of(parts, scene.camera, SIZE)
    assert (expected[..., 3] > 0).mean() > 0.1
    for rate in (1.0, 0.21):
        np.testing.assert_allclose(renderer.render(scene, SIZE, sampling_rate=rate), expected, rtol=0, atol=ROUNDING)


def test_cut_boxes_have_their_closed_form(renderer: Renderer) -> None:
    parts = boxes()
    plain = scene_of(parts)
    middle = plain.box.centre
    planes = [ClipPlane(n, float(np.dot(n, middle) - off)) for n, off in (((2.0, 0.7, -0.4), 0.5), ((-0.3, 1, 1), 1.0))]
    crop = tuple((float(low), float(low + 7.3)) for low in middle - 3.1)
    as_planes = [
        ClipPlane(tuple(sign * np.eye(3)[axis]), sign * end)  # type: ignore[arg-type]
        for axis, ends in enumerate(crop)
        for sign, end in zip((1, -1), ends, strict=True)
    ]
    scene = replace(plain, camera=Camera.framing(plain.box, "perspective"), clip=tuple(planes), crop=crop)  # type: ignore[arg-type]
    assert scene.camera is not None
    expected = picture_of(parts, scene.camera, SIZE, [*planes, *as_planes])
    assert (expected[..., 3] > 0).mean() > 0.02
    for order in (scene, _in_other_order(scene)):
        np.testing.assert_allclose(renderer.render(order, SIZE), expected, rtol=0, atol=ROUNDING)


def test_the_eye_may_be_inside(renderer: Renderer) -> None:
    parts = boxes(4.0)
    scene = scene_of(parts)
    camera = Camera.perspective(scene.box.centre + 0.3, scene.box.centre + (3, -4, 1), (0, 0, 1), fov=90)
    expected = picture_of(parts, camera, SIZE)
    drawn = renderer.render(replace(scene, camera=camera), SIZE)
    np.testing.assert_allclose(drawn, expected, rtol=0, atol=ROUNDING)


def _in_other_order(scene: Scene) -> Scene:
    """The first volume as the last."""
    first = AddedVolume(scene.volume, scene.transfer_function, scene.mask)
    second, *others = scene.added
    return replace(
        scene,
        volume=second.volume,
        transfer_function=second.transfer_function,
        mask=second.mask,
        added=(*others, first),
    )


LIT = Lighting((Light("head"), Light("directional", (1.0, -0.5, 1.0), (0.6, 0.5, 0.4))), specular=0.4)
RAYS: dict[str, dict[str, Any]] = {
    "plain": {},
    "caps": {"clip": (ClipPlane((1.0, -2.0, 0.5), -20.0),), "caps": True},
    "cue": {"depth_cue": DepthCue(0.8, (0.1, 0.2, 0.3))},
    "lit": {"lighting": LIT},
    "shadows": {"lighting": replace(LIT, shadows=True)},
}


@pytest.mark.parametrize(
    "direction, classification",
    [
        ("plain", "extinction"),
        ("caps", "post"),
        ("cue", "extinction"),
        ("lit", "extinction"),
        ("lit", "post"),
        ("shadows", "post"),
    ],
)
def test_a_volume_in_two_is_the_volume(renderer: Renderer, direction: str, classification: Any) -> None:
    whole = seen(smooth_volume(20), BONE, classification=classification, **RAYS[direction])
    exact: dict[str, Any] = {"texture_format": "rgba32f"}
    expected = renderer.render(whole, SIZE, **exact)
    assert expected[..., 3].max() > 0.9
    np.testing.assert_allclose(renderer.render(in_two(whole), SIZE, **exact), expected, rtol=0, atol=3 * ROUNDING)


def test_surfaces_stand_between_the_volumes(renderer: Renderer) -> None:
    volume = smooth_volume(20)
    walls = (
        quad(volume.centre, (14, 2, 0), (0, 3, 14), opacity=0.5).mesh(),
        quad(volume.centre + (0, 6, 1), (11, 0, 1), (0, 2, 9), color=(0.9, 0.1, 0.4), opacity=1.0).mesh(),
    )
    whole = seen(volume, FOG, classification="extinction", geometry=walls)
    expected = renderer.render(whole, SIZE, texture_format="rgba32f")
    assert np.abs(expected - renderer.render(replace(whole, geometry=()), SIZE)).max() > 0.2
    drawn = renderer.render(in_two(whole), SIZE, texture_format="rgba32f")
    np.testing.assert_allclose(drawn, expected, rtol=0, atol=3 * ROUNDING)


def test_integrated_volumes_come_to_their_integral(renderer: Renderer) -> None:
    """Where in half a slab which matter lies is lost: an error of order 2 in the thickness."""
    volume = smooth_volume(20)
    whole = seen(volume, BONE, classification="integrated")
    exact = renderer.render(whole, SIZE, sampling_rate=32)
    errors = [
        float(np.abs(renderer.render(in_two(whole), SIZE, sampling_rate=rate) - exact).max()) for rate in (1, 2, 4, 8)
    ]
    assert errors[0] < 0.02
    assert errors[-1] < errors[0] / 8**1.5


def test_two_grids_are_the_sum_on_a_common_fine_one(renderer: Renderer) -> None:
    """Samples that are three times as close hold a trilinear field exactly, with those that it came from among them."""
    coarse, fine = random_volume(1, (5, 6, 4)), random_volume(2, (15, 18, 12))
    fine = Volume(fine.values, coarse.spacing / 3, coarse.origin - coarse.spacing / 3)
    np.testing.assert_allclose(fine.box_corner, coarse.box_corner, atol=1e-12)
    tints, density = (np.array((1.0, 0.2, 0.1)), np.array((0.1, 0.4, 1.0))), 0.7
    on_fine = _three_times_as_close(coarse.values.astype(np.float64))
    glow = on_fine[..., np.newaxis] * tints[0] + fine.values[..., np.newaxis] * tints[1]
    total = on_fine + fine.values
    common = Volume(total, fine.spacing, fine.origin, colors=glow / total[..., np.newaxis])
    ramp = [
        TransferFunction(np.array([0.0, 4.0]), np.array([tint] * 2), np.array([0.0, 4 * density])) for tint in tints
    ]
    white = TransferFunction(np.array([0.0, 4.0]), np.ones((2, 3)), np.array([0.0, 4 * density]))
    apart = replace(seen(coarse, ramp[0]), added=(AddedVolume(fine, ramp[1]),), classification="extinction")
    exact: dict[str, Any] = {"texture_format": "rgba32f", "slab_thickness": 0.1}
    expected = renderer.render(
        replace(seen(common, white), camera=apart.camera, classification="extinction"), SIZE, **exact
    )
    assert 0.5 < expected[..., 3].max() < 1
    np.testing.assert_allclose(renderer.render(apart, SIZE, **exact), expected, rtol=0, atol=3 * ROUNDING)


def _three_times_as_close(values: np.ndarray) -> np.ndarray:
    for axis in range(3):
        count = values.shape[axis]
        positions = np.clip((np.arange(3 * count) - 1) / 3, 0, count - 1)
        low = np.minimum(positions.astype(int), count - 2)
        fraction = np.expand_dims(positions - low, tuple(other for other in range(3) if other != axis))
        values = values.take(low, axis) * (1 - fraction) + values.take(low + 1, axis) * fraction
    return values


def test_a_volume_behind_another_is_under_its_picture(renderer: Renderer) -> None:
    thickness = 0.7
    near, far = smooth_volume(17), random_volume(3, (13, 14, 9)).moved(turned(20))
    # By whole slabs, since those of a volume alone are counted from its own middle.
    far = far.moved(turned(0, shift=near.centre + (0, 60 * thickness, 0) - far.centre))
    camera = Camera.orthographic((8, -40, 8), (8, 0, 8), (0, 0, 1), height=30)
    front, back = (Scene(volume, BONE, camera, classification="post") for volume in (near, far))
    together = replace(front, added=(AddedVolume(far, BONE),))
    exact: dict[str, Any] = {"slab_thickness": thickness, "early_termination": 0.0}
    one, other = renderer.render(front, SIZE, **exact), renderer.render(back, SIZE, **exact)
    expected = one + (1 - one[..., 3:]) * other
    assert np.abs(expected - one).max() > 0.1
    drawn = renderer.render(together, SIZE, **exact)
    np.testing.assert_allclose(drawn, expected, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("classification", ["extinction", "integrated"])
def test_leaps_change_nothing(renderer: Renderer, classification: Any) -> None:
    scene = replace(
        seen(sparse_volume(1), BONE, classification=classification),
        added=(AddedVolume(sparse_volume(2).moved(turned(25, shift=(9, 3, 4))), FOG),),
    )
    skipped, all_of_it = (
        renderer.render(scene, SIZE, skip_empty=skip, early_termination=0.0) for skip in (True, False)
    )
    np.testing.assert_allclose(skipped, all_of_it, rtol=0, atol=ROUNDING)
    renderer.render(scene, SIZE)
    stats = quick_stats(renderer, samples=True)
    assert 0 < stats["samples"] < 0.9 * stats["samples_total"]
    assert stats["cells_drawn"] < stats["cells_total"]


def test_an_ended_ray_is_within_its_bound(renderer: Renderer) -> None:
    scene = in_two(seen(smooth_volume(20), thinner(BONE, 5.0), classification="post"))
    whole, ended = (renderer.render(scene, SIZE, early_termination=bound) for bound in (0.0, 1 / 64))
    assert 0 < np.abs(whole - ended).max() <= 1 / 64 + ROUNDING


def test_a_wanted_error_is_reached(renderer: Renderer) -> None:
    scene = replace(seen(smooth_volume(20), BONE), added=(AddedVolume(smooth_volume(13).moved(turned(40)), FOG),))
    drawn = renderer.render(scene, SIZE, max_error=2e-3)
    fine = renderer.render(scene, SIZE, sampling_rate=48, texture_format="rgba32f", early_termination=0.0)
    assert np.abs(drawn - fine).max() <= 2e-3
    assert renderer.stats["estimated_error"] <= 2e-3


def test_rates_are_those_of_the_finest_volume(renderer: Renderer) -> None:
    scene = replace(seen(smooth_volume(9), FOG), added=(AddedVolume(Volume(np.ones((7, 7, 7)), (0.25,) * 3), FOG),))
    renderer.render(scene, SIZE, sampling_rate=2)
    assert quick_stats(renderer)["slab_thickness"] == 0.125


def test_the_box_of_all_is_framed() -> None:
    first = Volume(np.ones((4, 4, 4)))
    added = AddedVolume(first.moved(turned(0, shift=(50, 0, 0))))
    scene = Scene(first, added=(added,), classification="slab")
    box = common_box(scene.volumes)
    np.testing.assert_allclose(
        (box.box_corner, box.box_corner + box.box_edges.sum(axis=1)), [(-0.5,) * 3, (53.5, 3.5, 3.5)]
    )
    assert common_box([first]) is first
    with Renderer() as renderer:
        picture = renderer.render(replace(scene, transfer_function=constant(1.0)), (64, 32))
    columns = np.flatnonzero(picture[..., 3].max(axis=0))
    assert columns.min() < 8 and columns.max() > 55


def test_what_does_not_fit_is_refused_by_name() -> None:
    volume = smooth_volume(32)
    scene = replace(seen(volume, FOG, classification="extinction"), added=(AddedVolume(volume, FOG),))
    masked = replace(scene, mask=Mask(np.ones(volume.shape, bool)))
    with (
        Renderer(texture_memory=0.2) as small,
        pytest.raises(InputError, match=r"^2 volumes are drawn at once and need .*a mask cannot be drawn part by part"),
    ):
        small.render(masked, SIZE, texture_format="rgba32f")
    many = replace(scene, added=tuple(AddedVolume(Volume(np.ones((2, 2, 2))), FOG) for _ in range(64)))
    with Renderer() as renderer:
        with pytest.raises(InputError, match=r"^65 volumes are more than this driver draws at once: ") as refused:
            renderer.render(many, SIZE)
        found = re.search(r"enough for the first (\d+); hide or leave out others$", str(refused.value))
        assert found is not None
        room = int(found[1])
        with pytest.raises(InputError, match=f"^{room + 1} volumes are more .* for the first {room};"):
            renderer.render(replace(many, added=many.added[:room]), SIZE)
        assert renderer.render(replace(many, added=many.added[: room - 1]), SIZE).any()


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"mode": "mip"}, "added volumes need mode composite"),
        ({"mode": "isosurface", "isovalue": 0.5}, "added volumes need mode composite"),
        ({"added": (3,)}, "each of added must be an AddedVolume, got int"),
    ],
)
def test_what_has_no_meaning_is_refused(more: dict[str, Any], message: str) -> None:
    volume = smooth_volume(4)
    with pytest.raises(InputError, match=message):
        Scene(volume, **({"classification": "slab"} | ({"added": (AddedVolume(volume),)} | more)))


def test_fewer_volumes_leave_nothing_behind(renderer: Renderer) -> None:
    one = seen(smooth_volume(17), FOG, classification="extinction")
    alone = renderer.render(one, SIZE)
    before = quick_stats(renderer)["texture_bytes"]
    renderer.render(in_two(one), SIZE)
    assert quick_stats(renderer)["texture_bytes"] == 2 * before
    np.testing.assert_array_equal(renderer.render(one, SIZE), alone)
    assert quick_stats(renderer)["texture_bytes"] == before


def test_a_single_volume_knows_nothing_of_others() -> None:
    line = (
        "import sys, numpy as np, texvol as t; r = t.Renderer(); r.render(t.Scene(t.Volume(np.eye(3)[None])));"
        "assert 'texvol.opengl.several' not in sys.modules;"
        "assert not any(k[0] == 'several' for k in r._compositor._programs.kept)"
    )
    subprocess.run([sys.executable, "-c", line], check=True)
