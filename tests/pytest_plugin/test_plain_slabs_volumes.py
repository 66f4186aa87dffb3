"""Slabs composited by plain numpy are those of the renderer, also of several volumes, masks and colours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.scenes import BONE, FOG, inside, path_lengths, random_volume, smooth_volume

from texvol.pytest_plugin import plain_slabs
from texvol.rendering.renderer import Renderer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.cutting import ClipPlane
from texvol.scene.mask import Mask
from texvol.scene.scene import CLASSIFICATIONS, Scene
from texvol.scene.volume import Volume

SIZE = (31, 26)
FIRST = random_volume(1, (12, 11, 10))
TURNED = smooth_volume(16).moved([[0.4, -0.3, 0, 2], [0.3, 0.4, 0, 1], [0, 0.1, 0.5, -1], [0, 0, 0, 1]])
RGB = Volume(
    smooth_volume(12).values, (0.9, 0.7, 0.8), (3, 2, -4), colors=np.random.default_rng(2).random((12, 12, 12, 3))
)
SCENES = {
    "hidden": Scene(FIRST, BONE, mask=Mask(FIRST.values > 0.6), classification="slab"),
    "faded": Scene(FIRST, BONE, mask=Mask(random_volume(3, (12, 11, 10)).values), classification="slab"),
    "colours": Scene(RGB, BONE, classification="slab"),
    "two": Scene(FIRST, FOG, added=(AddedVolume(TURNED, BONE),), classification="slab"),
    "three, from inside": Scene(
        FIRST,
        BONE,
        inside(FIRST, "perspective"),
        added=(AddedVolume(TURNED, FOG, Mask(TURNED.values < 0.5)), AddedVolume(RGB, FOG)),
        classification="slab",
    ),
}


# Masks and colours act before the slabs are composited, whatever the classification; several volumes meet in a slab.
CASES = [
    *(("hidden", each) for each in ("slab", "integrated")),
    *(("faded", each) for each in ("extinction", "post")),
    *(("colours", each) for each in ("slab", "post")),
    *((name, each) for name in ("two", "three, from inside") for each in CLASSIFICATIONS),
]


@pytest.mark.parametrize(("name", "classification"), CASES)
def test_plain_slabs_are_the_renderer_s(name: str, classification: str, renderer: Renderer) -> None:
    scene = replace(SCENES[name], classification=classification)  # type: ignore[arg-type]
    assert plain_slabs.can_draw(scene)
    thickness = 0.83 * scene.smallest_spacing
    exact = {"texture_format": "rgba32f", "early_termination": 0.0}
    drawn = renderer.render(scene, SIZE, slab_thickness=thickness, **exact)  # type: ignore[arg-type]
    plain = plain_slabs.picture_of_slabs(scene, SIZE, thickness)
    # A ray that misses a volume is cut, or not, where it would have entered it: both are right.
    camera = scene.completed(SIZE).camera
    hits = np.all([path_lengths(volume, camera, SIZE) > 0 for volume in scene.volumes], axis=0)
    off = np.abs(drawn - plain)[hits].max()
    assert hits.sum() > 50 and drawn[hits, 3].max() > 0.2
    if classification == "integrated":
        # Halves are summed in quarters here and integrated there: both have less than the error of such slabs, which
        # is a third of what slabs twice as thick change (order 2).
        coarse = renderer.render(scene, SIZE, slab_thickness=2 * thickness, **exact)  # type: ignore[arg-type]
        assert off < np.abs(coarse - drawn)[hits].max() / 3
    else:
        assert off < 2e-5  # float32 places of samples, 1e-6 of a box, times the steepest matter of 10 boxes or so


def test_what_it_does_not_know_is_not_drawn() -> None:
    plain = SCENES["two"]
    labels = Volume(np.rint(FIRST.values), labels=True)
    for other in (
        replace(plain, clip=(ClipPlane((1, 0, 0), 3),)),
        replace(plain, crop=((0, 5), (0, 5), (0, 5))),
        replace(plain, added=(AddedVolume(labels),)),
        Scene(labels, classification="slab"),
        replace(plain, added=(AddedVolume(Volume([[[np.nan, 1.0]]])),)),
    ):
        assert not plain_slabs.can_draw(other)
