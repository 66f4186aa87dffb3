"""Volumes in stores: a coarse level stands in for them in the window, pictures at rest come from the store."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.large import large
from support.stores import write_ome

from texvol import AddedVolume, Light, Lighting, Renderer, Scene, TransferFunction, Volume
from texvol.annotation import Annotation
from texvol.formats.pictures.image import eight_bits
from texvol.output.export import PictureExport
from texvol.rendering.streaming import progressive
from texvol.scene.display import found_window
from texvol.scene.gradient import Estimator
from texvol.scene.large_volume import LargeVolume
from texvol.window.document import opened_file
from texvol.window.jobs import Answer, Job, Showing
from texvol.window.painting import JobRunner
from texvol.window.stand_in import StandIn, at_rest, stand_in, with_stand_ins

FOG = TransferFunction([0.3, 0.6, 1.0], [(1, 0, 0), (1, 0.5, 0), (1, 1, 1)], [0.0, 0.1, 0.3])
SIZE = (48, 40)


def ball(side: int = 48) -> np.ndarray:
    z, y, x = np.mgrid[:side, :side, :side] / (side - 1) - 0.5
    return (1 - 2 * np.sqrt(x * x + y * y + z * z)).astype(np.float32)


@pytest.fixture(scope="module")
def runner() -> Iterator[tuple[JobRunner, list[Answer]]]:
    answers: list[Answer] = []
    drawing = JobRunner(answers.append, lambda: 0)
    yield drawing, answers
    drawing.close()


def stored(memory: int) -> tuple[LargeVolume, Any]:
    return large(Volume(ball()), 8, levels=4, memory=memory)


def test_the_finest_level_that_fits_stands_in() -> None:
    volume, sources = stored(8 * 24**3 * 4)
    standing = stand_in(volume)
    assert isinstance(standing, StandIn) and standing.level == 1 and standing.large is volume
    assert standing.dimensions == (24, 24, 24) and standing.source == volume.source
    assert_allclose(standing.corners_from_centre + standing.centre, volume.corners_from_centre + volume.centre)
    assert not sources[0].reads.any() and volume.memory == 4 * 24**3 * 4  # two processes paint


def test_a_small_store_is_read_and_other_volumes_are_left_alone() -> None:
    volume, _ = stored(8 * 48**3 * 4)
    assert not isinstance(stand_in(volume), LargeVolume | StandIn)
    plain = Scene(Volume(ball(8)), FOG)
    assert with_stand_ins(plain) is plain and at_rest(plain) is plain


def test_only_what_can_be_drawn_in_parts_comes_from_the_store_at_rest() -> None:
    scene = with_stand_ins(Scene(stored(1 << 18)[0], FOG, classification="post"))
    assert isinstance(scene.volume, StandIn) and isinstance(at_rest(scene).volume, LargeVolume)
    assert isinstance(at_rest(replace(scene, mode="mip")).volume, LargeVolume)
    surface = replace(scene, mode="isosurface", isovalue=0.5)
    assert isinstance(at_rest(surface).volume, LargeVolume)
    adaptive = replace(surface, gradient=Estimator("adaptive"))
    assert at_rest(adaptive) is adaptive


def test_numbers_have_one_window_in_motion_and_at_rest() -> None:
    """A level of means has a smaller range than the samples, which the store knows."""
    scene = with_stand_ins(Scene(stored(1 << 18)[0], mode="mip"))
    nothing = np.zeros((4, 4, 4), np.float32)
    assert isinstance(scene.volume, StandIn) and scene.volume.values.max() < scene.volume.large.finite_range[1]
    assert found_window(nothing, scene) == found_window(nothing, at_rest(scene))


def test_pictures_at_rest_become_finer_and_tell_level_and_error(
    runner: tuple[JobRunner, list[Answer]], renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progressive, "_FIRST", 12**3)  # samples of the coarsest of them
    monkeypatch.setattr(progressive, "_LEAST_SIDE", 8)
    painter, answers = runner
    answers.clear()
    volume, _ = stored(1 << 20)
    painter.paint(Job(1, "rest", Scene(volume, FOG, classification="post"), SIZE, {"max_error": 1 / 255}, Showing()))
    assert [answer.final for answer in answers] == [False] * (len(answers) - 1) + [True], answers[-1].text
    answers[:] = [answer for answer in answers if answer.kind == "picture"]
    levels = [answer.metadata["level"] for answer in answers]
    assert len(levels) > 1 and levels == sorted(levels, reverse=True)
    error = answers[-1].metadata["estimated_error"]
    assert 0 < error < 0.3
    wanted = renderer.render(Scene(volume, FOG, classification="post"), SIZE)
    assert answers[-1].pixels is not None and wanted[..., 3].max() > 0.1


def of_two(memory: int) -> Scene:
    green = TransferFunction([0.3, 1.0], [(0, 1, 0), (0, 1, 0)], [0.0, 0.2])
    return Scene(stored(memory)[0], FOG, added=(AddedVolume(stored(memory)[0], green),))


@pytest.mark.parametrize("kind", ["mip", "several", "shadows"])
def test_what_fits_in_memory_is_final_at_full_resolution(
    kind: str, runner: tuple[JobRunner, list[Answer]], renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Coarse levels come first, in parts, if they can be drawn so."""
    monkeypatch.setattr(progressive, "_FIRST", 12**3)
    monkeypatch.setattr(progressive, "_LEAST_SIDE", 8)
    painter, answers = runner
    answers.clear()
    memory = 8 * 48**3  # of 4 bytes each; stand-ins may take an eighth, and half is left for each painter
    shadows = Scene(stored(memory)[0], FOG, lighting=Lighting((Light("directional", (1, -2, 1.5)),), shadows=True))
    scene = {"mip": Scene(stored(memory)[0], mode="mip"), "several": of_two(3 * memory), "shadows": shadows}[kind]
    scene = with_stand_ins(scene.classified_as("post"))
    assert isinstance(scene.volume, StandIn)
    painter.paint(Job(1, "rest", at_rest(scene), SIZE, {"max_error": 1 / 64}, Showing()))
    pictures = [answer for answer in answers if answer.kind == "picture"]
    assert [answer.final for answer in pictures] == [False] * (len(pictures) - 1) + [True], answers[-1].text
    levels = [answer.metadata["level"] for answer in pictures]
    assert levels == sorted(levels, reverse=True) and levels[-1] == 0 and (levels[0] > 0) == (kind != "shadows")
    assert 0 < pictures[-1].metadata["estimated_error"] <= pictures[-1].metadata["wanted_error"]
    in_memory = at_rest(scene).in_memory("the truth")
    exact = renderer.render(in_memory, SIZE, sampling_rate=4)
    shown = eight_bits(PictureExport(cast(Any, Showing()), Annotation()).of(exact, in_memory, "window.png"))
    assert pictures[-1].pixels is not None
    assert np.abs(pictures[-1].pixels.astype(int) - shown).max() <= 12


def test_channels_of_a_store_keep_what_they_are(tmp_path: Path) -> None:
    both = np.stack([ball(), ball()[::-1]])
    path = write_ome(tmp_path / "v.ome.zarr", both, axes="czyx", chunk=8, levels=3)
    for memory in (1 << 17, 1 << 30):
        scene = opened_file(str(path), SIZE, {"memory": memory}).scene
        assert [each.channel and each.channel.number for each in scene.volumes] == [0, 1]
        assert isinstance(scene.volume, StandIn) == (memory == 1 << 17)
        assert scene.transfer_function is not None and scene.transfer_function.emissive


def test_a_store_is_opened_without_its_finest_level(tmp_path: Path) -> None:
    path = write_ome(tmp_path / "v.ome.zarr", ball(), chunk=8, levels=3)
    document = opened_file(str(path), SIZE, {"memory": 1 << 17})
    volume = document.scene.volume
    assert isinstance(volume, StandIn) and volume.level > 0
    assert document.scene.transfer_function is not None
