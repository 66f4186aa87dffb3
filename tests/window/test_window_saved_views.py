"""Saved views: steps of the history, and moves of the camera to them and through them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from support.desks import SIZE, desk_with, done, said
from support.panel_frames import StillDirector

from texvol.scene.orbit import Turn
from texvol.scene.tour import SavedView, Tour
from texvol.util.errors import InputError
from texvol.window import exporting, film_accuracy, motion, saved_views, saving
from texvol.window.desk import Desk
from texvol.window.jobs import Answer
from texvol.window.navigation import View, orbit
from texvol.window.thumbnails import SIZE as SMALL
from texvol.window.thumbnails import Thumbnails


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Desk:
    np.save(tmp_path / "v.npy", np.random.default_rng(0).random((6, 5, 4), np.float32))
    monkeypatch.chdir(tmp_path)
    opened = desk_with("v.npy")
    opened.director.shown = None
    return opened


def turned(desk: Desk, right: float) -> Any:
    assert desk.document is not None
    desk.document.look(orbit(desk.document.view, right, 0.1))
    return desk.document


def names(desk: Desk) -> list[str]:
    assert desk.document is not None
    return [each.name for each in desk.document.tour.views]


def play(desk: Desk, seconds: float, steps: int = 20) -> list[View]:
    """Views of so many frames."""
    seen = []
    for now in np.linspace(desk.now, desk.now + seconds, steps):
        desk.now = float(now)
        motion.step(desk)
        assert desk.document is not None
        seen.append(desk.document.view)
    return seen


def test_views_are_saved_named_and_ordered(desk: Desk) -> None:
    first = done(desk, "save-view").view.camera
    second = turned(desk, 1.0).view.camera
    done(desk, "save-view from the side")
    turned(desk, 1.0)
    document = done(desk, "save-view")
    assert names(desk) == ["view 1", "from the side", "view 2"]
    assert [each.camera for each in document.tour.views[:2]] == [first, second]
    saved_views.move(document, 2, 0)
    saved_views.change(document, 1, name="front", seconds=3.5)
    assert names(desk) == ["view 2", "front", "from the side"] and document.tour.views[1].seconds == 3.5
    saved_views.update(desk, document, 1)
    assert document.tour.views[1].camera == document.view.camera
    saved_views.delete(document, 0)
    assert names(desk) == ["front", "from the side"]
    document = done(desk, "save-view")
    assert names(desk)[-1] == "view 1", "a name that is free"
    done(desk, *["undo"] * 3)
    assert names(desk) == ["view 2", "front", "from the side"]
    done(desk, "undo")
    assert names(desk) == ["view 2", "view 1", "from the side"]
    done(desk, *["undo"] * 9, "redo")
    assert names(desk) == ["view 1"]


def test_saved_views_are_changes_that_a_scene_file_keeps(desk: Desk) -> None:
    document = done(desk, "save-view")
    assert document.unsaved
    saving.save_scene("s.toml", document, SIZE)
    assert not document.unsaved
    document.change_tour(document.tour)
    assert len(document.history.past) == 1, "the same views are no step"
    done(desk, "undo")
    assert document.unsaved and not document.tour.views
    words = saving.command_line(document, SIZE, {})
    assert "s.toml" not in words, "the file has a view more"


def test_another_change_keeps_the_views_and_undo_does_not_turn_the_picture(desk: Desk) -> None:
    document = done(desk, "save-view")
    desk.change(background=(0.5, 0.5, 0.5))
    assert names(desk) == ["view 1"]
    here = turned(desk, 0.7).view.camera
    done(desk, "undo")
    assert names(desk) == ["view 1"] and document.scene.background == (0, 0, 0)
    assert document.view.camera == document.scene.camera == here


def test_a_move_ends_exactly_at_the_view(desk: Desk) -> None:
    wanted = done(desk, "save-view").view.camera
    start = turned(desk, 1.0).view.camera
    done(desk, "go view 1")
    seen = play(desk, 1.0)
    assert seen[0].camera == start and seen[-1].camera == wanted and desk.moving.motion is None
    assert len({each.camera for each in seen}) > 5, "there are views between"
    assert desk.document is not None and desk.document.scene.camera == wanted


def test_any_other_change_of_the_view_ends_the_move(desk: Desk) -> None:
    done(desk, "save-view")
    turned(desk, 1.0)
    done(desk, "go 1")
    play(desk, 0.2)
    here = turned(desk, 0.3).view
    assert play(desk, 0.5)[-1] == here and desk.moving.motion is None


def test_a_preview_goes_through_the_views_and_returns(desk: Desk) -> None:
    for angle in (0.0, 1.0, 1.0):
        turned(desk, angle)
        done(desk, "save-view")
    before = turned(desk, 0.5).view
    done(desk, "preview")
    assert desk.document is not None
    path = desk.document.tour
    seen = play(desk, path.seconds, 41)
    assert [seen[0].camera, seen[20].camera] == [each.camera for each in path.views[:2]]
    assert seen[-1] == before and desk.moving.motion is None
    desk.document.change_tour(Tour(path.views, closed=True))
    done(desk, "preview")
    play(desk, 3 * path.seconds, 10)
    assert desk.moving.motion is not None, "a closed path goes on until it is stopped"
    motion.stop(desk)


def test_a_preview_of_turns_goes_around(desk: Desk) -> None:
    document = turned(desk, 0.5)
    before = document.view
    motion.preview(desk, document, Turn("z", -0.5))
    assert desk.moving.motion is not None
    seen = play(desk, 0.999 * desk.moving.motion.seconds, 30)
    opposite = np.add(seen[-1].camera.eye, before.camera.eye) / 2 - before.camera.target
    assert np.abs(opposite[:2]).max() < 0.01 * before.camera.target_distance
    assert play(desk, 0.1)[-1] == before


def test_what_cannot_be_done_is_said(desk: Desk) -> None:
    done(desk, "go 3")
    assert "saved view '3' not found: there is none" in said(desk)
    done(desk, "save-view", "preview")
    assert "at least 2 saved views are needed, got 1" in said(desk)
    document = desk.document
    assert document is not None
    with pytest.raises(InputError, match="'up' not found: view 1"):
        saved_views.number_of(document.tour, "up")
    camera = document.view.camera
    document.change_tour(Tour(tuple(SavedView(f"v{n}", camera) for n in range(saved_views.MOST))))
    done(desk, "save-view")
    assert len(document.tour.views) == saved_views.MOST and "delete one first" in said(desk)


class Drawing:
    """Director that draws at once what is asked aside."""

    def __init__(self, shown: np.ndarray) -> None:
        self.shown = type("Shown", (), {"pixels": shown})()
        self.drawn: list[Any] = []

    def aside(self, scene: Any, size: tuple[int, int], showing: Any, take: Any) -> bool:
        assert not showing.annotation
        self.drawn.append(scene.camera)
        take(np.full((size[1], size[0], 3), len(self.drawn), np.uint8))
        return True


def test_small_pictures_are_drawn_while_their_list_is_shown_and_once_for_each_scene(desk: Desk) -> None:
    for _ in range(2):
        turned(desk, 1.0)
        document = done(desk, "save-view")
    director: Any = Drawing(np.zeros((30, 80, 4), np.uint8))  # with opacity, as while something moves
    desk.director = director
    small = desk.moving.thumbnails = Thumbnails()
    small.capture(director, document.tour.views[0].camera)
    assert small.pictures[document.tour.views[0].camera].pixels.shape == (SMALL[1], SMALL[0], 3)
    for _ in range(4):
        small.step(document, director)
    assert not director.drawn, "nobody looks"
    for _ in range(4):
        known = [small.get(view) for view in document.tour.views]
        small.step(document, director)
    assert set(director.drawn) == {each.camera for each in document.tour.views} and len(director.drawn) == 2
    assert all(each is not None and each.pixels.any() for each in known)
    desk.change(background=(0.5, 0.5, 0.5))
    small.get(document.tour.views[0])
    small.step(document, director)
    assert len(director.drawn) == 3, "another scene looks different"
    saved_views.delete(document, 0)
    small.get(document.tour.views[0])
    small.step(document, director)
    assert set(small.pictures) == {document.tour.views[0].camera}


def test_a_film_has_an_error_of_its_own_and_says_before_how_long_it_takes(desk: Desk) -> None:
    document, orders = desk.document, []
    assert document is not None
    desk.director = director = cast(Any, StillDirector())
    desk.write = lambda _, **job: orders.append(job)  # type: ignore[method-assign]
    exporting.film(desk, document, "turn-%d.png", (8, 8), 4, 30.0)
    assert orders[0]["accuracy"]["max_error"] == pytest.approx(4 / 255)
    size = (600, 400)
    assert film_accuracy.seconds(desk, document, size, 100) is None, "of a driver that is not known"
    known = {"renderer": "llvmpipe", "thickness": 0.01, "classification": "post"}
    director.shown = replace(director.shown, metadata=known)
    seconds = film_accuracy.seconds(desk, document, size, 100)
    assert seconds is not None and seconds > 0
    assert film_accuracy.seconds(desk, document, size, 200) == pytest.approx(2 * seconds)
    desk.moving.film_error /= 100
    exporting.film(desk, document, "longer-%d.png", size, 100, 30.0)
    longer = desk.moving.forecasts["longer-%d.png"]
    assert 5 * seconds < longer < 10 * seconds, "ten times the slabs, but no more pixels"
    director.shown = replace(director.shown, state="refining")
    assert film_accuracy.seconds(desk, document, size, 100) is None


def test_a_film_says_how_long_it_will_take(desk: Desk) -> None:
    desk.writing = 0.0
    for number in range(5):
        desk.now = 10 + 2.0 * number
        desk._hear(Answer("progress", 1, final=False, metadata={"done": number / 20}))
    assert desk.moving.left.text(desk.now) == "32 s left"
