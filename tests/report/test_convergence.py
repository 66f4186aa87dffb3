"""The sweep of speed against error: what it measures, what it leaves out, and what it recommends."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from support.scenes import BONE, FOG, smooth_volume

from texvol.comparison import Difference
from texvol.rendering.renderer import Renderer
from texvol.report import vtk_mappers
from texvol.report.convergence import (
    Limits,
    Measurement,
    Setting,
    Truths,
    discretisation_max,
    fastest_within,
    most_accurate,
    pareto_front,
    predicted_seconds,
    settings,
    sweep,
    total_rms,
)
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.installation import install_command

SIZE = (48, 40)


def measured(seconds: float, error: float, rate: float = 1.0, classification: str = "post") -> Measurement:
    difference = Difference(error, error / 10, error / 20, (0, 0), 0)
    return Measurement(
        Setting(classification, rate), 1 / rate, seconds=seconds, discretisation=difference, total=difference
    )


@pytest.fixture(scope="module")
def scene() -> Scene:
    volume = smooth_volume(24)
    return Scene(volume, BONE, Camera.framing(volume, "perspective"), classification="slab")


def test_the_front_holds_what_nothing_beats() -> None:
    fast, good, beaten, best = measured(1, 0.1), measured(2, 0.01), measured(3, 0.05), measured(4, 0.001)
    assert pareto_front([beaten, best, good, fast], discretisation_max) == [fast, good, best]


def test_of_two_equally_fast_the_better_is_on_the_front() -> None:
    worse, better = measured(1, 0.1), measured(1, 0.01)
    assert pareto_front([worse, better], discretisation_max) == [better]


def test_broken_pictures_and_skipped_settings_are_not_on_the_front() -> None:
    infinite = measured(0.1, float("inf"))
    skipped = Measurement(Setting("slab", 8), 0.125, skipped="too slow")
    good = measured(1, 0.1)
    assert pareto_front([infinite, skipped, good], discretisation_max) == [good]


def test_the_fastest_within_a_limit() -> None:
    fast, good = measured(1, 0.1), measured(2, 0.01)
    assert fastest_within([good, fast], discretisation_max, 0.2) is fast
    assert fastest_within([good, fast], discretisation_max, 0.01) is good
    assert fastest_within([good, fast], discretisation_max, 0.009) is None
    assert most_accurate([good, fast], total_rms) is good


def test_a_frame_is_expected_to_take_as_long_as_its_slabs() -> None:
    done = [measured(0.2, 0, 1.0), measured(0.3, 0, 2.0), measured(9.0, 0, 2.0, "slab")]
    assert predicted_seconds(Setting("post", 8.0), done) == pytest.approx(1.2)
    assert predicted_seconds(Setting("integrated", 8.0), done) is None


def test_what_would_take_too_long_is_left_out() -> None:
    limits = Limits(setting_seconds=4, least_frames=3)
    assert not limits.reason_to_skip(0.9)  # with the cold one, four frames
    assert "4 s" in limits.reason_to_skip(1.1)
    assert "used up" in Limits(sweep_seconds=0).reason_to_skip(None)


def test_every_classification_rate_and_format_is_swept() -> None:
    chosen = settings()
    assert len(set(chosen)) == len(chosen)
    assert {(each.classification, each.sampling_rate) for each in chosen} == {
        (classification, rate)
        for classification in ("slab", "extinction", "post", "integrated")
        for rate in (0.5, 1, 2, 4, 8)
    }
    assert {each.slicing for each in chosen if each.classification == "slab"} == {"stacks", "polygons", "wilson"}
    assert {each.texture_format for each in chosen} == {"auto", "rgba8", "rgba16f", "rgba32f"}
    assert {each.target_format for each in chosen} == {"auto", "rgba8", "rgba16f"}  # auto is rgba32f


def test_a_sweep_tells_discretisation_from_model_error(renderer: Renderer, scene: Scene) -> None:
    truths = Truths.of(scene, SIZE)
    chosen = [Setting(each, rate) for rate in (1.0, 4.0) for each in ("slab", "post", "extinction")]
    limits = Limits(least_frames=1, frames_seconds=0)
    rows = {each.setting: each for each, _ in sweep(renderer, scene, SIZE, chosen, truths, limits)}
    assert truths.model_error is not None
    model = truths.model_error.rms_error
    for setting, row in rows.items():
        assert row.discretisation is not None and row.total is not None and row.seconds
        assert row.bake_seconds is not None and row.upload_seconds is not None
        if setting.classification == "post":
            assert row.total == row.discretisation
        elif setting.sampling_rate == 4:  # by the triangle inequality
            assert abs(row.total.rms_error - model) <= row.discretisation.rms_error
            assert row.discretisation.rms_error < model / 3
    for classification in ("slab", "post", "extinction"):
        coarse, fine = (rows[Setting(classification, rate)].discretisation for rate in (1.0, 4.0))
        assert fine is not None and coarse is not None and fine.rms_error < coarse.rms_error / 2


def test_what_auto_chose_is_not_measured_twice(renderer: Renderer, scene: Scene) -> None:
    chosen = [
        Setting("extinction", 1.0),
        *(Setting("extinction", 1.0, each) for each in ("rgba8", "rgba16f", "rgba32f")),
    ]
    limits = Limits(least_frames=1, frames_seconds=0)
    rows = [each for each, _ in sweep(renderer, scene, SIZE, chosen, Truths(None, None), limits)]
    formats = [each.texture_format for each in rows]
    assert sorted(formats) == ["rgba16f", "rgba32f", "rgba8"]


def test_without_an_oracle_times_are_still_measured(renderer: Renderer, scene: Scene) -> None:
    limits = Limits(least_frames=1, frames_seconds=0)
    [(row, picture)] = sweep(renderer, scene, SIZE, [Setting("slab", 1.0)], Truths(None, None), limits)
    assert row.seconds and picture is not None
    assert row.total is None and row.discretisation is None


@pytest.mark.parametrize(
    "mapper, projection",
    [("VTK GPU", "orthographic"), ("VTK GPU", "perspective"), ("VTK fixed-point", "perspective")],
)
def test_vtk_draws_the_same_scene(renderer: Renderer, mapper: str, projection: str) -> None:
    assert mapper in vtk_mappers.MAPPERS
    pytest.importorskip("vtkmodules")
    # Anisotropic, left-handed, turned, far from the origin and small: all that the set-up has to carry over.
    cosine, sine = np.cos(0.5), np.sin(0.5)
    direction = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, -1]])
    values = smooth_volume(24).values[:, :20, :16]
    volume = Volume(values, np.array([1, 1.5, 0.7]) * 1e-3, (5, -3, 2), direction)
    thin = replace(FOG, extinctions=FOG.extinctions * 3e3)
    scene = Scene(volume, thin, Camera.framing(volume, projection), classification="slab")  # type: ignore[arg-type]
    truths = Truths.of(scene, (80, 64))
    assert truths.postclassified is not None and truths.postclassified[..., 3].max() > 0.3
    limits = Limits(least_frames=1, frames_seconds=0)
    [(row, _)] = vtk_mappers.sweep(renderer, scene, (80, 64), mapper, [2.0], truths, limits)
    assert row.seconds and row.processor_seconds and row.total is not None
    # 8 bits alone are 1.1e-3. The fixed-point mapper blurs edges over a pixel: in a picture this small that is most.
    assert row.total.rms_error < (3e-3 if mapper == "VTK GPU" else vtk_mappers.MOST_DIFFERENT)


def test_vtk_that_draws_something_else_is_not_compared(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("vtkmodules")
    volume = smooth_volume(16)
    scene = Scene(volume, FOG, Camera.framing(volume), classification="slab")
    asked = vtk_mappers._vtk_points

    def twice_as_dense(transfer_function: object, volume: Volume, unit: float) -> list[list[float]]:
        return asked(transfer_function, volume, 2 * unit)  # type: ignore[arg-type]

    monkeypatch.setattr(vtk_mappers, "_vtk_points", twice_as_dense)
    with pytest.raises(vtk_mappers.VtkError, match="this scene differently"):
        list(vtk_mappers.sweep(renderer, scene, SIZE, "VTK GPU", [1.0], Truths(None, None), Limits()))


def test_a_sheared_grid_is_refused_for_vtk(renderer: Renderer) -> None:
    volume = Volume(smooth_volume(8).values, direction=[[1, 0.3, 0], [0, 1, 0], [0, 0, 1]])
    scene = Scene(volume, FOG, Camera.framing(volume), classification="slab")
    with pytest.raises(vtk_mappers.VtkError, match="sheared"):
        list(vtk_mappers.sweep(renderer, scene, SIZE, "VTK GPU", [1.0], Truths(None, None), Limits()))


def test_without_vtk_the_reason_is_said(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    scene = Scene(smooth_volume(8), FOG, Camera.framing(smooth_volume(8)), classification="slab")
    with pytest.raises(vtk_mappers.VtkError, match=re.escape(install_command("bench"))):
        list(vtk_mappers.sweep(renderer, scene, SIZE, "VTK GPU", [1.0], Truths(None, None), Limits()))


def test_a_crash_of_vtk_is_a_reason_and_nothing_more(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("vtkmodules")
    monkeypatch.setattr(vtk_mappers, "MAPPERS", {"VTK GPU": "gpu"})
    monkeypatch.setattr(vtk_mappers, "_save", lambda folder, scene, request: None)  # it finds no file to read
    scene = Scene(smooth_volume(8), FOG, Camera.framing(smooth_volume(8)), classification="slab")
    with pytest.raises(vtk_mappers.VtkError, match=r"status 1: .*request\.json"):
        list(vtk_mappers.sweep(renderer, scene, SIZE, "VTK GPU", [1.0], Truths(None, None), Limits()))
