"""Saved views in scene files: what is written is read again, and what is wrong is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from texvol.options.scene_options import SceneOptions
from texvol.scene.camera import Camera
from texvol.scene.tour import SavedView, Tour
from texvol.util.errors import InputError
from texvol.window import saving
from texvol.window.document import opened_file

THIRD = 1 / 3
TOUR = Tour(
    (
        SavedView(
            'the "front" \\ ü', Camera.perspective((30 * THIRD, -20, 13), (5, 5, THIRD), (0, THIRD, 1), fov=31.7)
        ),
        SavedView("flat", Camera.orthographic((0, 9, 1), (0, 0, 0), (0, 0, 1), height=17 * THIRD), seconds=0.1),
    ),
    closed=True,
    stops=False,
)
VIEW = 'eye = [9, 0, 0]\ntarget = "0,0,0"\nup = [0, 0, 1]\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    np.save(tmp_path / "v.npy", np.random.default_rng(0).random((6, 5, 4), np.float32))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def read(text: str) -> Tour:
    Path("s.toml").write_text(f'volume = "v.npy"\n{text}', encoding="utf-8")
    return SceneOptions.of(scene="s.toml").tour


def test_views_that_are_written_are_read_again(folder: Path) -> None:
    document = opened_file("v.npy", (40, 30))
    assert document.tour == Tour()
    document.change_tour(TOUR)
    saving.save_scene("s.toml", document, (40, 30))
    assert SceneOptions.of(scene="s.toml").tour == TOUR
    again = opened_file("s.toml", (40, 30))
    assert again.tour == TOUR and not again.unsaved and not again.history.past


def test_a_scene_without_views_has_no_word_of_them(folder: Path) -> None:
    document = opened_file("v.npy", (40, 30))
    saving.save_scene("s.toml", document, (40, 30))
    assert "tour" not in (text := Path("s.toml").read_text()) and "saved" not in text


def test_what_may_be_left_out(folder: Path) -> None:
    path = read(f"[[saved-view]]\n{VIEW}height = 3\n[[saved-view]]\nprojection = 'perspective'\n{VIEW}")
    assert [each.name for each in path.views] == ["view 1", "view 2"]
    assert path.views[0].camera == Camera.orthographic((9, 0, 0), (0, 0, 0), (0, 0, 1), 3)
    assert path.views[1].camera.fov == 40 and path.views[1].seconds == 2 and not path.closed and path.stops
    assert read(f"saved_view = [{{{VIEW.strip()}, height = 3}}]".replace("\n", ", ")).views == path.views[:1]


@pytest.mark.parametrize(
    "text, message",
    [
        ("saved-view = 3", r"saved-view: must be tables \[\[saved-view\]\], got 3"),
        ("[[saved-view]]\nname = 'x'", r"view 1 \(x\): eye, target, up, height must be given"),
        (f"[[saved-view]]\n{VIEW}", r"view 1 \(view 1\): height must be given"),
        (f"[[saved-view]]\n{VIEW}height = 3\nspeed = 2", "view 1: unknown key 'speed'; keys are name, projection"),
        (f"[[saved-view]]\n{VIEW}height = -3", "height must be positive"),
        (f"[[saved-view]]\n{VIEW}height = 3\nprojection = 'flat'", "projection must be orthographic or perspective"),
        (f"[[saved-view]]\n{VIEW}height = 3\nseconds = 'two'", "seconds must be a positive number"),
        (f"[[saved-view]]\n{VIEW}height = 3\nname = 7", "name must be one line of text, got 7"),
        ("tour = 7", r"tour: must be a table \[tour\], got 7"),
        ("[tour]\nclosed = 'yes'", "tour: closed must be true or false, got 'yes'"),
        ("[tour]\nclose = true", "unknown key 'close'; keys are closed, stops; did you mean 'closed'"),
        ("save-view = 3", "unknown scene option 'save-view'"),
    ],
)
def test_what_is_wrong_is_named(folder: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=f"^s.toml: .*{message}"):
        read(text)
