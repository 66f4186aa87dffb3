"""Estimates of the error of pictures in parts, by small pictures that are drawn along with them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from support.large import Counted, large

from texvol import Camera, InputError, Lighting, Renderer, Scene, TransferFunction, Volume, raycast
from texvol.rendering.streaming.side_pictures import SidePictures
from texvol.scene.large_volume import LargeVolume
from texvol.slicing.slabs import MOST_SLABS

SIZE = (120, 100)
# An estimate may be too large by its safety factor, by what the largest of few rays foresees for all, and by the order.
MOST_ABOVE = 12
MEDIUM = TransferFunction(
    [30, 90, 150, 255], [(0.2, 0.4, 0.9), (1, 0.8, 0.2), (1, 0.3, 0.1), (1, 1, 1)], [0, 0.02, 0.2, 1]
)


def waves(n: int = 56) -> Volume:
    z, y, x = np.ogrid[: n - 3, : n + 5, :n]
    r = np.sqrt((x - n / 2) ** 2 + (y - n / 2) ** 2 + (z - n / 2) ** 2) / n
    inside = 120 + 60 * np.sin(x / 5) * np.sin(y / 7) * np.sin(z / 6)
    return Volume(np.where(r < 0.42, inside, 0).astype(np.uint8), (1.0, 0.9, 1.2), name="waves")


VOLUME = waves()


@pytest.fixture(autouse=True)
def always(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small pictures are drawn along with small ones, too."""
    monkeypatch.setattr("texvol.rendering.streaming.side_pictures._LEAST_BYTES", 0.0)


