"""Unsaved scenes of a window that does not end as it should are in files."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Any

import pytest
from support.desks import desk_with, done
from support.unlost import RED, folder  # noqa: F401 (a fixture)

from texvol.util.termination import Terminated
from texvol.window import own_files, recent, rescue


def test_an_error_of_the_window_leaves_unsaved_scenes_in_files(folder: Path) -> None:  # noqa: F811
    desk = desk_with("one.npy")
    desk.change(background=RED)
    done(desk, "open two.npy")
    with pytest.raises(RuntimeError) as ended, rescue.rescuing(desk):
        raise RuntimeError("OpenGL: GL_OUT_OF_MEMORY")
    path = folder / "state/texvol/rescued/one-1.toml"
    assert ended.value.__notes__ == [f"texvol: the unsaved scene is in {path}, and among the recent files"]
    assert desk_with(str(path)).document.scene.background == RED  # type: ignore[union-attr]
    assert recent.files()[0].path == str(path)


@pytest.mark.parametrize("end", [KeyboardInterrupt(), Terminated(signal.SIGTERM), Terminated(signal.SIGHUP)])
def test_a_window_that_is_ended_from_outside_leaves_unsaved_scenes_in_files(
    folder: Path,  # noqa: F811
    end: BaseException,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """A terminal that is closed, a session that ends: nobody can be asked."""
    desk = desk_with("one.npy")
    desk.change(background=RED)
    with pytest.raises(type(end)), rescue.rescuing(desk):
        raise end
    path = folder / "state/texvol/rescued/one-1.toml"
    assert capsys.readouterr().err == f"texvol: the unsaved scene is in {path}, and among the recent files\n"
    assert desk_with(str(path)).document.scene.background == RED  # type: ignore[union-attr]


def test_two_windows_that_end_at_once_leave_their_scenes_in_files_of_their_own(
    folder: Path,  # noqa: F811
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The other window takes the name just after this one has found it free."""
    look, taken = own_files.unused, folder / "state/texvol/rescued/one-1.toml"

    def interrupted(*how: Any) -> str:
        found = look(*how)
        if not taken.exists():
            taken.write_text("# of the other window")
        return found

    monkeypatch.setattr(rescue, "unused", interrupted)
    desk = desk_with("one.npy")
    desk.change(background=RED)
    (path,) = rescue.save(desk)
    assert taken.read_text() == "# of the other window" and path == str(taken.with_name("one-2.toml"))
    assert desk_with(path).document.scene.background == RED  # type: ignore[union-attr]
