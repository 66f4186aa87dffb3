"""The dock widget in napari itself: its pictures are those of the canvas, and it says what it can't draw."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from support.windows import PATIENCE, REPOSITORY, display  # noqa: F401 (a fixture)

from texvol.formats.pictures import image

PATHS = (REPOSITORY, REPOSITORY / "tests", REPOSITORY / "plugins" / "texvol-napari")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("napari")


@pytest.fixture
def found(display: str, folder: Path, kept: dict[str, Any]) -> dict[str, Any]:  # noqa: F811
    for needed in ("napari", "qtpy"):
        pytest.importorskip(needed, reason="napari is not installed: sh scripts/test_napari.sh runs this test")
    if not kept:
        environment = os.environ | {"DISPLAY": display, "QT_QPA_PLATFORM": "xcb", "HOME": str(folder)}
        environment["PYTHONPATH"] = os.pathsep.join(map(str, (*PATHS, os.environ.get("PYTHONPATH", ""))))
        program = REPOSITORY / "tests" / "support" / "napari_viewer.py"
        line = [sys.executable, "-W", "ignore", str(program), str(folder)]
        done = subprocess.run(line, env=environment, capture_output=True, text=True, timeout=2 * PATIENCE, check=False)
        assert done.returncode == 0, done.stderr[-4000:]
        kept.update(json.loads(done.stdout.splitlines()[-1]))
    return kept


@pytest.fixture(scope="module")
def kept() -> dict[str, Any]:
    return {}


@pytest.mark.slow
def test_pictures_are_the_canvas_s(found: dict[str, Any], folder: Path) -> None:
    """Both pictures are rounded to 255ths, by at most half of one: nearly the same numbers differ by less in the mean.

    Labels have edges, where the pictures may choose different samples. A picture that is a pixel beside differs more.
    """
    for name in ("scaled and rotated", "perspective", "gamma, limits and opacity", "channels", "time"):
        assert found[name]["mean"] < 0.5 < found[name]["shifted"], (name, found[name])
        assert found[name]["lit"] > 0.02 and "of the contrast limits" in found[name]["says"]
    assert found["labels"]["mean"] < found["labels"]["shifted"] and found["labels"]["mean"] < 10
    assert "saved as" in found["saved"]["says"] and image.read(folder / "layers.png").max() > 0.2


@pytest.mark.slow
def test_what_is_not_drawn_is_said(found: dict[str, Any]) -> None:
    says = {name: each["says"] for name, each in found.items() if "mean" not in each}
    assert "2D/3D" in says["slices"]
    assert says["hidden"] == "there must be a visible layer of images or labels, got none"
    assert all(word in says["left out"] for word in ("colours (rgb)", "got Points", "got Surface"))
    assert "has 2 axes" in says["flat"]