def stored(volume: Volume = VOLUME, **scene: Any) -> tuple[Scene, list[Counted]]:
    camera = Camera.framing(volume, eye=volume.centre + volume.radius * np.array([1.5, 1.1, 0.8]))
    store, sources = large(volume, chunk=8, memory=volume.values.nbytes // 2)
    return Scene(store, **({"transfer_function": MEDIUM, "camera": camera, "classification": "post"} | scene)), sources


def reads_of(sources: list[Counted]) -> int:
    return sum(int(each.reads.sum()) for each in sources)


def in_memory(scene: Scene) -> Scene:
    return replace(scene, volume=VOLUME)


@pytest.mark.parametrize("rate", [0.5, 2])
@pytest.mark.parametrize("classification", ["extinction", "post", "integrated"])
def test_the_estimate_bounds_the_error_and_reads_nothing_again(
    renderer: Renderer, classification: str, rate: float
) -> None:
    scene, sources = stored(classification=classification)
    picture = renderer.render(scene, SIZE, sampling_rate=rate, level=0)
    before = reads_of(sources)
    estimate = renderer.quick_estimate()
    assert estimate is not None and reads_of(sources) == before > 0
    off = float(np.abs(picture - raycast(in_memory(scene), SIZE)).max())
    assert off <= estimate <= MOST_ABOVE * off


def test_it_is_near_that_of_the_volume_in_memory(renderer: Renderer) -> None:
    scene, _ = stored()
    eye = tuple(VOLUME.centre + VOLUME.radius * np.array([0.9, 1.3, 0.7]))
    scene = replace(scene, camera=Camera.perspective(eye, tuple(VOLUME.centre), (0, 0, 1), fov=40), lighting=Lighting())
    renderer.render(scene, SIZE, sampling_rate=2, level=0)
    along = renderer.quick_estimate()
    renderer.render(in_memory(scene), SIZE, sampling_rate=2)
    later = renderer.quick_estimate()
    assert along is not None and later is not None
    assert later / 3 < along < 3 * later


def test_the_report_takes_it_for_values_that_are_stored_as_they_are(renderer: Renderer) -> None:
    scene, sources = stored()
    renderer.render(scene, SIZE, sampling_rate=1, level=0)
    once, estimate = reads_of(sources), renderer.quick_estimate()
    assert renderer.stats["estimated_error"] == pytest.approx(estimate, rel=1e-5)
    assert reads_of(sources) <= 2.5 * once  # slabs are counted by one more picture


def test_the_report_draws_texels_that_are_rounded_once_more(renderer: Renderer) -> None:
    volume = Volume(VOLUME.values.astype(np.float32) + np.float32(1 / 3), VOLUME.spacing, name="floats")
    scene, sources = stored(volume)
    picture = renderer.render(scene, SIZE, sampling_rate=1, level=0)
    once, quick, told = reads_of(sources), renderer.quick_estimate(), renderer.stats["estimated_error"]
    assert reads_of(sources) > 2.5 * once  # for the count of slabs, and for pictures of other texels
    off = float(np.abs(picture - raycast(replace(scene, volume=volume), SIZE)).max())
    assert quick is not None
    assert off <= quick <= MOST_ABOVE * off and off <= told <= MOST_ABOVE * off


def test_distributions_of_coarse_samples_do_not_vouch_for_themselves(renderer: Renderer) -> None:
    scene, _ = stored()
    renderer.render(scene, SIZE, sampling_rate=1, level=0)
    assert renderer._pictures.in_parts.hidden_rounding == "nothing"
    renderer.render(scene, SIZE, sampling_rate=1, level=1)
    assert renderer._pictures.in_parts.hidden_rounding == "values"


def test_pictures_that_are_drawn_for_their_time_are_drawn_alone(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[SidePictures] = []

    class Noted(SidePictures):
        def __init__(self, *how: Any) -> None:
            super().__init__(*how)
            made.append(self)

    monkeypatch.setattr("texvol.rendering.streaming.picture.SidePictures", Noted)
    renderer.render(stored()[0], SIZE, sampling_rate=1, level=0, repeat=3)
    assert len(made) == 1 and renderer.quick_estimate() is not None


@pytest.mark.parametrize("classification", ["extinction", "post", "integrated"])
def test_the_picture_is_the_same_with_and_without(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, classification: str
) -> None:
    scene, _ = stored(classification=classification)
    with_estimate = np.array(renderer.render(scene, SIZE, sampling_rate=1, level=0))
    monkeypatch.setattr("texvol.rendering.streaming.side_pictures._LEAST_BYTES", np.inf)
    other, _ = stored(classification=classification)
    assert_array_equal(renderer.render(other, SIZE, sampling_rate=1, level=0), with_estimate)


@pytest.mark.parametrize(
    ("scene", "how"),
    [
        ({"classification": "slab"}, {"sampling_rate": 1}),
        ({"mode": "isosurface", "isovalue": 100, "transfer_function": None}, {"sampling_rate": 1}),
        ({"mode": "xray", "transfer_function": None}, {"sampling_rate": 1}),
        ({}, {"slab_thickness": 2.2 * 2 * VOLUME.radius / MOST_SLABS}),
    ],
)
def test_nothing_is_drawn_along_that_tells_nothing(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, scene: dict[str, Any], how: dict[str, Any]
) -> None:
    monkeypatch.setattr("texvol.rendering.streaming.picture.SidePictures", None)  # would fail
    renderer.render(stored(**scene)[0], (8, 8), level=0, **how)
    assert renderer.last is not None and renderer.last.error is None


def test_small_pictures_are_of_the_last_picture_alone(renderer: Renderer) -> None:
    scene, _ = stored()
    renderer.render(scene, SIZE, sampling_rate=0.5, level=0)
    coarse = renderer.quick_estimate()
    renderer.render(scene, SIZE, sampling_rate=4, level=0)
    fine = renderer.quick_estimate()
    assert coarse is not None and fine is not None and fine < coarse / 3
    renderer.render(in_memory(scene), SIZE, max_error=0.05)
    assert renderer.quick_estimate() == renderer.estimate


def test_a_part_that_cannot_be_read_leaves_nothing_behind(renderer: Renderer) -> None:
    scene, sources = stored()
    assert isinstance(scene.volume, LargeVolume)
    read, broken = sources[0].read, [True]

    def fails(box: Any) -> np.ndarray:
        if broken and sources[0].reads.sum() > 40:
            raise InputError("waves: chunk 3/2/1 of level 0 is damaged")
        return read(box)

    sources[0].read = fails  # type: ignore[method-assign]
    with pytest.raises(InputError, match="chunk 3/2/1"):
        renderer.render(scene, SIZE, sampling_rate=1, level=0)
    broken.clear()
    drawn = renderer.render(scene, SIZE, sampling_rate=1, level=0)
    assert renderer.quick_estimate() is not None
    np.testing.assert_allclose(drawn, renderer.render(in_memory(scene), SIZE, sampling_rate=1), atol=2e-6)


def test_the_picture_knows_it_without_being_drawn_again(renderer: Renderer) -> None:
    scene, sources = stored()
    picture = renderer.render(scene, SIZE, sampling_rate=1, level=0)
    before = reads_of(sources)
    assert picture.error is not None and picture.error == renderer.quick_estimate()
    assert reads_of(sources) == before
