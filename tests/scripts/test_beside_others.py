"""Other programs are given the scene that texvol draws, and their figures are chosen as the page says."""

from __future__ import annotations

import io
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "scripts"))

import benchmark_others as others
import side_process
from benchmark_beside import OTHERS, Beside, table, write_request
from benchmark_chart import Curve, draw_chart
from benchmark_competitors import Trial
from benchmark_scenes import SIZE, built_in
from PIL import Image
from side_given import Given, Medium, pixels_from_voxels, premultiplied, voxels_per_length

from texvol import Camera, Scene, TransferFunction, Volume

_LEFT_HANDED = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1.0]])  # columns are the axes of the grid
_LEFT_HANDED[:, 0] *= -1


def _scene(projection: str) -> Scene:
    """A turned and left-handed grid with uneven spacings, away from 0."""
    direction = _LEFT_HANDED * (1 if np.linalg.det(_LEFT_HANDED) < 0 else np.array([1, 1, -1]))
    values = np.arange(4 * 5 * 6, dtype=np.float32).reshape(4, 5, 6)
    volume = Volume(values, spacing=(2, 3, 5), origin=(100, 50, -20), direction=direction)
    function = TransferFunction(np.array([0, 119]), np.array([(1, 0, 0), (0, 1, 0.5)]), np.array([0.0, 0.1]))
    eye = volume.centre + np.array([30, -50, 20])
    return Scene(volume, function, Camera.framing(volume, projection, eye=eye), classification="post")  # type: ignore[arg-type]


def _given(folder: Path, scene: Scene) -> tuple[Given, dict[str, Any]]:
    write_request(folder, scene)
    told = json.loads((folder / "request.json").read_text())
    return Given.of(folder, told), told


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_matrix_and_rays_of_other_programs_meet_the_pixels_of_texvol(tmp_path: Path, projection: str) -> None:
    scene = _scene(projection)
    assert np.linalg.det(scene.volume.direction) < 0
    given, _ = _given(tmp_path, scene)
    volume, (row, column) = scene.volume, (200, 310)
    origins, directions = scene.camera.rays(SIZE)  # type: ignore[union-attr]
    near, far = given.spans()
    ray = given.rays[:, row, column]
    place = ray[0] + (near + far)[row, column] / 2 * ray[1]  # in the box, in smallest spacings
    # The same point in the world, by texvol's ray: lengths are in smallest spacings.
    in_world = origins[row, column] + (near + far)[row, column] / 2 * volume.smallest_spacing * directions[row, column]
    index = volume.index_from_world @ (in_world - volume.centre) + np.array(volume.dimensions) / 2 - 0.5
    index[0] = volume.dimensions[0] - 1 - index[0]  # the grid's x axis is reversed
    np.testing.assert_allclose(place / given.spacing - 0.5, index, atol=1e-9)
    assert far[row, column] > near[row, column] > 0 and far[0, 0] == near[0, 0]
    pixel = pixels_from_voxels(given.clip_from_box, given.spacing, given.size) @ [*index, 1.0]
    np.testing.assert_allclose(pixel[:2] / pixel[3], (column + 0.5, row + 0.5), atol=1e-6)
    assert abs(pixel[2]) <= pixel[3]
    i, j, k = np.rint(index).astype(int)
    assert given.values[k, j, i] == volume.values[k, j, volume.dimensions[0] - 1 - i]


def test_media_of_other_programs_are_those_of_the_scene(tmp_path: Path) -> None:
    scene = _scene("orthographic")
    medium = Medium.of(table(scene))
    assert scene.transfer_function is not None
    values = np.linspace(medium.low, medium.high, len(medium.extinctions))
    emission, extinction = scene.transfer_function.classify(values)
    np.testing.assert_allclose(medium.emission / 2, emission, atol=1e-7)  # the smallest spacing is 2
    np.testing.assert_allclose(medium.opacities(1.5), 1 - np.exp(-extinction * 3), atol=1e-6)
    assert _given(tmp_path, scene)[1]["media"]["check"]["table"][0][3] > 0


def test_media_are_shifted_and_widened_without_another_value_changing() -> None:
    medium = Medium(-3.0, 5.0, np.linspace(0, 1, 15).reshape(5, 3), np.linspace(0, 4, 5))
    wide = medium.widened()
    assert (wide.low, wide.high, len(wide.extinctions)) == (-5.0, 7.0, 7)
    shifted_values, shifted = wide.from_one(np.array([-3.0, 1.0, 5.0]))
    places = np.linspace(shifted.low, shifted.high, len(shifted.extinctions))
    assert shifted_values.min() > shifted.low == 1.0
    np.testing.assert_allclose(np.interp(shifted_values, places, shifted.extinctions), [0, 2, 4])
    *emission, extinction = medium.per(10.0)
    np.testing.assert_allclose(emission, (medium.colors * medium.extinctions[:, np.newaxis] * 10).T)
    np.testing.assert_allclose(extinction, medium.extinctions * 10)


