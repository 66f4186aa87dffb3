"""The width of the panels is the same in the next window."""

from __future__ import annotations

from pathlib import Path

import pytest

from texvol.window import kept
from texvol.window.desk import PANEL_WIDTH


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path


def test_a_width_is_kept(folder: Path) -> None:
    assert kept.panel_width() == PANEL_WIDTH
    kept.keep(PANEL_WIDTH)
    assert not kept.state_file().exists(), "nothing was changed"
    kept.keep(412.5)
    assert kept.panel_width() == 412.5
    assert kept.state_file().is_relative_to(folder)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"panel-width": "wide"}', '{"panel-width": 1e9}', "\0"])
def test_a_damaged_file_is_as_none(text: str) -> None:
    kept.keep(412.5)
    kept.state_file().write_text(text)
    assert kept.panel_width() == PANEL_WIDTH


def test_a_folder_that_can_not_be_written_is_no_fault(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "file").write_text("")
    monkeypatch.setenv("XDG_STATE_HOME", str(folder / "file"))
    kept.keep(412.5)
    assert kept.panel_width() == PANEL_WIDTH
