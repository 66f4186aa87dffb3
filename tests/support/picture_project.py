"""A small project with picture tests, in a folder of its own, and runs of pytest in it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

# Loaded here once: in runs within this process they would be loaded anew for each, and OpenImageIO ends it then.
import OpenImageIO  # noqa: F401
import pytest

from texvol.comparison import ci, entries, index_page, page  # noqa: F401
from texvol.comparison.pictures import Picture, read_picture
from texvol.pytest_plugin import checking, pending, report, session  # noqa: F401

HEADER = """
import numpy as np
import pytest

def waves(shift=0.0, height=24, width=32):
    y, x = np.mgrid[:height, :width]
    light = 0.5 + 0.4 * np.sin((x - shift) / 4) * np.cos(y / 5)
    return np.dstack([light, light**2, light / 2, np.ones_like(light)]).astype(np.float32)

def spots():
    # Three pixels in 768, 0.4%, off by 0.05: rms 0.003, which two drivers may differ by, and one may not.
    picture = waves()
    picture[4, 3:12:4, :3] += np.float32(0.05)
    return picture
"""


_NAMES: dict[str, Any] = {}
exec(HEADER, _NAMES)
waves: Callable[..., np.ndarray] = _NAMES["waves"]
spots: Callable[[], np.ndarray] = _NAMES["spots"]


OF_CI = ("CI", "GITHUB_ACTIONS", "GITHUB_STEP_SUMMARY", "GITHUB_WORKSPACE")
# Hypothesis, Zarr and anyio have plugins, which take a second to load, in each run anew. A test file that is written
# anew in the second of the last one, with as many bytes, would be taken for it where that is kept compiled.
UNUSED = "-p no:hypothesispytest -p no:zarr -p no:anyio"
OPTIONS = {"PYTEST_ADDOPTS": f"{UNUSED} -p no:cacheprovider", "PYTHONDONTWRITEBYTECODE": "1"}
ALONE = {name: text for name, text in os.environ.items() if name not in OF_CI} | OPTIONS


class Project:
    """A folder with tests, as somebody would have it who uses texvol; without a Pytester it has runs apart only."""

    def __init__(self, folder: Path, pytester: pytest.Pytester | None = None) -> None:
        self.folder = folder
        self._pytester = pytester

    def write(self, **files: str) -> None:
        """Test files by name, without suffix; each begins with `HEADER`."""
        for name, text in files.items():
            path = self.folder / f"{name.replace('__', '/')}.py"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(HEADER + text, encoding="utf-8")

    def check(self, picture: str, name: str = "waves", **options: object) -> None:
        """One test that checks one picture."""
        more = "".join(f", {key}={value!r}" for key, value in options.items())
        self.write(test_it=f"def test_it(check_picture):\n    check_picture({picture}, {name!r}{more})\n")

    def limits(self, text: str) -> None:
        """The file of limits."""
        self.references.mkdir(exist_ok=True)
        (self.references / "limits.toml").write_text(text, encoding="utf-8")

    @property
    def references(self) -> Path:
        return self.folder / "references"

    def store(self, picture: np.ndarray, name: str = "waves", **attributes: str) -> Path:
        """Make a reference of an array."""
        from texvol.pytest_plugin import references

        stored = Picture.of_array(picture, name, {key.replace("__", ":"): text for key, text in attributes.items()})
        path = self.references / f"{name}.exr"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(references.encoded(path, stored))
        return path

    def stored(self, name: str = "waves") -> Picture:
        return read_picture(self.references / f"{name}.exr")

    def run(self, *arguments: str | os.PathLike[str]) -> pytest.RunResult:
        """A run of pytest in this process."""
        assert self._pytester is not None
        return self._pytester.runpytest_inprocess(*arguments)

    def run_apart(self, *arguments: str | os.PathLike[str], **environment: str) -> pytest.RunResult:
        """A run of pytest in a process of its own."""
        done = subprocess.run(
            [sys.executable, "-m", "pytest", *arguments],
            cwd=self.folder,
            env=ALONE | environment,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
        return pytest.RunResult(done.returncode, done.stdout.splitlines(), done.stderr.splitlines(), 0.0)

    def report(self, folder: str = "report") -> dict[str, Any]:
        """report.json, its pictures by name."""
        content = json.loads((self.folder / folder / "report.json").read_text("utf-8"))
        return content | {"by_name": {each["name"]: each for each in content["pictures"]}}


def said(result: pytest.RunResult) -> str:
    """All that a run printed."""
    return "\n".join(result.outlines + result.errlines)


def leave_ci(monkeypatch: pytest.MonkeyPatch) -> None:
    """Set the environment of runs within this process as `ALONE` has it."""
    for name in OF_CI:
        monkeypatch.delenv(name, raising=False)
    for name, text in OPTIONS.items():
        monkeypatch.setenv(name, text)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)


@pytest.fixture
def project(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Project:
    """An empty project, in no CI system."""
    leave_ci(monkeypatch)
    return Project(pytester.path, pytester)
