"""`texvol view` without the libraries of the window: an error that says what to install."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from texvol.__main__ import main


@pytest.mark.parametrize(("line", "extra"), [(("view", "a.npy"), "view"), (("view", "a.npy", "--serve"), "serve")])
def test_without_its_libraries_the_window_says_what_to_install(
    line: tuple[str, ...], extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture
) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("a.npy", np.zeros((3, 3, 3), np.float32))
    monkeypatch.delitem(sys.modules, "texvol.window.application", raising=False)
    monkeypatch.setitem(sys.modules, "imgui_bundle", None)
    assert main(list(line)) == 2
    said = capsys.readouterr().err
    assert "needs imgui_bundle, which is not installed: pip install" in said
    assert f"[{extra}]" in said
    assert "Traceback" not in said
