"""Odd scenes hold what their estimates say; the campaign that says so sees pictures that are not what they say."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.odd_scenes import outcomes as odd_scenes
from support.odd_scenes.scenes import odd_scene

from texvol import InputError, Renderer
from texvol.scene.scene import CLASSIFICATIONS, MODES

SMALL = (16, 16)


@pytest.mark.slow
@pytest.mark.parametrize("far_off", [False, True])
def test_odd_scenes_are_within_what_is_said_of_them(renderer: Renderer, far_off: bool) -> None:
    scenes = (replace(odd_scene(number, seed=1, far_off=far_off), size=SMALL) for number in range(8))
    outcomes = [odd_scenes.outcome(odd, renderer) for odd in scenes]
    wrong = [
        odd_scenes.told(found) for found in outcomes if found["verdict"] in (odd_scenes.UNKNOWN, odd_scenes.FAILED)
    ]
    assert not wrong, "\n".join(wrong)
    assert sum(found["verdict"] == odd_scenes.WITHIN for found in outcomes) > len(outcomes) / 2


def test_scenes_are_of_every_mode_and_type() -> None:
    words = {word.split()[0] for number in range(300) for word in odd_scene(number).words}
    assert words >= {*MODES, *CLASSIFICATIONS, "lit", "masked", "added", "sheared", "perspective", "eye", "caps"}
    assert words >= {"float16", "float32", "float64", "int8", "uint16", "int32", "uint32", "int64", "uint64"}
    assert words >= {"far", "a", "some", "opaque", "emissive", "narrow", "wide"}
    for number in range(60):
        odd = odd_scene(number, far_off=True)
        assert {"far", "a"} & {word.split()[0] for word in odd.words}
        assert "max_error" in odd.options


def test_a_scene_depends_on_its_number_alone() -> None:
    first, again = odd_scene(7), odd_scene(7)
    assert first.words == again.words
    np.testing.assert_array_equal(first.scene.volume.values, again.scene.volume.values)
    assert odd_scene(8).words != first.words


class Lying:
    """A renderer whose pictures are too bright, by as much as it does not say."""

    def __init__(self, renderer: Renderer, error: float, estimate: float) -> None:
        self._renderer, self._error, self._estimate = renderer, error, estimate

    def render(self, *arguments: Any, **options: Any) -> np.ndarray:
        return self._renderer.render(*arguments, **options) + np.float32(self._error)

    @property
    def stats(self) -> dict[str, Any]:
        return {"estimated_error": self._estimate}


def plain(*, wanted: float | None) -> Any:
    """A scene of light, drawn as finely as needed."""
    numbers = (number for number in range(99) if odd_scene(number).words[0] == "composite")
    odd = next(odd for odd in map(odd_scene, numbers) if not {"lit", "added"} & {w.split()[0] for w in odd.words})
    return replace(odd, options={"max_error": wanted} if wanted else {"sampling_rate": 4.0}, size=SMALL)


@pytest.mark.parametrize(
    ("wanted", "error", "estimate", "verdict"),
    [
        (None, 0.5, 1e-4, odd_scenes.UNKNOWN),
        (None, 0.5, 0.4, odd_scenes.KNEW),
        (0.1, 0.5, 0.05, odd_scenes.UNKNOWN),
        (0.1, 0.5, 0.2, odd_scenes.KNEW),
        (0.1, 0.0, 0.05, odd_scenes.WITHIN),
        (0.1, np.nan, 0.05, odd_scenes.UNKNOWN),
    ],
)
def test_a_picture_that_is_not_what_is_said_of_it_is_seen(
    renderer: Renderer, wanted: float | None, error: float, estimate: float, verdict: str
) -> None:
    found = odd_scenes.outcome(plain(wanted=wanted), Lying(renderer, error, estimate))  # type: ignore[arg-type]
    assert found["verdict"] == verdict, odd_scenes.told(found)


def test_refusals_and_failures_are_told_apart(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    for error, verdict in ((InputError("no"), odd_scenes.REFUSED), (KeyError("no"), odd_scenes.FAILED)):

        def fail(*_: Any, error: Exception = error, **__: Any) -> None:
            raise error

        monkeypatch.setattr(odd_scenes, "raycast", fail)
        assert odd_scenes.outcome(plain(wanted=None), renderer)["verdict"] == verdict


def test_a_run_goes_on_where_it_has_ended(tmp_path: Path) -> None:
    kept = tmp_path / "odd.jsonl"
    lines = [{"number": number, "words": ["mip"], "verdict": odd_scenes.WITHIN} for number in (0, 2)]
    kept.write_text("".join(json.dumps(line) + "\n" for line in lines))
    assert list(odd_scenes.kept(kept)) == [0, 2]
    assert "| mip | 2 | 2 | 0 |" in odd_scenes.table(lines)
