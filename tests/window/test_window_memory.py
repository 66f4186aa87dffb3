"""Memory of the window: what is closed, undone or replaced is let go."""

from __future__ import annotations

import gc
import weakref
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from support.desks import desk_with, done, said

from texvol.scene import content
from texvol.util.errors import InputError
from texvol.window import saved_views
from texvol.window.desk import Desk
from texvol.window.jobs import Answer
from texvol.window.navigation import orbit


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two volumes, in the current folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    for name in ("one", "two"):
        np.save(tmp_path / f"{name}.npy", np.random.default_rng(3).random((6, 7, 8)).astype(np.float32))


@pytest.fixture
def desk() -> Desk:
    """A desk with the first volume open, and a picture of it."""
    opened = desk_with("one.npy")
    shown = SimpleNamespace(pixels=np.zeros((30, 80, 4), np.uint8))
    opened.director = cast(Any, SimpleNamespace(faults=[], shown=shown))
    return opened


def test_content_is_kept_of_the_open_document_only(desk: Desk) -> None:
    first = done(desk, "frame").scene.volume
    assert first in content._KNOWN
    done(desk, "open two.npy", "frame")
    assert first not in content._KNOWN and desk.document.scene.volume in content._KNOWN  # type: ignore[union-attr]
    assert done(desk, "undo", "frame").scene.volume is first and first in content._KNOWN


def test_small_pictures_of_views_that_are_gone_are_dropped_though_nobody_looks(desk: Desk) -> None:
    thumbnails = desk.moving.thumbnails
    for number in range(5):
        assert desk.document is not None
        desk.document.look(orbit(desk.document.view, 1.0, 0.1))
        saved_views.delete(done(desk, "save-view"), 0)
        thumbnails.step(desk.document, desk.director)
        assert not thumbnails.pictures, number


def test_a_document_that_is_dropped_leaves_no_volume(desk: Desk) -> None:
    thumbnails = desk.moving.thumbnails
    before = done(desk, "frame", "save-view", "layout")
    thumbnails.pictures[before.view.camera] = thumbnails.pictures[before.view.camera]._replace(scene=before.scene)
    volume = weakref.ref(before.scene.volume)
    done(desk, "open two.npy")
    desk.replaced.drop(before)
    thumbnails.step(desk.document, desk.director)
    del before
    gc.collect()
    assert volume() is None


class Dying:
    """A clerk whose process ends with each picture, and is started again with the next, as `Painter.ask` does."""

    alive = False
    starts = True

    def ask(self, **job: Any) -> None:
        if not self.starts:
            raise InputError("cannot start a painting process: no memory")
        self.number = job

    def drop(self) -> None: ...

    def answers(self) -> list[Answer]:
        return [Answer("failed", 1, text="the painting process ended unexpectedly")]


def test_a_clerk_that_has_ended_is_started_again_and_no_other_one_is_kept(desk: Desk) -> None:
    clerk, made = Dying(), []
    desk.director.accuracy, desk.director.shown = {}, None  # type: ignore[misc]
    desk.make_painter = lambda: cast(Any, made.append(clerk) or clerk)
    for number in range(3):
        done(desk, f"picture {number}.png")
        assert desk.writing is not None
        desk.update()
        assert "ended unexpectedly" in said(desk) and desk.writing is None
    assert len(made) == 1, "whoever makes painters holds each until the window is closed"
    clerk.starts = False
    done(desk, "picture 4.png")
    assert "no memory" in said(desk) and desk.writing is None and not desk.orders