def test_steps_in_voxels_have_one_length_only_where_rays_are_parallel_or_spacings_equal() -> None:
    parallel, divergent = np.array([[(0, 0, 1.0)] * 2]), np.array([[(0, 0, 1.0), (0, 0.6, 0.8)]])
    assert voxels_per_length(parallel, np.array([1, 1, 2.0])) == 0.5
    assert voxels_per_length(divergent, np.ones(3)) == pytest.approx(1)
    with pytest.raises(ValueError, match="steps are equal in voxels"):
        voxels_per_length(divergent, np.array([1, 1, 2.0]))
    np.testing.assert_allclose(premultiplied(np.array([[[1, 0.5, 0, 0.5]]])), [[[0.5, 0.25, 0, 0.5]]])


def test_the_other_process_answers_each_question_and_classifies_when_the_medium_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[Any] = []

    class Stub:
        def classify(self, medium: Medium) -> None:
            told.append(medium)

        def draw(self, family: str, rate: float) -> np.ndarray:
            return np.full((1, 1, 4), rate)

    path = str(tmp_path / "picture.npy")
    asked = [("check", 2), ("scene", 1), ("scene", 3)]
    lines = [json.dumps({"medium": medium, "family": "", "rate": rate, "picture": path}) for medium, rate in asked]
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n".join(lines)))
    answers: list[dict[str, Any]] = []
    side_process.serve(Stub(), {"check": "soft", "scene": "hard"}, answers.append)  # type: ignore[arg-type,dict-item]
    assert told == ["soft", "hard"] and len(answers) == 3
    assert answers[0].keys() == {"seconds", "processor_seconds"} and np.load(path)[0, 0, 0] == 3


def test_a_program_that_is_missing_says_how_it_is_installed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("benchmark_beside.ENVIRONMENT", tmp_path)
    missing = Beside(OTHERS[0], None, built_in("fog", 16), np.zeros((1, 1, 4)), 1.0)  # type: ignore[arg-type]
    missing.search()
    assert "sh scripts/setup.sh '' others" in missing.problem and not missing.trials
    assert others.cells(missing, {}).startswith("| pyvista | not installed")


def _trial(seconds: float, error: float) -> Trial:
    return Trial((seconds, error), "", seconds, error, 2 * seconds)


def test_what_is_timed_again_is_the_front_with_a_winner_for_each_error() -> None:
    slow = _trial(5, 2e-2)  # both slower and farther than another
    trials = [_trial(9, 1e-5), slow, *(_trial(4 / error, error * 1e-2) for error in np.geomspace(10, 0.05, 30))]
    chosen = others.choice(trials)
    assert slow not in others.front(trials) and slow not in chosen
    assert [each.rms for each in chosen] == sorted((each.rms for each in chosen), reverse=True)
    assert next(each for each in others.front(trials) if each.rms <= 3e-3) in chosen
    assert len(chosen) <= 6 + 2 * 3 and others.choice([]) == []


def test_opacities_of_8_bits_tell_thin_media_by_a_long_path() -> None:
    thin = Medium(0, 1, np.ones((64, 3)), np.linspace(0, 0.007, 64))

    def told(path: float) -> np.ndarray:
        return -np.log1p(-np.rint(255 * thin.opacities(path)) / 255) / path

    assert np.abs(told(1.0) - thin.extinctions).max() > 0.25 * 0.007
    assert np.abs(told(thin.path_for_bits) - thin.extinctions).max() < 0.01 * 0.007


def test_the_referee_agrees_with_the_truth_and_not_with_a_tenth_less() -> None:
    random = np.random.default_rng(3)
    truth = np.full((64, 64, 4), 0.5)
    pictures = (random.random((16, 64, 64, 4)) < 0.5).astype(np.float32)
    assert others.referee(pictures, truth).agrees
    off = others.referee(pictures, truth * 0.9)
    assert not off.agrees and off.offset > 20
    local = truth.copy()
    local[:32] += 0.2
    local[32:] -= 0.2  # the mean is right
    there = others.referee(pictures, local)
    assert not there.agrees and there.excess > 20


def test_the_page_has_the_marks_and_what_is_between_them_is_replaced(tmp_path: Path) -> None:
    assert others.PAGE.read_text(encoding="utf-8").count(others.BEGIN) == 1
    page = tmp_path / "page.md"
    page.write_text(f"before\n{others.BEGIN}\n\nold\n\n{others.END}\nafter\n", encoding="utf-8")
    for _ in range(2):
        others.put_between("new", page)
    assert page.read_text(encoding="utf-8") == f"before\n{others.BEGIN}\n\nnew\n\n{others.END}\nafter\n"
    page.write_text("nothing", encoding="utf-8")
    with pytest.raises(SystemExit, match="must have the lines"):
        others.put_between("new", page)


def test_the_chart_has_a_panel_for_each_scene_and_few_colours(tmp_path: Path) -> None:
    curve = Curve("texvol", [1e-2, 1e-3], [0.01, 0.02])
    draw_chart({"fog": [curve, replace(curve, name="yt")], "bone": [curve], "engine": [curve]}, tmp_path / "chart.png")
    with Image.open(tmp_path / "chart.png") as chart:
        assert chart.mode == "P" and chart.width > 900
    assert (tmp_path / "chart.png").stat().st_size < 100_000
