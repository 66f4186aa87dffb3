"""A view that nobody has chosen shows the whole box, whatever becomes of the window and of the scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.framing import filled
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.window import navigation
from texvol.window.document import Document, opened_file
from texvol.window.handles import position_of

WIDE, NARROW = (400, 200), (150, 400)
FOG = TransferFunction([0.0, 1.0], np.ones((2, 3)), [0.0, 0.1])
FAR = Volume(np.ones((4, 4, 4), np.float32), origin=(50, 0, 0))


@pytest.fixture
def document(tmp_path: Path) -> Document:
    np.save(tmp_path / "v.npy", np.ones((6, 9, 12), np.float32))
    return opened_file(str(tmp_path / "v.npy"), WIDE)


def margin(camera: Camera, box: Volume, size: tuple[int, int]) -> float:
    """How far the box stays away from the nearest edge of the picture, in shares of its half height or width."""
    corners = np.array([position_of(camera, corner) for corner in box.corners_from_centre + box.centre])
    aspect = size[0] / size[1]
    return 1 - max(np.abs(corners[:, 0]).max() / aspect, np.abs(corners[:, 1]).max())


@pytest.mark.parametrize("size", [NARROW, WIDE, (400, 400)])
def test_another_size_of_the_window_shows_the_whole_box(document: Document, size: tuple[int, int]) -> None:
    before = document.view.camera
    document.fit(size)
    after = document.view.camera
    assert 0 <= margin(after, document.scene.box, size) < 0.3
    assert np.allclose(after.forward, before.forward) and document.scene.camera is after
    document.fit(WIDE)
    assert margin(document.view.camera, document.scene.box, WIDE) == pytest.approx(
        margin(before, document.scene.box, WIDE), abs=1e-9
    )


def test_a_view_that_was_chosen_stays(document: Document) -> None:
    document.look(navigation.along_axis(document.view, "+x", document.scene.box, 2.0))
    chosen = document.view
    document.fit(NARROW)
    document.change(added=(AddedVolume(FAR, FOG),))
    assert document.view is chosen


def test_a_camera_of_the_scene_file_stays(document: Document, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text('volume = "v.npy"\neye = [40, 30, 20]\n')
    from_file = opened_file(str(tmp_path / "s.toml"), WIDE)
    before = from_file.view
    from_file.fit(NARROW)
    assert from_file.view is before


def test_what_is_added_is_seen_and_undone_the_view_is_as_before(document: Document) -> None:
    before = document.view.camera
    document.change(added=(AddedVolume(FAR, FOG),))
    both = document.view.camera
    shown = filled(both, document.scene, WIDE[0] / WIDE[1])
    assert both.height == pytest.approx(shown.height) and both.height > 2 * before.height
    document.undo()
    assert document.view.camera.height == pytest.approx(before.height)
    document.redo()
    assert document.view.camera.height == pytest.approx(both.height)
    inside = Volume(np.ones((2, 2, 2), np.float32), origin=(4, 3, 1))
    kept = document.view
    document.change(added=(*document.scene.added, AddedVolume(inside, FOG)))
    assert document.view is kept, "the box is the same"
